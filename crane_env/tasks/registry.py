"""Registry of tasks: what a name, a mapping or a task stands for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from crane_env.observation import CraneState
from crane_env.parameters import CraneParameters
from crane_env.support.checks import choice, shown
from crane_env.support.fields import with_fields
from crane_env.tasks.drawn import FAMILIES, DrawnTasks
from crane_env.tasks.task import Task

STREAM = 2
"""Beside an episode's number, the seed of its task; 1 is that of its crane."""

TaskSpec = str | Mapping[str, Any] | Task | DrawnTasks | None
"""What `make_task` makes a task of."""

VectorTaskSpec = TaskSpec | Sequence[TaskSpec]
"""One description for all cranes, or a list or tuple with one for each."""


def make_task(spec: TaskSpec) -> Task | DrawnTasks | None:
    """Makes a task, or a family of which one is drawn for each episode.

    Args:
        spec: "position", "over-wall", "bay" or "sequence" (see `crane_env.tasks.drawn`); a mapping
            of such a name and fields of that family; a mapping of the fields of `Task`; a task or a
            family, which is returned as it is; or None: no task.

    Raises:
        ValueError: an unknown name or field, or a value out of range.
    """
    if spec is None or isinstance(spec, (Task, DrawnTasks)):
        return spec
    if isinstance(spec, str):
        return FAMILIES[choice("task", spec, FAMILIES)]()
    if isinstance(spec, Mapping) and "name" in spec:
        fields = dict(spec)
        name = choice("task", fields.pop("name"), FAMILIES)
        return with_fields(
            FAMILIES[name](), fields, must_be="Fields must be a mapping", unknown=f"{name!r} field"
        )
    if isinstance(spec, Mapping):
        for field in spec:
            choice("task field", field, Task.__dataclass_fields__)
        return Task(**{"goals": (), **spec})
    raise ValueError(
        f"A task is a name ({', '.join(FAMILIES)}), a Task, a mapping of its fields, a mapping "
        f"with a name, or None, not {shown(spec)}."
    )


def make_tasks(spec: VectorTaskSpec, count: int) -> list[Task | DrawnTasks | None]:
    """Makes the task, or the family of tasks, of each crane.

    Args:
        spec: as for `make_task`, for all; or a list or tuple with one for each.
        count: number of cranes.

    Raises:
        ValueError: as `make_task`, or a list of another length.
    """
    if not isinstance(spec, (list, tuple)):
        return [make_task(spec)] * count  # type: ignore[arg-type]
    if len(spec) != count:
        raise ValueError(
            f"A list of tasks needs one for each of the {count} environments, not {len(spec)}."
        )
    return [make_task(one) for one in spec]


def check_task(
    given: Task | DrawnTasks | None, parameters: CraneParameters, start: CraneState
) -> None:
    """Makes sure that a crane can do a task, or all of a family.

    Args:
        given: as `make_task` makes it.
        parameters: the crane.
        start: where it begins.

    Raises:
        ValueError: it cannot; the message says why.
    """
    draw_task(given, 0, parameters, start)  # Whether a family fits does not depend on what is drawn


def draw_task(
    given: Task | DrawnTasks | None, episode: int, parameters: CraneParameters, start: CraneState
) -> Task | None:
    """The task itself, or one drawn of a family.

    Args:
        given: as `make_task` makes it.
        episode: the number that seeds the episode's operator too.
        parameters: the crane.
        start: where it begins.

    Raises:
        ValueError: the crane cannot do it from this start; the message says why.
    """
    if isinstance(given, DrawnTasks):
        given = given.draw(np.random.default_rng((episode, STREAM)), parameters, start)
    if given is not None:
        given.check(parameters, start)
    return given
