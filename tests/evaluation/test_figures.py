"""Figures: each draws the data it is given, labelled, in styles that print in grey tells apart."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.lines import Line2D

from baselines.evaluation.drawing import Format, controller_styles, draw, save_figure
from baselines.evaluation.episode_spec import Setup, episode_specs, play
from baselines.evaluation.figures import (
    acceleration_figure,
    index_figure,
    reference_figure,
    velocity_figure,
)
from baselines.evaluation.gallery import draw_gallery
from baselines.evaluation.results import EpisodeResult, ResultsFolder
from baselines.registry import CONTROLLERS
from crane_env import Trajectory


@pytest.fixture(scope="module")
def trajectories() -> dict[str, Trajectory]:
    """Manoeuvre 1 until after the lift."""
    specs = episode_specs(["manual", "linear"], ["table1:1"], [0], Setup(max_steps=300))
    return {spec.controller: play(spec) for spec in specs}


@pytest.fixture(scope="module")
def driven() -> dict[str, Trajectory]:
    """Manoeuvre 1, without help, by two equals and by one that differs from them."""
    specs = episode_specs(["manual", "adaptive", "ltv"], ["table1:1"], [0], Setup())
    runs = {spec.controller: play(spec) for spec in specs}
    swaying = 0.2 * np.sin(2.0 * runs["adaptive"].time) + runs["adaptive"].payload_velocity
    return {**runs, "linear": dataclasses.replace(runs["adaptive"], payload_velocity=swaying)}


def lines_of(axes: Axes) -> dict[str, Line2D]:
    return {str(line.get_label()): line for line in axes.lines}


def assert_draws(line: Line2D, time: np.ndarray, values: np.ndarray) -> None:
    np.testing.assert_array_equal(line.get_xdata(), time)
    np.testing.assert_array_equal(line.get_ydata(), values)


def test_fig_3_draws_cable_length_and_travel_reference_with_the_instants(
    trajectories: Mapping[str, Trajectory],
) -> None:
    trajectory = trajectories["manual"]
    figure = reference_figure(
        trajectory, "on the moon", {"$t_1$": 1.83, "$t_2$": 4.21, "$t_3$": 12.24}
    )
    length, reference = figure.axes
    assert_draws(length.lines[0], trajectory.time, trajectory.cable_length)
    assert_draws(reference.lines[0], trajectory.time, trajectory.travel_reference)
    assert reference.lines[0].get_drawstyle() == "steps-post"
    for axes in (length, reference):
        assert [line.get_xdata()[0] for line in axes.lines[1:]] == [1.83, 4.21]
    assert [text.get_text() for text in length.texts] == ["$t_1$", "$t_2$"]
    assert length.get_title(loc="left") == "(a) cable length [m]"
    assert reference.get_title(loc="left") == "(b) travel reference [m/s]"
    assert reference.get_xlabel() == "time [s], on the moon"


def test_fig_4_shows_the_unhelped_crane_apart_and_equals_by_their_difference_and_at_the_release(
    driven: Mapping[str, Trajectory],
) -> None:
    apart, together, difference, release = velocity_figure(driven, "manoeuvre").axes
    near = ["adaptive", "ltv", "linear"]
    for axes, names in ((apart, ["manual"]), (together, near), (release, near)):
        lines = lines_of(axes)
        assert list(lines) == [*names, "travel reference"]
        assert lines["travel reference"].get_drawstyle() == "steps-post"
        for name in names:
            assert_draws(lines[name], driven[name].time, driven[name].payload_velocity)
            assert to_hex(lines[name].get_color()) == controller_styles([name])[name].colour
    differences = lines_of(difference)
    assert list(differences) == ["adaptive", "ltv"]
    velocities = (driven[name].payload_velocity for name in ("ltv", "adaptive"))
    gap = 1e3 * np.subtract(*velocities)
    assert_draws(differences["ltv"], driven["ltv"].time, gap)
    title = "(c) difference from adaptive [mm/s]; linear: up to 200"
    assert difference.get_title(loc="left") == title
    low, high = release.get_xlim()
    assert low < 12.24 < high < driven["ltv"].time[-1]  # t_3 of manoeuvre 1
    assert together.patches  # shaded where it is enlarged


def test_fig_5_is_scaled_to_what_is_used_and_tells_or_draws_the_limits(
    driven: Mapping[str, Trajectory],
) -> None:
    apart, together, release = acceleration_figure(driven, "manoeuvre").axes
    np.testing.assert_array_equal(lines_of(apart)["limits"].get_ydata(), 5.0)
    assert apart.get_ylim()[1] > 5.0
    assert together.get_title(loc="left") == "(b) trolley acceleration [m/s²]; limits ±5"
    for axes in (together, release):
        assert max(np.abs(axes.get_ylim())) < 3.0
        assert list(lines_of(axes)) == ["adaptive", "ltv", "linear"]
    assert_draws(lines_of(release)["ltv"], driven["ltv"].time, driven["ltv"].acceleration)


def test_a_motion_is_drawn_of_one_controller_and_without_a_release(
    trajectories: Mapping[str, Trajectory],
) -> None:
    for name in trajectories:
        (panel,) = velocity_figure({name: trajectories[name]}, "half a manoeuvre").axes
        assert list(lines_of(panel)) == [name, "travel reference"]


def marks(axes: Axes) -> dict[str, list[tuple[float, float]]]:
    """Controller to operator's place and value of its marks."""
    found: dict[str, list[tuple[float, float]]] = {}
    for container in axes.containers:
        places, heights = container.lines[0].get_data()
        name = str(container.get_label())
        if len(places):
            found.setdefault(name, []).extend(zip(np.rint(places), heights, strict=True))
    return found


