"""Figures: each draws the data it is given, labelled, in the same colours, touching no global."""

from __future__ import annotations

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

from baselines.evaluation.episode_spec import Setup, episode_specs, play
from baselines.evaluation.figures import (
    COLOURS,
    RESOLUTION,
    WIDTH,
    controller_colours,
    index_figure,
    reference_figure,
    save_figure,
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


def line_of(axes: Axes, label: str) -> Line2D:
    (line,) = (line for line in axes.lines if line.get_label() == label)
    return line


def assert_draws(line: Line2D, time: np.ndarray, values: np.ndarray) -> None:
    np.testing.assert_array_equal(line.get_xdata(), time)
    np.testing.assert_array_equal(line.get_ydata(), values)


def test_fig_3_draws_cable_length_and_travel_reference_with_the_instants(
    trajectories: Mapping[str, Trajectory],
) -> None:
    trajectory = trajectories["manual"]
    figure = reference_figure(trajectory, "title", {"$t_1$": 1.83, "$t_2$": 4.21, "$t_3$": 12.24})
    length, reference = figure.axes
    assert_draws(length.lines[0], trajectory.time, trajectory.cable_length)
    assert_draws(reference.lines[0], trajectory.time, trajectory.travel_reference)
    assert reference.lines[0].get_drawstyle() == "steps-post"
    for axes in (length, reference):
        assert [line.get_xdata()[0] for line in axes.lines[1:]] == [1.83, 4.21]
    assert [text.get_text() for text in length.texts] == ["$t_1$", "$t_2$"]
    assert length.get_ylabel() == "cable length [m]"
    assert reference.get_ylabel() == "travel reference [m/s]"
    assert reference.get_xlabel() == "time [s]"
    assert figure.get_suptitle() == "title"


def test_fig_4_draws_reference_and_payload_velocity_of_each_controller(
    trajectories: Mapping[str, Trajectory],
) -> None:
    figure = velocity_figure(trajectories, "title")
    colours = controller_colours(trajectories)
    for axes, (name, trajectory) in zip(figure.axes, trajectories.items(), strict=True):
        reference, velocity = line_of(axes, "travel reference"), line_of(axes, "payload velocity")
        assert_draws(reference, trajectory.time, trajectory.travel_reference)
        assert_draws(velocity, trajectory.time, trajectory.payload_velocity)
        assert axes.get_title(loc="left") == name
        assert to_hex(velocity.get_color()) == colours[name]
    assert figure.get_supylabel().startswith("velocity [m/s]")
    assert figure.axes[-1].get_xlabel() == "time [s]"


def test_figs_6_and_7_draw_means_with_their_spread_and_leave_out_what_is_not_defined() -> None:
    values = {
        "linear": {"random": np.array([1.0, 2.0, 6.0]), "manoeuvre": np.array([4.0, 4.0])},
        "adaptive": {"random": np.array([3.0, np.nan, 5.0]), "manoeuvre": np.array([np.nan])},
    }
    figure = index_figure(values, "IAE [m]", "title")
    (axes,) = figure.axes
    linear, adaptive = (c for c in axes.containers if c.get_label() in values)
    assert [bar.get_height() for bar in linear] == [3.0, 4.0]
    assert [bar.get_height() for bar in adaptive] == [4.0]
    (whiskers,) = linear.errorbar.lines[2]
    ends = [segment[:, 1].tolist() for segment in whiskers.get_segments()]
    deviation = np.sqrt((4.0 + 1.0 + 9.0) / 2.0)
    np.testing.assert_allclose(ends, [[3.0 - deviation, 3.0 + deviation], [4.0, 4.0]])
    assert [tick.get_text() for tick in axes.get_xticklabels()] == ["random", "manoeuvre"]
    assert axes.get_ylabel() == "IAE [m]"
    assert axes.get_xlabel() == "operator"
    assert [text.get_text() for text in figure.legends[0].get_texts()] == list(values)
    assert to_hex(linear[0].get_facecolor()) == controller_colours(values)["linear"]
    written = [text.get_text() for text in axes.texts]
    assert written == ["3.00", "4.00", "4.00"]


def test_a_controller_keeps_its_colour_and_shares_it_with_none() -> None:
    some = list(CONTROLLERS)[: len(COLOURS)]
    colours = controller_colours(some)
    assert len(set(colours.values())) == len(some)
    assert controller_colours(reversed(some)) == colours
    assert controller_colours(some[1:2]) == {some[1]: colours[some[1]]}
    mixed = controller_colours(["my.module:mine", *some[:4], "my.module:other"])
    assert len(set(mixed.values())) == 6
    assert {name: mixed[name] for name in some[:4]} == {name: colours[name] for name in some[:4]}
    assert len(controller_colours(f"a{number}" for number in range(20))) == 20


def test_a_saved_figure_is_a_png_of_the_right_size_or_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    figure = index_figure({"manual": {"random": np.array([1.0])}}, "IAE [m]", "title")
    path = tmp_path / "fig6.png"
    save_figure(figure, path)
    assert imread(path).shape[1] == WIDTH * RESOLUTION
    assert list(tmp_path.iterdir()) == [path]

    def fail(self: Figure, target: Path, **_: object) -> None:
        target.write_bytes(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr(Figure, "savefig", fail)
    with pytest.raises(KeyboardInterrupt):
        save_figure(figure, tmp_path / "fig7.png")
    assert list(tmp_path.iterdir()) == [path]


def test_the_gallery_draws_figs_3_to_7_of_what_finished(tmp_path: Path) -> None:
    folder = ResultsFolder(tmp_path)
    folder.prepare()
    specs = episode_specs(["manual", "linear"], ["table1:2", "random"], [0], Setup(max_steps=150))
    results = [
        EpisodeResult(spec, folder.save_episode(spec, play(spec), 0.1, "trajectories"), 0.1)
        for spec in specs[1:]
    ]
    failed = EpisodeResult(specs[0], None, 0.1, failure="ValueError: no")
    files = draw_gallery([failed, *results], folder)
    assert [file.name for file in files] == [f"fig{number}.png" for number in range(3, 8)]
    assert all(imread(file).std() > 0.0 for file in files)
    assert draw_gallery([failed], folder) == []


def test_drawing_imports_matplotlib_late_and_pyplot_never() -> None:
    code = (
        "import sys, numpy, baselines.evaluation.figures\n"
        "import baselines.evaluation.gallery, baselines.evaluation.comparison\n"
        "assert 'matplotlib' not in sys.modules\n"
        "values = {'manual': {'random': numpy.ones(1)}}\n"
        "baselines.evaluation.figures.index_figure(values, 'IAE [m]', 'title').canvas.draw()\n"
        "print('matplotlib.figure' in sys.modules, 'matplotlib.pyplot' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["True", "False"]
