"""Episode specification: all that determines one episode, as plain data.

An episode is a pure function of its specification and the code, up to the time that `act` takes.
So a specification has a key, a digest of both, under which the episode can be stored, found again,
and played by another process or machine.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import itertools
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import gymnasium

from baselines.evaluation import foreign_code
from baselines.evaluation.provenance import code_identity
from baselines.mpc.settings import MpcSettings
from baselines.registry import make_controller, settings_type
from baselines.wrappers import innermost
from crane_env import EPISODE_STEPS, CraneParameters, Person, Trajectory, practise, run_episode
from crane_env.controller import Controller
from crane_env.environment.options import start_of
from crane_env.imperfections.base import Imperfection
from crane_env.imperfections.registry import make_imperfections
from crane_env.operators.person.operator import PersonOperator
from crane_env.operators.registry import make_operator, operator_program
from crane_env.stage_cost import StageCost
from crane_env.support import checks

MOST_EPISODES = 1_000_000
"""More take longer than anybody waits."""


@dataclass(frozen=True, kw_only=True)
class Setup:
    """What all episodes of a comparison have in common.

    Attributes:
        crane: the crane that is driven.
        nominal: the crane that the controllers believe in; None: the one that is driven.
        settings: the controllers' optimal control problem; its cost is also the reward's.
        max_steps: length of the episode [control periods]; None: the environment's own.
        imperfections: of the crane; given as for `make_imperfections`.

    Raises:
        ValueError: `max_steps` is no whole number of at least 1, or something is no imperfection.
    """

    crane: CraneParameters = field(default_factory=CraneParameters)
    nominal: CraneParameters | None = None
    settings: MpcSettings = field(default_factory=MpcSettings)
    max_steps: int | None = None
    imperfections: tuple[Imperfection, ...] = ()

    def __post_init__(self) -> None:
        """Refuses an episode without steps; a belief that is right is no belief of its own."""
        object.__setattr__(self, "imperfections", make_imperfections(self.imperfections))
        if self.nominal == self.crane:
            object.__setattr__(self, "nominal", None)
        if self.max_steps is not None:
            object.__setattr__(
                self, "max_steps", checks.whole("max_steps", self.max_steps, least=1)
            )

    @property
    def believed(self) -> CraneParameters:
        """The crane that the controllers are built for."""
        return self.crane if self.nominal is None else self.nominal

    @functools.cached_property
    def key(self) -> str:
        """Digest of the setup and the code, 12 hexadecimal digits."""
        return digest([self.data, code_identity()])[:12]

    @functools.cached_property
    def data(self) -> dict[str, Any]:
        """The setup as plain data, made once: not to be changed."""
        return dataclasses.asdict(self)

    @classmethod
    def of(cls, mapping: Mapping[str, Any]) -> Setup:
        """Reads what `dataclasses.asdict` and JSON made of a setup."""
        return cls(
            crane=CraneParameters.of(mapping["crane"]),
            nominal=mapping["nominal"] and CraneParameters.of(mapping["nominal"]),
            settings=MpcSettings.of(mapping["settings"]),
            max_steps=mapping["max_steps"],
            imperfections=make_imperfections(mapping.get("imperfections")),
        )


@dataclass(frozen=True, kw_only=True)
class EpisodeSpec:
    """One episode.

    Attributes:
        controller: its name, as `make_controller` takes it; with a preset, such as "l1@sway",
            the setup's settings are not for it.
        operator: its program with all fields, as `make_operator` takes it: a script's file need not
            be there any more.
        seed: of the environment's reset.
        setup: crane, settings and length.
        start: where the crane begins, as the options of the environment's reset.
        task: that the operator pursues, as the environment takes it; None: none.
        practice: seed of the session in which the operator, a person, tries crane and controller
            beforehand; None: there was none.

    Raises:
        ValueError: a seed that is none.
    """

    controller: str
    operator: Mapping[str, Any]
    seed: int
    setup: Setup
    start: Mapping[str, float] = field(default_factory=dict)
    task: Mapping[str, Any] | str | None = None
    practice: int | None = None

    def __post_init__(self) -> None:
        """Refuses what is no seed."""
        object.__setattr__(self, "seed", checks.seed(self.seed))
        if self.practice is not None:
            object.__setattr__(self, "practice", checks.seed(self.practice))

    @property
    def foreign(self) -> tuple[str, ...]:
        """Controller and operator, as far as they are the user's own."""
        return foreign_code.foreign((self.controller, self.operator_name))

    @property
    def operator_name(self) -> str:
        """The operator's name: "table1:3", "random", ..."""
        return str(self.operator["name"])

    @functools.cached_property
    def key(self) -> str:
        """Digest of the specification and the code, 12 hexadecimal digits."""
        sources = [foreign_code.sources(name) for name in self.foreign]
        begun = [dict(self.start), self.task, self.practice]
        given = [self.controller, self.operator, self.seed, self.setup.key, begun]
        return digest([sources, given])[:12]

    def read(self) -> str | None:
        """Digest of all that the user's own code may read; None if that is not known.

        Empty for the registries' controllers and operators.
        """
        read = [foreign_code.readable(name) for name in self.foreign]
        if None in read:
            return None
        return digest(read) if read else ""

    @property
    def data(self) -> dict[str, Any]:
        """The specification as plain data: not to be changed."""
        own = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        return {**own, "setup": self.setup.data}

    @classmethod
    def of(cls, mapping: Mapping[str, Any]) -> EpisodeSpec:
        """Reads what `dataclasses.asdict` and JSON made of a specification."""
        return cls(**{**mapping, "setup": Setup.of(mapping["setup"])})


