"""Options: what the arguments of `reset` and `step` say for one crane or for each of many."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from crane_env.environment.randomisation import Randomisation
from crane_env.observation import CraneState
from crane_env.operators.base import Operator
from crane_env.operators.recording import RecordedButtons
from crane_env.parameters import CraneParameters
from crane_env.plant.start import Start
from crane_env.support import checks
from crane_env.support.checks import choice, real, shown
from crane_env.tasks.drawn import DrawnTasks
from crane_env.tasks.registry import check_task
from crane_env.tasks.task import Task


def start_of(options: Mapping[str, Any], operator: Operator, parameters: CraneParameters) -> Start:
    """Where options of numbers let a crane begin; else where its operator's recording did.

    Raises:
        ValueError: a value that is no number or out of range, or another crane or start than the
            recording's.
    """
    numbers = {name: real(name, value) for name, value in options.items()}
    recording = getattr(operator, "program", None)
    if not isinstance(recording, RecordedButtons):
        start = Start(**numbers)
    else:
        recorded = {name: getattr(recording.start, name) for name in Start._fields}
        start = Start(**{**recorded, **numbers})
        recording.check(parameters, CraneState(**start._asdict(), cable_rate=0.0))
    start.coordinates(parameters)
    return start


def read_options(options: object, *others: str) -> dict[str, Any]:
    """Options of `reset`, of which each is a field of `Start` or one of some others.

    Raises:
        ValueError: something else, or an unknown name.
    """
    if options is None:
        return {}
    if not isinstance(options, Mapping):
        raise ValueError(f"Reset options must be a mapping, not {shown(options)}.")
    for name in options:
        choice("reset option", name, (*Start._fields, *others))
    return dict(options)


def starts_of_each(
    options: Mapping[str, Any],
    chosen: NDArray[np.bool_],
    operators: Sequence[Operator],
    cranes: Sequence[CraneParameters],
) -> list[Start]:
    """Where each of the chosen cranes begins.

    Args:
        options: a number, or a sequence or array with one for each crane, for fields of `Start`.
        chosen: the cranes that are reset, shape (N,).
        operators: of all cranes.
        cranes: all of them.

    Raises:
        ValueError: a sequence of another length, or as `start_of`.
    """
    columns: dict[str, list[Any]] = {}
    for name, value in options.items():
        listed = value.tolist() if isinstance(value, np.ndarray) else value
        if not isinstance(listed, (list, tuple)):
            listed = [listed] * len(chosen)
        if len(listed) != len(chosen):
            raise ValueError(
                f"{name} must be a number or one for each of the {len(chosen)} environments, "
                f"not {len(listed)}."
            )
        columns[name] = list(listed)
    starts = []
    for index in np.flatnonzero(chosen).tolist():
        try:
            given = {name: column[index] for name, column in columns.items()}
            starts.append(start_of(given, operators[index], cranes[index]))
        except ValueError as error:
            raise ValueError(f"Environment {index}: {error}") from error
    return starts


def check_tasks(
    given: Sequence[Task | DrawnTasks | None],
    cranes: Sequence[CraneParameters],
    randomisation: Randomisation,
    starts: Mapping[int, Start],
) -> None:
    """Makes sure that some cranes, whichever are drawn, can do their tasks from their starts.

    Args:
        given: as `make_tasks` makes them, for all cranes.
        cranes: all of them, before anything is drawn.
        randomisation: from which their parameters are drawn.
        starts: of the cranes in question, by number.

    Raises:
        ValueError: one cannot; the message says why.
    """
    checked = set()
    for index, start in starts.items():
        case = given[index], cranes[index], start
        if given[index] is None or case in checked:
            continue
        checked.add(case)
        # Of what is drawn, tasks depend on the initial length alone.
        lengths = {one.cable_length_initial: one for one in randomisation.check(cranes[index])}
        for crane in lengths.values():
            try:
                check_task(given[index], crane, start.coordinates(crane).state)
            except ValueError as error:
                raise ValueError(f"Environment {index}: {error}") from error


def chosen_by(mask: object, count: int) -> NDArray[np.bool_]:
    """The cranes that a `reset_mask` chooses, shape (count,).

    Raises:
        TypeError: the mask is no boolean array.
        ValueError: it has another shape or chooses none.
    """
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
        kind = mask.dtype if isinstance(mask, np.ndarray) else type(mask).__name__
        raise TypeError(f"reset_mask must be a numpy array of bool, not {kind}.")
    if mask.shape != (count,):
        raise ValueError(f"reset_mask must have shape ({count},), not {mask.shape}.")
    if not mask.any():
        raise ValueError("reset_mask must choose at least one environment.")
    return mask.copy()


def seeds_of_each(seed: object, count: int) -> list[int | None]:
    """The seed of each crane: seed + i, entry i of a sequence, or None.

    Raises:
        ValueError: a sequence of another length, or a seed that is none.
    """
    if isinstance(seed, np.ndarray):
        seed = seed.tolist()
    if not isinstance(seed, (list, tuple)):
        return [None if seed is None else checks.seed(seed) + index for index in range(count)]
    if len(seed) != count:
        raise ValueError(
            f"A list of seeds needs one for each of the {count} environments, not {len(seed)}."
        )
    return [None if one is None else checks.seed(one) for one in seed]


def accelerations(actions: object, shape: tuple[int, ...]) -> NDArray[Any]:
    """Actions as an array of this shape, of numbers that may yet be infinite.

    Raises:
        ValueError: another shape, or entries that are no real numbers.
    """
    array = np.asarray(actions)
    if array.shape != shape or array.dtype.kind not in "fiu":
        raise ValueError(
            f"An action must be an array of numbers of shape {shape}, "
            f"not of {array.dtype} of shape {array.shape}."
        )
    return array
