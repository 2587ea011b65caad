"""Film: the command line, the files it writes and what it refuses."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import gymnasium
import imageio_ffmpeg
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from baselines import make_controller
from baselines.commands.film import main
from crane_env import run_episode
from crane_env.rendering.film import write_film

SHORT = ("--seconds", "0.4", "--rate", "10")
"""Pictures of the start and of every fifth of 20 control periods."""


def frames(gif: Path) -> tuple[int, tuple[int, int]]:
    """Number and size of a film's pictures."""
    with Image.open(gif) as film:
        return film.n_frames, film.size


@pytest.mark.parametrize("ending", ["mp4", "gif"])
def test_two_controllers_are_filmed_side_by_side(
    tmp_path: Path, ending: str, capfd: pytest.CaptureFixture[str]
) -> None:
    film = tmp_path / "new" / f"both.{ending}"
    given = ("--controller", "manual", "--against", "adaptive", "--width", "640", *SHORT, str(film))
    assert main(given) == 0
    if ending == "gif":
        assert frames(film) == (5, (640, 256))
    assert imageio_ffmpeg.count_frames_and_secs(film) == (5, 0.5)
    assert capfd.readouterr().out == f"Film: {film}.\n"
    assert [path.name for path in film.parent.iterdir()] == [film.name]


def test_a_recording_brings_its_crane_its_start_its_task_and_its_length(tmp_path: Path) -> None:
    arguments = {"operator": "random", "parameters": "field", "task": "position"}
    env = gymnasium.make("OILCrane-v0", **arguments)
    options = {"sway_angle": 0.2}
    recorded = run_episode(env, make_controller("manual"), seed=0, options=options, max_steps=15)
    recorded.to_parquet(tmp_path / "episode.parquet")
    operator = f"recording:{tmp_path / 'episode.parquet'}"
    film = tmp_path / "again.gif"
    given = ("--controller", "manual", "--operator", operator, "--rate", "10", str(film))
    assert main(given) == 0
    assert frames(film) == (4, (640, 512))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (("film.avi",), r"A film ends in \.mp4 or \.gif; 'film\.avi' not\."),
        (("film.gif", "--against", "none"), "Unknown controller 'none'"),
        (("film.gif", "--operator", "person:trained"), "A person needs a task"),
        (("film.gif", "--task", "dance"), "Unknown task 'dance'"),
        (("film.gif", "--operator", "recording:none"), "There is no trajectory 'none'"),
        (("film.gif", "--rate", "0"), "rate must be a positive"),
        (("film.gif", "--seconds", "inf"), "seconds must be from"),
        (("film.gif", "--width", "3"), "width must be a whole number"),
        (("film.gif", "--seed", "-1"), "A seed must be"),
        (("there", "--operator", "table1:1"), "A film ends in"),
        (("there.gif",), "cannot be written: it is a folder"),
    ],
)
def test_what_cannot_be_filmed_is_refused_in_a_sentence(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    given: tuple[str, ...],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.gif").mkdir()
    assert main(("--controller", "manual", *given)) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert re.match(f"oilcrane film: .*{message}", line)
    assert [path.name for path in tmp_path.iterdir()] == ["there.gif"]


def test_a_film_appears_whole_or_not_at_all(tmp_path: Path) -> None:
    def breaking() -> Iterator[NDArray[np.uint8]]:
        yield np.zeros((32, 32, 3), dtype=np.uint8)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_film(tmp_path / "film.mp4", breaking(), 10.0)
    with pytest.raises(ValueError, match="one or more pictures"):
        write_film(tmp_path / "film.mp4", [], 10.0)
    assert not list(tmp_path.iterdir())