def episode_specs(
    controllers: Iterable[str], operators: Iterable[str], seeds: Iterable[int], setup: Setup
) -> list[EpisodeSpec]:
    """All combinations, controller by controller, then operator by operator.

    Args:
        controllers: names that `make_controller` knows.
        operators: names that `make_operator` knows.
        seeds: seeds of the environment, at least 0.
        setup: what all episodes have in common.

    Raises:
        ValueError: an unknown operator, a malformed script, a recording of another crane, something
            that is no seed, nothing to play, or more than `MOST_EPISODES` episodes.
        FileNotFoundError: a script that is not there.
    """
    names = list(dict.fromkeys(controllers))
    programs = [operator_program(name) for name in dict.fromkeys(operators)]
    for program in programs:
        start_of({}, make_operator(program), setup.crane)  # a recording is of one crane
    # A range of seeds may be longer than there is memory.
    some = list(itertools.islice(seeds, MOST_EPISODES + 1))
    if len(names) * len(programs) * len(some) > MOST_EPISODES:
        raise ValueError(
            f"There may be at most {MOST_EPISODES} episodes: ask for fewer seeds, operators or "
            "controllers."
        )
    specs = [
        EpisodeSpec(controller=name, operator=program, seed=seed, setup=setup)
        for name in names
        for program in programs
        for seed in dict.fromkeys(map(checks.seed, some))
    ]
    if not specs:
        raise ValueError("There is nothing to play: name a controller, an operator and a seed.")
    return specs


def play(spec: EpisodeSpec) -> Trajectory:
    """Plays an episode.

    The controller answers once before it is reset and timed, so that act times contain no
    compilation and no first touch of memory. Environments, and controllers of the registry, are
    used again for the next episode: their reset forgets all, which foreign ones' may not.

    Raises:
        ValueError: the specification asks for something that there is not.
        ImportError: a package is missing; the message names the extra that brings it.
    """
    setup = spec.setup
    options: dict[str, Any] = {**spec.start, "operator": spec.operator}
    if spec.task is not None:
        options["task"] = spec.task
    try:
        controller = (
            build_controller(spec)
            if spec.foreign
            else _controller(spec.controller, setup.believed, setup.settings)
        )
        if spec.practice is not None:
            person = json.dumps(spec.operator, sort_keys=True)
            options["operator"] = _practised(
                person, spec.controller, setup, spec.practice, tuple(spec.start.items())
            )
        env = _environment(setup.crane, setup.settings.cost, setup.imperfections)
        observation, _ = env.reset(seed=spec.seed)  # whoever the operator is, it starts alike
        controller.act(observation)
        return run_episode(
            env,
            controller,
            seed=spec.seed,
            options=options,
            max_steps=EPISODE_STEPS if setup.max_steps is None else setup.max_steps,
            controller_name=spec.controller,
        )
    except BaseException:  # whatever it left them in, nothing is used again
        _environment.cache_clear()
        _controller.cache_clear()
        _practised.cache_clear()
        raise


def build_controller(spec: EpisodeSpec) -> Controller:
    """A new controller of an episode; the setup's settings are for those that take `MpcSettings`.

    Of others that minimise a `StageCost`, the setup's is the `cost` among their settings.

    Raises:
        ValueError, ImportError: as `make_controller`.
    """
    return _controller.__wrapped__(spec.controller, spec.setup.believed, spec.setup.settings)


def check_settings(specs: Iterable[EpisodeSpec]) -> None:
    """Makes sure that no setup has settings which nothing in its episodes reads.

    Raises:
        ValueError: settings for controllers that take none, unknown controllers.
        ImportError: a package is missing.
    """
    takers: dict[Setup, set[str]] = {}
    for spec in specs:
        takers.setdefault(spec.setup, set()).add(spec.controller)
    for setup, names in takers.items():
        # The cost is the reward's too.
        read = dataclasses.replace(setup.settings, cost=StageCost()) == MpcSettings()
        if not read and not any(
            settings_type(name) is MpcSettings for name in names if "@" not in innermost(name)
        ):
            raise ValueError(
                f"None of the controllers {', '.join(sorted(names))} takes settings of the optimal "
                "control problem, but some were given."
            )


@functools.lru_cache(maxsize=8)
def _controller(name: str, believed: CraneParameters, settings: MpcSettings) -> Controller:
    takes: Any = settings_type(name)
    given: object = None
    if "@" in innermost(name):  # a preset's settings are its own
        pass
    elif takes is MpcSettings:
        given = settings
    elif takes is not None and isinstance(getattr(takes.of(None), "cost", None), StageCost):
        given = {"cost": settings.cost}
    return make_controller(name, parameters=believed, settings=given)


@functools.lru_cache(maxsize=4)
def _environment(
    crane: CraneParameters, cost: StageCost, imperfections: tuple[Imperfection, ...]
) -> gymnasium.Env[Any, Any]:
    return gymnasium.make(
        "OILCrane-v0",
        parameters=crane,
        cost=cost,
        imperfections=imperfections,
        max_episode_steps=-1,
    )


@functools.lru_cache(maxsize=16)
def _practised(
    person: str, controller: str, setup: Setup, seed: int, start: tuple[tuple[str, float], ...]
) -> Person:
    """The person of an operator's mapping in JSON, after the practice session.

    Raises:
        ValueError: the operator is no person.
    """
    operator = make_operator(json.loads(person))
    if not isinstance(operator, PersonOperator):
        raise ValueError(f"Only persons can practise, not the operator {person}.")
    trying = _controller(controller, setup.believed, setup.settings)
    return practise(
        operator.program,
        trying,
        seed=seed,
        parameters=setup.crane,
        start=dict(start),
        imperfections=setup.imperfections,
    )


def digest(data: Any) -> str:
    """SHA-256 of plain data, in hexadecimal digits; equal data has equal digests."""
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()
