"""Reproduction: the episodes that put the paper to the test, and what they come to.

Four stages, each a comparison in a results folder of its own:

    defaults       the ten manoeuvres of Table I on the default setup; also without hoisting
    timing         manoeuvre 1, one episode at a time, IPOPT beside the fast solver
    again          Table I under some of the readings that were screened, see `design`
    repeat         random manoeuvres of the paper's family, seed by seed, metrics only
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from baselines.evaluation.comparison import compare
from baselines.evaluation.episode_spec import EpisodeSpec, Setup
from baselines.evaluation.results import EpisodeResult, ResultsFolder
from baselines.mpc.settings import MpcSettings
from baselines.paper.design import Screening
from baselines.paper.evidence import Evidence, Indices, measured_indices, steady_manoeuvre
from baselines.paper.readings import Reading
from baselines.paper.verdicts import Judgement, Pair, Share, claim_shares, judge, paired_comparisons
from crane_env.operators.registry import operator_program
from crane_env.operators.table1 import TABLE_1

PREDICTIVE = ("linear", "adaptive", "nmpc-a", "nmpc-b", "ltv", "tabulated")
"""Controllers that the claims are about."""

CONTROLLERS = ("manual", "linear", "linear-measured", *PREDICTIVE[1:])
"""These, the crane without help, and a fixed length at its best."""

STEADY = ("linear", "adaptive", "nmpc-b")
"""Controllers that also play Table I without hoisting."""

TRACED = ("linear", "adaptive")
"""Controllers whose trajectories are kept in every setup, for their oscillation."""

TIMED = ("linear", "adaptive", "tabulated", "ltv", "nmpc-a", "nmpc-b", "nmpc-b-ipopt")
"""Controllers that are timed."""

SEED = 0
"""Seed of the episodes of Table I, to which it makes no difference."""

Watch = Callable[[EpisodeResult], None]
"""What is told every result as it comes."""


@dataclass(frozen=True)
class Stage:
    """Some of the episodes.

    Attributes:
        name: of the stage and of its folder.
        specs: its episodes, no two alike.
        traced: those of which the trajectories are kept too.
        jobs: number of processes; None for as many as there may be.
    """

    name: str
    specs: tuple[EpisodeSpec, ...]
    traced: tuple[EpisodeSpec, ...] = ()
    jobs: int | None = None


@dataclass(frozen=True, eq=False)
class Reproduction:
    """What the stages came to.

    Attributes:
        default: evidence on the default setup, with act times.
        screening: what was screened; None if nothing.
        again: readings that were played again, with their evidence.
        repeat: evidence of the random manoeuvres; None if there were none.
    """

    default: Evidence
    screening: Screening | None = None
    again: tuple[tuple[Reading, Evidence], ...] = ()
    repeat: Evidence | None = None

    @functools.cached_property
    def judgements(self) -> tuple[Judgement, ...]:
        """Verdict on every claim."""
        return judge(self.default, self.screening, self.again)

    @functools.cached_property
    def pairs(self) -> tuple[Pair, ...]:
        """Controllers compared over the random manoeuvres; none if there were none."""
        return () if self.repeat is None else paired_comparisons(self.repeat)

    @functools.cached_property
    def shares(self) -> tuple[Share, ...]:
        """In how many random manoeuvres claims are met; none if there were none."""
        return () if self.repeat is None else claim_shares(self.repeat)


def defaults_stage() -> Stage:
    """Table I on the default setup, all trajectories kept."""
    setup = Setup()
    traced = table_specs(setup, CONTROLLERS)
    return Stage("defaults", (*traced, *steady_specs(setup)), tuple(traced))


def timing_stage() -> Stage:
    """Manoeuvre 1, an episode at a time."""
    first = operator_program("table1:1")
    specs = (EpisodeSpec(controller=c, operator=first, seed=SEED, setup=Setup()) for c in TIMED)
    return Stage("timing", tuple(specs), jobs=1)


def again_stage(readings: Iterable[Reading]) -> Stage:
    """Table I under other readings."""
    setups = [reading.setup for reading in readings]
    traced = _distinct(spec for setup in setups for spec in table_specs(setup, TRACED))
    specs = _distinct(
        spec for setup in setups for spec in (*table_specs(setup, PREDICTIVE), *steady_specs(setup))
    )
    return Stage("again", specs, traced)


def repeat_stage(count: int) -> Stage:
    """Random manoeuvres with the seeds 0 to `count` - 1; seed by seed, so that pairs end early."""
    program = operator_program("manoeuvre")
    specs = (
        EpisodeSpec(controller=controller, operator=program, seed=seed, setup=Setup())
        for seed in range(count)
        for controller in CONTROLLERS
    )
    return Stage("repeat", tuple(specs))


def play_stage(
    stage: Stage, output: Path, *, jobs: int, command: Sequence[str] = (), watch: Watch
) -> list[EpisodeResult]:
    """Plays the episodes of a stage that its folder does not hold yet; see `compare`.

    Args:
        stage: the stage.
        output: where the stages' folders are.
        jobs: number of processes.
        command: command line, for the manifest.
        watch: is told every result once.

    Raises:
        OSError: the folder cannot be written.
    """
    folder = stage_folder(stage, output)
    jobs = stage.jobs or jobs
    seen: set[str] = set()

    def tell(result: EpisodeResult) -> None:
        if result.spec.key not in seen:
            seen.add(result.spec.key)
            watch(result)

    if stage.traced:
        compare(
            stage.traced, folder, jobs=jobs, keep="trajectories", command=command, on_result=tell
        )
    # What was traced is there now; the folder's table and manifest become those of the stage.
    return compare(stage.specs, folder, jobs=jobs, keep="metrics", command=command, on_result=tell)


def stage_folder(stage: Stage, output: Path) -> ResultsFolder:
    """Where a stage keeps its results."""
    return ResultsFolder(output / stage.name)


def default_evidence(
    played: Sequence[EpisodeResult], folder: ResultsFolder, timed: Indices
) -> Evidence:
    """Evidence of the defaults stage.

    Args:
        played: its results.
        folder: its folder.
        timed: indices of the timing stage.

    Raises:
        ValueError: an episode failed.
    """
    by_key = {result.spec.key: result for result in played}
    return replace(_setup_evidence(Setup(), by_key, folder, CONTROLLERS, CONTROLLERS), timed=timed)


def again_evidence(
    readings: Iterable[Reading], played: Sequence[EpisodeResult], folder: ResultsFolder
) -> tuple[tuple[Reading, Evidence], ...]:
    """Evidence of the stage that plays readings again.

    Args:
        readings: those that were played.
        played: its results.
        folder: its folder.

    Raises:
        ValueError: an episode failed.
    """
    by_key = {result.spec.key: result for result in played}
    return tuple(
        (reading, _setup_evidence(reading.setup, by_key, folder, PREDICTIVE, TRACED))
        for reading in readings
    )


def repeat_evidence(played: Sequence[EpisodeResult], folder: ResultsFolder) -> Evidence:
    """Evidence of the repeat stage.

    Raises:
        ValueError: an episode failed.
    """
    return Evidence(Setup(), measured_indices(played, folder))


def table_specs(setup: Setup, controllers: Iterable[str]) -> list[EpisodeSpec]:
    """Table I, controller by controller."""
    programs = [operator_program(f"table1:{n}") for n in range(1, len(TABLE_1) + 1)]
    return _specs(setup, controllers, programs)


def steady_specs(setup: Setup) -> list[EpisodeSpec]:
    """Table I without hoisting, controller by controller."""
    programs = [steady_manoeuvre(n) for n in range(1, len(TABLE_1) + 1)]
    return _specs(setup, STEADY, programs)


def own_setup(controller: str, setup: Setup) -> Setup:
    """A setup without the choices that make no difference to a controller, or that it refuses.

    Only the linear MPC has a model of fixed length and a choice of its sway state; the others'
    episodes serve for all of these, and are played once.
    """
    if controller == "linear":
        return setup
    common = replace(
        setup.settings, model_cable_length=MpcSettings().model_cable_length, sway_state=None
    )
    return replace(setup, settings=common)


def _specs(
    setup: Setup, controllers: Iterable[str], programs: Sequence[Mapping[str, object]]
) -> list[EpisodeSpec]:
    return [
        EpisodeSpec(
            controller=controller, operator=program, seed=SEED, setup=own_setup(controller, setup)
        )
        for controller in controllers
        for program in programs
    ]


def _distinct(specs: Iterable[EpisodeSpec]) -> tuple[EpisodeSpec, ...]:
    return tuple({spec.key: spec for spec in specs}.values())


def _setup_evidence(
    setup: Setup,
    by_key: Mapping[str, EpisodeResult],
    folder: ResultsFolder,
    controllers: Sequence[str],
    traced: Sequence[str],
) -> Evidence:
    played = [by_key[spec.key] for spec in table_specs(setup, controllers)]
    steady = [by_key[spec.key] for spec in steady_specs(setup)]
    return Evidence(
        setup, measured_indices(played, folder, traced), measured_indices(steady, folder)
    )
