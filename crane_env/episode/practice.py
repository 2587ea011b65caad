"""Practice session: a person tries the crane with a controller before an episode, and learns."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from crane_env.controller import Controller, check_controller
from crane_env.environment.single import OILCraneEnv
from crane_env.imperfections.registry import ImperfectionSpec
from crane_env.operators.person.person import Person
from crane_env.operators.person.practice import Practice
from crane_env.parameters import CraneParameters


def practise(
    person: Person,
    controller: Controller,
    *,
    seed: int,
    parameters: CraneParameters | Mapping[str, Any] | str | None = None,
    start: Mapping[str, Any] | None = None,
    imperfections: ImperfectionSpec = None,
) -> Person:
    """Lets a person give `practice_trials` presses and watch what the crane makes of them.

    Args:
        person: who practises.
        controller: that drives the trolley meanwhile; it is reset.
        seed: of the presses and of what is seen.
        parameters: of the crane; as for `OILCraneEnv`.
        start: where the crane begins; as the options of `OILCraneEnv.reset`.
        imperfections: of the crane; as for `OILCraneEnv`.

    Returns:
        The same person with the beliefs learned.

    Raises:
        ValueError: a value out of range, or something that is no controller.
    """
    check_controller(controller)
    operator = Practice(person)
    environment = OILCraneEnv(operator=operator, parameters=parameters, imperfections=imperfections)
    observation, _ = environment.reset(seed=seed, options=dict(start or {}))
    practising = environment.operator
    assert isinstance(practising, Practice), "the environment has a copy of it"
    controller.reset()
    failed = False
    while not practising.done and not failed:
        observation, _, _, failed, _ = environment.step(controller.act(observation))
    return practising.belief.held_by(person)
