"""Play: one controller on one crane, or on many side by side, from reset to the end, recorded.

What is recorded is the plant's own account of every control period, taken from underneath whatever
wraps the environment. A wrapper that repeats, delays, rescales or distorts may change the motion,
never the record of it.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from operator import itemgetter
from time import perf_counter
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.wrappers import TimeLimit
from numpy.typing import NDArray

from crane_env.controller import Controller, check_controller, reported_failures
from crane_env.environment.options import seeds_of_each
from crane_env.episode.origin import Origin
from crane_env.episode.trajectory import Collision, Trajectory
from crane_env.observation import Observation
from crane_env.operators.script import ButtonScript
from crane_env.parameters import CraneParameters
from crane_env.support import checks
from crane_env.tasks.task import Task

if TYPE_CHECKING:
    from crane_env.environment.report import StepRecord

STATE = ("payload_position", "payload_velocity", "cable_tension")
"""Entries of `info` that describe the state in which the controller acted."""

EARNED = (
    "acceleration",
    "action_clipped",
    "drive_limited",
    "reward_tracking",
    "reward_sway",
    "reward_acceleration",
    "simulation_failed",
    "task_success",
    "collision_speed",
)
"""Entries of `info` that describe what the action led to."""

BEFORE = ("time", *Observation._fields, *STATE)
"""Columns of a row that are of the record before the action, in the order of a record's values."""

AFTER = ("action", "reward", *EARNED)
"""Columns that are of the record after it."""

FLAGS = frozenset({"action_clipped", "drive_limited"})
"""Columns of booleans."""

state_of, earned_of = itemgetter(*STATE), itemgetter(*EARNED)


def run_episode(
    env: gymnasium.Env[Any, Any],
    controller: Controller,
    *,
    seed: int | None = None,
    options: dict[str, Any] | None = None,
    max_steps: int | None = None,
    controller_name: str | None = None,
) -> Trajectory:
    """Plays one episode; `act` is timed from outside, the same way for every controller.

    The episode ends when the environment says so, or where a wrapper resets the crane.

    Args:
        env: an OILCrane environment, wrapped or not.
        controller: anything with `reset` and `act`.
        seed: seed of the reset, from 0 to before 2^63.
        options: options of the reset.
        max_steps: stop once the crane has moved for this many control periods (a wrapper that
            repeats an action ends its repetition); None: when the environment says so.
        controller_name: what the controller is called in the record; None: its class.

    Raises:
        ValueError: before anything is played, something that is no OILCrane environment or no
            controller, a seed or `max_steps` out of range, or neither `max_steps` nor a `TimeLimit`
            (which `gymnasium.make` adds).

    Warns:
        UserWarning: no press of a script falls into the episode.
    """
    if not isinstance(env, gymnasium.Env) or not hasattr(env.unwrapped, "recorder"):
        raise ValueError(
            "run_episode plays an OILCrane environment, wrapped or not, and run_episodes many of "
            f"them in an OILCraneVectorEnv; this is {checks.shown(env)}."
        )
    _check(controller, _has_time_limit(env), max_steps, [seed])
    (trajectory,) = _play(env, controller, seed, options, max_steps, controller_name)
    inner: Any = env.unwrapped
    _warn_of_silence(inner.operator, float(trajectory.time[-1]))
    return trajectory


def run_episodes(
    env: VectorEnv[Any, Any, Any],
    controller: Controller,
    *,
    seed: int | Sequence[int | None] | None = None,
    options: dict[str, Any] | None = None,
    max_steps: int | None = None,
    controller_name: str | None = None,
) -> list[Trajectory]:
    """Plays one episode of every crane, as `run_episode` plays one of one.

    A crane whose simulation diverges has a shorter trajectory, marked `simulation_failed`; the
    others go on. Memory: about 500 bytes a crane and step, 650 MB for 1000 cranes over 25 s.

    Args:
        env: an `OILCraneVectorEnv`, wrapped or not, in autoreset mode NEXT_STEP.
        controller: anything with `reset` and `act` that drives N cranes at once, observations of
            shape (N, 8), actions (N, 1). `act_time` is its time for all divided by N; what it
            reports as failures belongs to no single crane and is not recorded.
        seed: seed of the reset; crane i gets seed + i or entry i of a list.
        options: options of the reset.
        max_steps: stop after this many control periods; None: when the environment says so.
        controller_name: what the controller is called in the records; None: its class.

    Returns:
        N trajectories.

    Raises:
        ValueError: before anything is played, as `run_episode`, or another autoreset mode.
    """
    if not isinstance(env, VectorEnv) or not hasattr(env.unwrapped, "recorder"):
        raise ValueError(
            "run_episodes plays an OILCraneVectorEnv, as gymnasium.make_vec makes it by default, "
            f"wrapped or not; this is {checks.shown(env)}."
        )
    inner: Any = env.unwrapped
    if inner.autoreset_mode is not AutoresetMode.NEXT_STEP:
        raise ValueError(
            "run_episodes needs autoreset_mode=AutoresetMode.NEXT_STEP, "
            f"not {inner.autoreset_mode}."
        )
    seeds = np.atleast_1d(np.array(seed, dtype=object)).tolist()
    _check(controller, inner.max_episode_steps is not None, max_steps, seeds)
    return _play(env, controller, seed, options, max_steps, controller_name)


def _has_time_limit(env: gymnasium.Env[Any, Any]) -> bool:
    layer = env
    while isinstance(layer, gymnasium.Wrapper):
        if isinstance(layer, TimeLimit):
            return True
        layer = layer.env
    return False