def test_figs_6_and_7_draw_means_with_their_spread_and_leave_out_what_is_not_defined() -> None:
    values = {
        "linear": {"random": np.array([1.0, 2.0, 6.0]), "manoeuvre": np.array([4.0, 4.0])},
        "adaptive": {"random": np.array([3.0, np.nan, 5.0]), "manoeuvre": np.array([np.nan])},
    }
    (axes,) = index_figure(values, "IAE [m]").axes
    assert marks(axes)["linear"] == [(0.0, 3.0), (1.0, 4.0)]
    assert marks(axes)["adaptive"][0] == (0.0, 4.0)
    linear = next(c for c in axes.containers if c.get_label() == "linear")
    ends = [segment[:, 1].tolist() for segment in linear.lines[2][0].get_segments()]
    deviation = np.sqrt((4.0 + 1.0 + 9.0) / 2.0)
    np.testing.assert_allclose(ends, [[3.0 - deviation, 3.0 + deviation], [4.0, 4.0]])
    assert [tick.get_text() for tick in axes.get_xticklabels()] == ["random", "manoeuvre"]
    assert (axes.get_title(loc="left"), axes.get_xlabel()) == ("IAE [m]", "operator")


def test_an_index_far_from_the_others_has_a_panel_apart_and_luck_is_hollow_and_told() -> None:
    drifts = {"manual": [1.9, 0.1], "linear": [1.8, 1.7], "adaptive": [1.4, 1.6]}
    values = {
        name: {f"table1:{place}": np.array([drift]) for place, drift in enumerate(row, start=1)}
        for name, row in drifts.items()
    }
    values |= {"worse": {name: 9.0 + row for name, row in values["linear"].items()}}
    figure = index_figure(values, "drift [m]", {"manual": {"table1:2"}})
    worse, apart, together = figure.axes
    assert list(marks(worse)) == ["worse"]
    assert marks(apart) == {"manual": [(0.0, 1.9), (1.0, 0.1)]}
    assert list(marks(together)) == ["linear", "adaptive"]
    faces = [to_hex(container.lines[0].get_markerfacecolor()) for container in apart.containers]
    assert faces == [controller_styles(["manual"])["manual"].colour, "#ffffff"]
    assert "low by luck" in str(figure.get_supxlabel())
    assert [tick.get_text() for tick in together.get_xticklabels()] == ["1", "2"]
    assert together.get_xlabel() == "manoeuvre of Table I"
    assert not index_figure(values, "drift [m]").get_supxlabel()


