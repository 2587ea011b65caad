"""Films one controller, or two side by side, with the same operator.

oilcrane film --controller ltv --operator table1:1 ltv.mp4
oilcrane film --controller manual --against ltv --operator person:trained --task position both.gif
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import gymnasium
import numpy as np
import tyro
from numpy.typing import NDArray

from baselines.commands.evaluate import crane_parameters
from baselines.commands.terminal import Job, check_writable, progress, run
from baselines.registry import make_controller
from crane_env import (
    EPISODE_STEPS,
    TASK_STEPS,
    CraneParameters,
    Person,
    Trajectory,
    make_operator,
    practise,
)
from crane_env.controller import Controller
from crane_env.episode.recording import arguments_of
from crane_env.rendering.canvas import SMALLEST_PICTURE
from crane_env.rendering.film import check_film, write_film
from crane_env.support import checks
from crane_env.support.extras import require

PROGRAM = "oilcrane film"

RECORDING = "recording:"
"""How the name of an operator begins that brings crane, task and length with it."""

CAPTION_HEIGHT = 32
"""Of the strip above a picture [pixel]."""

LONGEST = 3600.0
"""Nobody watches a longer film [s]."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Films one controller, or two side by side, with the same operator.

    A person decides by what he or she sees: the same person presses differently with another
    controller, and has practised with each. Other operators press the same. A recording brings its
    crane, start, task and length.

    Attributes:
        output: the film, ending in .mp4 or .gif.
        controller: its name; package.module:factory for one of your own.
        against: another one, in the right half of the film.
        operator: who presses the buttons: random, manoeuvre, table1:1, person:trained, script:FILE,
            recording:FILE, ...
        task: position, over-wall, bay or sequence; persons need one.
        seed: of the episode.
        parameters: the crane: a preset (paper or field), or a JSON object, or a file with one, of
            the fields of CraneParameters that differ from the paper's.
        seconds: longest time of the crane; None is 25 s, with a task 120 s.
        rate: pictures a second.
        width: of the film [pixel]; None is as drawn, 640 a controller.
    """

    output: Annotated[Path, tyro.conf.Positional]
    controller: str = "adaptive"
    against: str | None = None
    operator: str = "table1:1"
    task: str | None = None
    seed: int = 0
    parameters: str | None = None
    seconds: float | None = None
    rate: float = 25.0
    width: int | None = None


class View(NamedTuple):
    """What is seen of one controller at a time.

    Attributes:
        picture: uint8, shape (height, width, 3).
        time: since the start [s].
        done: the task is.
    """

    picture: NDArray[np.uint8]
    time: float
    done: bool


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns the exit code."""
    return run(PROGRAM, Options, prepare, arguments)


def prepare(options: Options, command: Sequence[str]) -> Job:
    """Tries everything that can be wrong; returns the filming.

    Raises:
        ValueError: an option that means nothing, or a value out of range.
        ImportError: a package is missing; the message names the extra that brings it.
        OSError: a file that cannot be read or written, or no OpenGL.
    """
    check_film(options.output)
    require("PIL.ImageDraw", extra="film")
    checks.seed(options.seed)
    if options.width is not None:
        checks.whole("width", options.width, 16, 8192)
    arguments = episode_arguments(options)
    crane = CraneParameters.of(arguments["parameters"])
    every = max(1, round(1.0 / (checks.positive("rate", options.rate) * crane.control_period)))
    steps = arguments["max_episode_steps"]
    names = [name for name in (options.controller, options.against) if name is not None]
    reels = []
    for name in names:
        controller = make_controller(name, parameters=crane)
        operator = practised(options, controller, crane)
        env = gymnasium.make("OILCrane-v0", **{**arguments, "operator": operator})
        reel = drive(env, controller, options.seed, every)
        try:
            reels.append(itertools.chain([next(reel)], reel))
        except RuntimeError as error:  # no OpenGL
            raise OSError(str(error)) from error
    options.output.parent.mkdir(parents=True, exist_ok=True)
    check_writable("film", options.output)
    rate = 1.0 / (every * crane.control_period)
    return functools.partial(film, options, names, reels, rate, steps // every)


def episode_arguments(options: Options) -> dict[str, Any]:
    """What `gymnasium.make` makes the environment with: of a recording, as it was, unless said.

    Raises:
        ValueError, FileNotFoundError, ImportError: as `prepare`.
    """
    arguments: dict[str, Any] = {"operator": options.operator, "parameters": None}
    if options.operator.startswith(RECORDING):
        file = options.operator.removeprefix(RECORDING)
        arguments = arguments_of(file, Trajectory.from_parquet(file))
    if options.parameters is not None:
        arguments["parameters"] = crane_parameters(options.parameters, "parameters")
    if options.task is not None:
        arguments["task"] = options.task
    usual = EPISODE_STEPS if arguments.get("task") is None else TASK_STEPS
    steps = arguments.get("max_episode_steps", usual)
    if options.seconds is not None:
        seconds = checks.within("seconds", options.seconds, 0.1, LONGEST, "s")
        steps = round(seconds / CraneParameters.of(arguments["parameters"]).control_period)
    width, height = SMALLEST_PICTURE
    view = {"render_mode": "rgb_array", "render_width": width, "render_height": height}
    return {**arguments, **view, "max_episode_steps": steps}


def practised(options: Options, controller: Controller, crane: CraneParameters) -> Any:
    """The operator; a person has tried the crane with this controller before.

    Raises:
        ValueError, FileNotFoundError, ImportError: as `make_operator`.
    """
    operator = make_operator(options.operator)
    program = getattr(operator, "program", None)
    if not isinstance(program, Person):
        return operator
    return practise(program, controller, seed=options.seed, parameters=crane)


def drive(
    env: gymnasium.Env[Any, Any], controller: Controller, seed: int, every: int
) -> Iterator[View]:
    """Plays an episode and shows each `every`th control period of it, the first and the last."""
    observation, _ = env.reset(seed=seed)
    controller.reset()
    done = ended = False
    inner: Any = env.unwrapped
    for step in itertools.count():
        if step % every == 0 or ended:
            picture: Any = env.render()
            yield View(picture, inner.time, done)
        if ended:
            env.close()
            return
        observation, _, done, truncated, _ = env.step(controller.act(observation))
        ended = done or truncated


def film(
    options: Options,
    names: Sequence[str],
    reels: Sequence[Iterator[View]],
    rate: float,
    count: int,
) -> None:
    """Films until the last controller has ended; who ended before stands still."""

    def pictures() -> Iterator[NDArray[np.uint8]]:
        last: list[View] = []
        for views in itertools.zip_longest(*reels):
            last = [view or before for view, before in itertools.zip_longest(views, last)]
            yield np.hstack([captioned(*pair) for pair in zip(names, last, strict=True)])
            advance(None)

    with progress("pictures", count) as advance:
        write_film(options.output, pictures(), rate, options.width)
    print(f"Film: {options.output}.")


def captioned(name: str, view: View) -> NDArray[np.uint8]:
    """A picture under a strip with the controller's name and the time."""
    from PIL import Image, ImageDraw, ImageFont

    strip = Image.new("RGB", (view.picture.shape[1], CAPTION_HEIGHT), "white")
    text = f"{name}    {view.time:.1f} s{'    done' if view.done else ''}"
    font = ImageFont.load_default(0.7 * CAPTION_HEIGHT)
    ImageDraw.Draw(strip).text((10, 2), text, fill="black", font=font)
    return np.vstack((np.asarray(strip), view.picture))