def _check(controller: object, has_limit: bool, max_steps: object, seeds: Sequence[object]) -> None:
    check_controller(controller)
    for seed in seeds:
        if seed is not None:
            checks.seed(seed)
    if max_steps is not None:
        checks.whole("max_steps", max_steps, least=1)
    elif not has_limit:
        raise ValueError(
            "This environment has no time limit: give max_steps, or make it with gymnasium.make."
        )


def _warn_of_silence(operator: object, last_step: float) -> None:
    program = getattr(operator, "program", None)
    if isinstance(program, ButtonScript) and program.presses and program.presses[0] > last_step:
        warnings.warn(
            f"No press of {program.name!r} falls into this episode: the first one is at "
            f"{program.presses[0]:.6g} s, the last control step at {last_step:.6g} s. The times of "
            "a script are in seconds from the episode's start.",
            stacklevel=3,
        )


def _play(
    env: Any,
    controller: Controller,
    seed: Any,
    options: dict[str, Any] | None,
    max_steps: Any,
    controller_name: str | None,
) -> list[Trajectory]:
    many = isinstance(env, VectorEnv)
    over: Callable[[Any], Any] = np.all if many else bool
    inner = env.unwrapped
    listener = inner.recorder
    values: list[tuple[Any, ...]] = []  # of each record, in the order of BEFORE and AFTER
    pressed: list[NDArray[np.bool_]] = []  # buttons of each record
    acts: list[tuple[int, float]] = []  # control period and duration [s]
    ended: Any = False

    def record(one: StepRecord) -> None:
        time, observation, info, action, reward = one
        values.append((time, *observation, *state_of(info), action, reward, *earned_of(info)))
        pressed.append(info["buttons"].copy())
        if listener is not None:
            listener(one)

    inner.recorder = record
    try:
        observation, _ = env.reset(seed=seed, options=options)
        if not values:
            raise ValueError(f"The reset of {checks.shown(env)} does not reach its crane.")
        # A wrapper may have reset more than once, or stepped within its reset.
        before = np.flatnonzero(_all_placed(values))[-1]
        del values[:before], pressed[:before]
        cranes = inner.cranes if many else (inner.parameters,)
        operators = inner.operators if many else (inner.operator,)
        tasks = inner.tasks if many else (inner.task,)
        imperfections = inner.imperfections if many else (inner.imperfections,)
        name, seeds = controller_name or type(controller).__name__, seeds_of_each(seed, len(cranes))
        origins = [
            Origin.now(operator, name, one, inner.cost, parts)
            for operator, one, parts in zip(operators, seeds, imperfections, strict=True)
        ]
        controller.reset()
        while not over(ended):
            start = perf_counter()
            action = controller.act(observation)
            acts.append((len(values) - 1, perf_counter() - start))
            observation, _, terminated, truncated, _ = env.step(action)
            ended = ended | terminated | truncated
            if max_steps is not None and len(values) > max_steps:
                break
    finally:
        inner.recorder = listener
    failures = 0 if many else reported_failures(controller)
    return _trajectories(values, pressed, acts, cranes, tasks, origins, failures)


def _all_placed(values: list[tuple[Any, ...]]) -> NDArray[np.bool_]:
    """Of which records all cranes have just been placed by a reset, shape (number of records,)."""
    times = np.array([one[0] for one in values]).reshape(len(values), -1)
    placed: NDArray[np.bool_] = (times == 0.0).all(axis=1)
    return placed


def _trajectories(
    values: list[tuple[Any, ...]],
    pressed: list[NDArray[np.bool_]],
    acts: list[tuple[int, float]],
    cranes: Sequence[CraneParameters],
    tasks: Sequence[Task | None],
    origins: Sequence[Origin],
    solver_failures: int,
) -> list[Trajectory]:
    """The trajectory of each crane; one row a control period, from one record to the next."""
    begun_anew = np.flatnonzero(_all_placed(values))[1:2]
    table = np.array(values[: begun_anew[0]] if begun_anew.size else values, dtype=np.float64)
    table = table.reshape(len(table), len(BEFORE) + len(AFTER), len(cranes)).transpose(1, 2, 0)
    buttons = np.array(pressed).reshape(len(pressed), len(cranes), -1)
    columns = dict(zip(BEFORE, table[:, :, :-1], strict=False))
    columns |= dict(zip(AFTER, table[len(BEFORE) :, :, 1:], strict=True))
    failed, done, speed = map(columns.pop, EARNED[-3:])
    act_time = np.full(failed.shape[1], np.nan)
    for period, duration in acts:
        if period < len(act_time):
            act_time[period] = duration / len(cranes)
    # A crane that is back at time 0 has begun its next episode: its own ended the step before.
    anew = table[0, :, 1:] == 0.0
    lengths = np.where(anew.any(axis=1), anew.argmax(axis=1), len(act_time)).tolist()
    return [
        Trajectory(
            **{
                name: column[index, :length].astype(np.bool_ if name in FLAGS else np.float64)
                for name, column in columns.items()
            },
            act_time=act_time[:length],
            buttons=buttons[:length, index].copy(),
            parameters=crane,
            task=task,
            origin=origin,
            solver_failures=solver_failures,
            simulation_failed=bool(failed[index, length - 1]),
            task_success=bool(done[index, length - 1]),
            collisions=tuple(
                Collision(float(columns["time"][index, k]), float(speed[index, k]))
                for k in np.flatnonzero(speed[index, :length])
            ),
        )
        for index, (crane, task, origin, length) in enumerate(
            zip(cranes, tasks, origins, lengths, strict=True)
        )
    ]
