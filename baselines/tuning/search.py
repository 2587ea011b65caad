"""Search: the same number of trials for each controller, towards several goals at once.

A trial is one choice of settings, scored on the training manoeuvres. Optuna's multi-objective TPE
(Ozaki et al., J. Artificial Intelligence Research 73, 2022) proposes the trials; the first is the
controller's own defaults. Nothing is weighed against each other during the search. Afterwards a
preset is the best trial of a class:

    "tuned"   no more sway and no more effort than `adaptive` at the paper's weights
    "agile"   no more sway than that, whatever the effort

Best is the least mean of IAE and release drift, each as a share of `adaptive`'s, among the trials
of the class whose inching error is at most its defaults' or 20 %, whichever is larger; so that
nothing is gained by not obeying short presses.
"""

from __future__ import annotations

import dataclasses
import functools
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from baselines.evaluation.episode_spec import digest
from baselines.evaluation.provenance import code_identity
from baselines.registry import make_controller
from baselines.tuning.space import SPACES, Space
from baselines.tuning.yardstick import DivergedError, TuningScore, score
from crane_env import CraneParameters
from crane_env.support.extras import require

REFERENCE = "adaptive"
"""Controller whose sway and effort at the paper's weights bound the classes."""

SAMPLER_SEED = 13

HUNDREDTH = 1.01
"""A class's bounds are met within 1 %, which is less than what manoeuvres scatter by."""

STARTUP_SHARE = 4
"""One trial of so many is drawn at random before the search learns from them."""

DIVERGED = "diverged"
"""Mark of a trial without a score."""

OBEDIENT = 0.2
"""An inching error that is no reason to leave a trial out [1]."""


@dataclass(frozen=True)
class Trial:
    """Settings that were tried.

    Attributes:
        settings: mapping of them, as `make_controller` takes it; empty: the defaults.
        score: what they came to; None: the simulation diverged.
    """

    settings: Mapping[str, Any]
    score: TuningScore | None

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> Trial:
        """Reads what `search` gave."""
        found = data["score"]
        return cls(data["settings"], None if found is None else TuningScore(**found))


@dataclass(frozen=True)
class Class:
    """What a preset may cost.

    Attributes:
        name: of the preset.
        words: of its provenance.
        effort: whether the effort is bounded too.
    """

    name: str
    words: str
    effort: bool


CLASSES = (
    Class("tuned", f"sway and effort of {REFERENCE} at the paper's weights", effort=True),
    Class("agile", f"sway of {REFERENCE} at the paper's weights, effort free", effort=False),
)


@dataclass(frozen=True)
class SearchTask:
    """The search of one controller.

    Attributes:
        name: of a controller in `SPACES`.
        trials: number of them.
        seeds: of the training manoeuvres.
        crane: that is driven and believed in.
        folder: in which each trial is kept when it ends, in the controller's journal.
    """

    name: str
    trials: int
    seeds: tuple[int, ...]
    crane: CraneParameters
    folder: Path

    @functools.cached_property
    def key(self) -> str:
        """Digest of what its trials depend on, and of the code."""
        given = [self.name, self.trials, self.seeds, dataclasses.asdict(self.crane)]
        return digest([given, code_identity()])[:12]


def search(task: SearchTask) -> list[dict[str, Any]]:
    """Tries settings of a controller, as far as its journal does not have them already.

    Returns:
        The trials in their order as plain data, the first with the defaults; see `Trial.of`.
    """
    optuna = require("optuna", extra="tune")
    storages = require("optuna.storages", extra="tune")
    files = require("optuna.storages.journal", extra="tune")
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    space = SPACES[task.name]

    def tried(trial: Any) -> TuningScore:
        # The first has no numbers of its own: the defaults need not lie in the space.
        settings = space.settings(proposed(trial, space)) if len(finished(study)) else None
        controller = make_controller(task.name, parameters=task.crane, settings=settings)
        try:
            return score(controller, task.seeds, task.crane)
        except DivergedError as diverged:
            trial.set_user_attr(DIVERGED, str(diverged))
            raise

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # parts of Optuna call themselves experimental
        study = optuna.create_study(
            study_name=task.key,
            storage=storages.JournalStorage(
                files.JournalFileBackend(str(task.folder / f"{task.name}.journal"))
            ),
            directions=["minimize"] * len(TuningScore._fields),
            load_if_exists=True,
        )
        while (number := len(finished(study))) < task.trials:
            # Seeded by the number, so that a resumed search goes the way of an undisturbed one.
            study.sampler = optuna.samplers.TPESampler(
                seed=SAMPLER_SEED + number,
                multivariate=True,
                n_startup_trials=task.trials // STARTUP_SHARE,
            )
            study.optimize(tried, n_trials=1, catch=(DivergedError,))
    return [
        {
            "settings": space.settings(one.params) if one.params else {},
            "score": TuningScore(*one.values)._asdict() if one.values else None,
        }
        for one in finished(study)
    ]


def proposed(trial: Any, space: Space) -> dict[str, float]:
    """Numbers that Optuna proposes."""
    return {
        name: trial.suggest_float(name, one.low, one.high, log=one.logarithmic)
        for name, one in space.ranges.items()
    }


def finished(study: Any) -> list[Any]:
    """Trials that came to a score or diverged; one that was interrupted is begun anew."""
    return [
        one
        for one in study.get_trials(deepcopy=False)
        if one.values is not None or DIVERGED in one.user_attrs
    ]


def best(trials: Sequence[Trial], bounds: TuningScore, wanted: Class) -> Trial | None:
    """The best trial of a class; None if none is in it.

    Args:
        trials: of a controller, the first with its defaults.
        bounds: score of `REFERENCE` at the paper's weights.
        wanted: the class.
    """
    default = trials[0].score
    deaf = max(OBEDIENT, default.inching_error if default else 0.0)

    def allowed(one: TuningScore) -> bool:
        return (
            one.sway <= HUNDREDTH * bounds.sway
            and (not wanted.effort or one.effort <= HUNDREDTH * bounds.effort)
            and one.inching_error <= HUNDREDTH * deaf
        )

    scored = [(one.score, one) for one in trials if one.score is not None and allowed(one.score)]
    if not scored:
        return None
    return min(scored, key=lambda pair: merit(pair[0], bounds))[1]


def merit(found: TuningScore, bounds: TuningScore) -> float:
    """Mean of IAE and release drift, each as a share of `REFERENCE`'s."""
    return 0.5 * (found.IAE / bounds.IAE + found.release_drift / bounds.release_drift)