def test_a_controller_keeps_its_style_and_none_differ_by_colour_alone() -> None:
    everyone = controller_styles([*CONTROLLERS, "my.module:mine"])
    main = controller_styles(["manual", "linear", "adaptive", "nmpc-a", "nmpc-b", "ltv", "ppo"])
    assert main == {name: everyone[name] for name in main}
    shown = controller_styles([*main, "my.module:mine", "my.module:other"]).values()
    for attribute in ("colour", "marker"):
        assert len({getattr(style, attribute) for style in shown}) == len(shown)
    assert len({(style.dashes, style.width) for style in shown}) == len(shown)
    assert len(controller_styles(f"a{number}" for number in range(30))) == 30


@pytest.mark.parametrize(
    ("kind", "begins"), [("png", b"\x89PNG"), ("pdf", b"%PDF"), ("svg", b"<?x")]
)
def test_a_figure_is_the_same_file_each_time_in_every_format_or_none(
    kind: Format, begins: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def figure() -> Figure:
        return index_figure({"manual": {"random": np.array([1.0])}}, "IAE [m]")

    for name in ("first", "second"):
        save_figure(figure(), tmp_path / name, kind)
    data = (tmp_path / "first").read_bytes()
    assert data == (tmp_path / "second").read_bytes()
    assert data.startswith(begins)
    assert b"/Type3" not in data

    def fail(self: Figure, target: Path, **_: object) -> None:
        target.write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Figure, "savefig", fail)
    drawn = draw({tmp_path / "third": figure, tmp_path / "fourth": figure}, [kind])
    assert not drawn.files
    assert [failure.rpartition(": ")[2] for failure in drawn.failures] == [
        "No space left on device."
    ] * 2
    assert {path.name for path in tmp_path.iterdir()} == {"first", "second"}


def test_the_gallery_draws_figs_3_to_7_of_what_finished_as_far_as_it_can(tmp_path: Path) -> None:
    folder = ResultsFolder(tmp_path)
    folder.prepare()
    specs = episode_specs(["manual", "linear"], ["table1:2", "random"], [0], Setup(max_steps=150))
    results = []
    for spec in specs[1:]:
        trajectory = play(spec)
        folder.save_trajectory(spec, trajectory)
        results.append(EpisodeResult(spec, trajectory.metrics(), 0.1))
    failed = EpisodeResult(specs[0], None, 0.1, failure="ValueError: no")
    drawn = draw_gallery([failed, *results], folder, ["png", "svg"])
    assert [file.name for file in drawn.files] == [
        f"fig{number}.{kind}" for number in range(3, 8) for kind in ("png", "svg")
    ]
    assert all(imread(file).std() > 0.0 for file in drawn.files[::2])
    assert not drawn.failures
    assert not draw_gallery([failed], folder, ["png"]).files
    folder.trajectory_file(specs[1]).unlink()
    drawn = draw_gallery([failed, *results], folder, ["png"])
    assert [file.name for file in drawn.files] == ["fig6.png", "fig7.png"]
    assert len(drawn.failures) == 3


def test_drawing_imports_matplotlib_late_and_pyplot_never() -> None:
    code = (
        "import sys, numpy, baselines.evaluation.figures\n"
        "import baselines.evaluation.gallery, baselines.evaluation.comparison\n"
        "assert 'matplotlib' not in sys.modules\n"
        "values = {'manual': {'random': numpy.ones(1)}}\n"
        "baselines.evaluation.figures.index_figure(values, 'IAE [m]').canvas.draw()\n"
        "print('matplotlib.figure' in sys.modules, 'matplotlib.pyplot' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["True", "False"]
