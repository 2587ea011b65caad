"""Forecast of a campaign: what would be played, how much of it is there, and how long it takes."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from time import perf_counter

from baselines.evaluation.dataset import Row
from baselines.evaluation.episode_spec import EpisodeSpec, play
from baselines.evaluation.results import Keep, ResultsFolder
from crane_env import EPISODE_STEPS

TRIED_STEPS = 50
"""So much of an episode is played to learn how long a whole one takes [control periods]."""

Kind = tuple[str, int, bool]
"""Episodes that take about as long: controller, greatest length [control periods], with a task."""


@dataclass(frozen=True)
class Forecast:
    """Episodes of one kind.

    Attributes:
        kind: which.
        episodes: that are asked for.
        there: those of them that need not be played any more.
        duration: of one of them [s].
        recorded: whether the duration is that of episodes in the folder, not of a short trial.
    """

    kind: Kind
    episodes: int
    there: int
    duration: float
    recorded: bool

    @property
    def time_left(self) -> float:
        """Work that is left, on one processor [s]."""
        return (self.episodes - self.there) * self.duration


def forecast(specs: Sequence[EpisodeSpec], folder: ResultsFolder, keep: Keep) -> list[Forecast]:
    """What a campaign would come to; nothing is written.

    Args:
        specs: its episodes.
        folder: where they are to be kept; it need not be there.
        keep: what is to be kept of each.

    Raises:
        ValueError, ImportError: as `play`.
    """
    there = {result.spec.key for result in folder.load(specs, keep)}
    recorded = recorded_durations(folder)
    parts: dict[Kind, list[EpisodeSpec]] = {}
    for spec in specs:
        parts.setdefault(kind_of(spec), []).append(spec)
    return [
        Forecast(
            kind,
            len(own),
            sum(spec.key in there for spec in own),
            recorded[kind] if kind in recorded else tried_duration(own[0]),
            kind in recorded,
        )
        for kind, own in parts.items()
    ]


def kind_of(spec: EpisodeSpec) -> Kind:
    """The kind of an episode."""
    return (spec.controller, spec.setup.max_steps or EPISODE_STEPS, spec.task is not None)


def recorded_durations(folder: ResultsFolder) -> Mapping[Kind, float]:
    """Median duration of the episodes that a folder holds, of any state of the code [s]."""
    found: dict[Kind, list[float]] = {}
    for row in folder.all_rows():
        if row["failure"] is None:
            found.setdefault(kind_of_row(row), []).append(row["wall_time"])
    return {kind: median(durations) for kind, durations in found.items()}


def kind_of_row(row: Row) -> Kind:
    """The kind of an episode that is kept."""
    return (row["controller"], row["max_steps"] or EPISODE_STEPS, row["task"] is not None)


def tried_duration(spec: EpisodeSpec) -> float:
    """Duration of an episode [s], from the beginning of it, played twice: the second time counts.

    A task may be done long before its time is over, so the whole of it is the worst case.
    """
    steps = kind_of(spec)[1]
    short = min(TRIED_STEPS, steps)
    tried = dataclasses.replace(spec, setup=dataclasses.replace(spec.setup, max_steps=short))
    play(tried)
    start = perf_counter()
    play(tried)
    return (perf_counter() - start) * steps / short
