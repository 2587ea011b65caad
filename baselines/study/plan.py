"""Plan of the operator study: persons who bring payloads to places, with every controller.

Every controller meets the same persons, tasks and starts: episode k has seed k, by which task,
start and person are drawn, so that cells are compared pair by pair. A person practises with the
controller first and then does a few tasks, each beginning with what the practice taught; so the
persons, not the tasks, are the independent sample.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from baselines.evaluation.episode_spec import EpisodeSpec, Setup
from crane_env import CraneParameters

TIME_LIMIT = 120.0
"""A task that takes longer is given up [s]."""

CABLE_LENGTHS = (4.0, 11.0)
"""Range from which the cable length at the start is drawn, as far as the crane has it [m]."""

STREAM = 71
"""Tells the study's generators from the environment's, which begin with the same seeds."""


class Cell(NamedTuple):
    """Persons of one kind who do tasks of one family with one controller.

    Attributes:
        controller: its name.
        operator: mapping of the person, as `make_operator` takes it.
        family: name of the tasks.
    """

    controller: str
    operator: Mapping[str, Any]
    family: str

    @property
    def skill(self) -> str:
        """The person's skill."""
        return str(self.operator["name"]).partition(":")[2]


def cell_specs(
    cell: Cell, seeds: Sequence[int], setup: Setup, tasks_per_person: int
) -> list[EpisodeSpec]:
    """The episodes of a cell, one a seed.

    Args:
        cell: which.
        seeds: of the episodes.
        setup: crane and settings; its length is that of the longest task.
        tasks_per_person: tasks that a person does after one practice session.
    """
    return [
        EpisodeSpec(
            controller=cell.controller,
            operator=cell.operator,
            seed=seed,
            setup=setup,
            start={"cable_length": cable_length(seed // tasks_per_person, setup.crane)},
            task=cell.family,
            practice=seed // tasks_per_person,
        )
        for seed in seeds
    ]


def cable_length(person: int, crane: CraneParameters) -> float:
    """Cable length at which a person practises and begins each task [m]."""
    low, high = CABLE_LENGTHS
    low = max(low, crane.cable_length_min)
    high = max(min(high, crane.cable_length_max), low)
    return float(np.random.default_rng([STREAM, person]).uniform(low, high))


def all_cells(
    controllers: Iterable[str], operators: Sequence[Mapping[str, Any]], families: Sequence[str]
) -> list[Cell]:
    """All combinations, controller by controller."""
    return [Cell(*one) for one in itertools.product(controllers, operators, families)]
