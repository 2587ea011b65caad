"""Episode specification: all that determines one episode, as plain data.

An episode is a pure function of its specification and the code, up to the time that `act` takes.
So a specification has a key, a digest of both, under which the episode can be stored, found again,
and played by another process or machine.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import importlib.util
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gymnasium

from baselines.evaluation.provenance import code_identity
from baselines.mpc.settings import MpcSettings
from baselines.registry import CONTROLLERS, make_controller, settings_type
from crane_env import CraneParameters, Trajectory, run_episode
from crane_env.controller import Controller
from crane_env.operators.registry import FAMILIES, operator_program
from crane_env.support.checks import seed as checked_seed
from crane_env.support.checks import whole
from crane_env.support.factory import is_place


@dataclass(frozen=True, kw_only=True)
class Setup:
    """What all episodes of a comparison have in common.

    Attributes:
        crane: the crane that is driven.
        nominal: the crane that the controllers believe in; None: the one that is driven.
        settings: the controllers' optimal control problem; its cost is also the reward's.
        max_steps: end of the episode [control periods], if before the environment's own.

    Raises:
        ValueError: `max_steps` is no whole number of at least 1.
    """

    crane: CraneParameters = field(default_factory=CraneParameters)
    nominal: CraneParameters | None = None
    settings: MpcSettings = field(default_factory=MpcSettings)
    max_steps: int | None = None

    def __post_init__(self) -> None:
        """Refuses an episode without steps; a belief that is right is no belief of its own."""
        if self.nominal == self.crane:
            object.__setattr__(self, "nominal", None)
        if self.max_steps is not None:
            object.__setattr__(self, "max_steps", whole("max_steps", self.max_steps, least=1))

    @property
    def believed(self) -> CraneParameters:
        """The crane that the controllers are built for."""
        return self.crane if self.nominal is None else self.nominal

    @functools.cached_property
    def key(self) -> str:
        """Digest of the setup and the code, 12 hexadecimal digits."""
        return digest([dataclasses.asdict(self), code_identity()])[:12]

    @classmethod
    def of(cls, mapping: Mapping[str, Any]) -> Setup:
        """Reads what `dataclasses.asdict` and JSON made of a setup."""
        return cls(
            crane=CraneParameters.of(mapping["crane"]),
            nominal=mapping["nominal"] and CraneParameters.of(mapping["nominal"]),
            settings=MpcSettings.of(mapping["settings"]),
            max_steps=mapping["max_steps"],
        )


@dataclass(frozen=True, kw_only=True)
class EpisodeSpec:
    """One episode.

    Attributes:
        controller: its name, as `make_controller` takes it.
        operator: its program with all fields, as `make_operator` takes it: a script's file need not
            be there any more.
        seed: of the environment's reset.
        setup: crane, settings and length.
    """

    controller: str
    operator: Mapping[str, Any]
    seed: int
    setup: Setup

    @property
    def operator_name(self) -> str:
        """The operator's name: "table1:3", "random", ..."""
        return str(self.operator["name"])

    @functools.cached_property
    def key(self) -> str:
        """Digest of the specification and the code, 12 hexadecimal digits."""
        own = [factory_identity(name) for name in (self.controller, self.operator_name)]
        given = [self.controller, self.operator, self.seed, self.setup.key]
        return digest([own, given])[:12]

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
        ValueError: an unknown operator, a malformed script, a seed out of range, nothing to play.
        FileNotFoundError: a script that is not there.
    """
    programs = [operator_program(name) for name in dict.fromkeys(operators)]
    distinct_seeds = list(dict.fromkeys(map(checked_seed, seeds)))
    specs = [
        EpisodeSpec(controller=controller, operator=program, seed=seed, setup=setup)
        for controller in dict.fromkeys(controllers)
        for program in programs
        for seed in distinct_seeds
    ]
    if not specs:
        raise ValueError("There is nothing to play: name a controller, an operator and a seed.")
    return specs


def play(spec: EpisodeSpec) -> Trajectory:
    """Plays an episode.

    The controller answers once before it is reset and timed, so that act times contain no
    compilation and no first touch of memory.

    Raises:
        ValueError: the specification asks for something that there is not.
        ImportError: a package is missing; the message names the extra that brings it.
    """
    setup = spec.setup
    controller = build_controller(spec)
    env = gymnasium.make(
        "OILCrane-v0",
        operator=spec.operator,
        parameters=setup.crane,
        cost=setup.settings.cost,
    )
    try:
        observation, _ = env.reset(seed=spec.seed)
        controller.act(observation)
        return run_episode(env, controller, seed=spec.seed, max_steps=setup.max_steps)
    finally:
        env.close()


def build_controller(spec: EpisodeSpec) -> Controller:
    """The controller of an episode; the setup's settings are for those that take `MpcSettings`.

    Raises:
        ValueError, ImportError: as `make_controller`.
    """
    name, setup = spec.controller, spec.setup
    settings = setup.settings if settings_type(name) is MpcSettings else None
    return make_controller(name, parameters=setup.believed, settings=settings)


@functools.cache
def factory_identity(name: str) -> str:
    """Digest of the file of a factory that is the user's own; empty for the registries' names."""
    if name in CONTROLLERS or not is_place(name) or name.partition(":")[0] in FAMILIES:
        return ""
    found = importlib.util.find_spec(name.partition(":")[0])
    if found is None or found.origin is None:
        return ""
    return hashlib.sha256(Path(found.origin).read_bytes()).hexdigest()


def digest(data: Any) -> str:
    """SHA-256 of plain data, in hexadecimal digits; equal data has equal digests."""
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()
