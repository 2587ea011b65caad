"""Stop contract: what a controller makes of a press of the travel button, whatever else is so.

A person at the pendant can learn that the payload comes to rest 1 m after the release. Nobody can
learn a distance that depends on the length of the cable, on the hoist and on how long the button
was held; and who presses for 0.2 s to move the payload by 0.2 m means 0.2 m. IAE sees little of
that, and even rewards a controller that ignores short presses. So these indices stand beside it:
they belong to a controller, over a family of short episodes, not to one episode.

Each episode is one press of the travel button, from rest, at one of a few cable lengths, with the
hoist at rest, lifting or lowering around the release. With payload position x_p, release r and rest
at the end (the mean over the last sway period, so that a sway that stays does not count):

    displacement        x_p(end) - x_p(0), which should be the integral of w
    stopping distance   x_p(end) - x_p(r)
    settled             within 50 mm of the rest for good
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import gymnasium
import numpy as np

from crane_env.controller import Controller
from crane_env.episode.metrics import SETTLING_BAND, release_step
from crane_env.episode.play import run_episode
from crane_env.episode.trajectory import Trajectory
from crane_env.operators.base import Press, press_events
from crane_env.operators.script import ButtonScript
from crane_env.parameters import CraneParameters

HOLDS = (0.1, 0.2, 0.5, 1.0, 2.0, 4.0, 8.0)
"""How long the button is held [s]."""

INCHING = 0.2
"""The press by which persons inch [s]."""

TRAVEL = 2.0
"""Presses of at least this count for the stopping distance [s]: most controllers have the payload
travel steadily by then."""

LENGTHS = (0.3, 0.5, 0.8)
"""Cable lengths at the press, as shares of the way between the hoist's limits."""

HOISTED = 2.5
"""How long the hoist button is held, from a second before the release on, if at all [s]."""

HOISTING = (None, "up", "down")

BEGIN = 0.5
"""Time of the press [s]."""

WAIT = 15.0
"""Played after the release [s]."""


class PressOutcome(NamedTuple):
    """One press and what became of it.

    Attributes:
        hold: how long the button was held [s].
        cable_length: at the press [m].
        hoist: button that was pressed around the release; None: none.
        asked: integral of w [m].
        displacement: of the payload, from before the press to its rest [m].
        stopping_distance: from the release to the rest [m].
        settling_time: from the release until within 50 mm of the rest for good [s].
    """

    hold: float
    cable_length: float
    hoist: str | None
    asked: float
    displacement: float
    stopping_distance: float
    settling_time: float


@dataclass(frozen=True)
class StopContract:
    """How well a controller keeps the contract; nan where no press of `stops` is of the kind.

    Attributes:
        displacement_error: largest | displacement - asked | of all presses [m].
        inching_error: mean | displacement - asked | / asked of presses of 0.2 s [1].
        inching_settled: share of presses of 0.2 s after which the payload rests within 50 mm of
            where it was asked to be [1].
        stop_distance: mean stopping distance of presses of 2 s and more [m].
        stop_spread: their largest less their least [m].
        settling_time: mean over presses of 2 s and more [s].
        inching_settling_time: mean over presses of 0.2 s [s].
        failures: presses whose simulation failed; they are not in `stops`.
        stops: each press.
    """

    displacement_error: float
    inching_error: float
    inching_settled: float
    stop_distance: float
    stop_spread: float
    settling_time: float
    inching_settling_time: float
    failures: int
    stops: tuple[PressOutcome, ...]

    @classmethod
    def of(cls, stops: tuple[PressOutcome, ...], failures: int = 0) -> StopContract:
        """The indices of presses."""
        travelled = [one for one in stops if one.hold >= TRAVEL]
        inched = [one for one in stops if one.hold == INCHING]
        missed = [abs(one.displacement - one.asked) for one in inched]
        distances = [one.stopping_distance for one in travelled]
        return cls(
            displacement_error=max(
                (abs(one.displacement - one.asked) for one in stops), default=math.nan
            ),
            inching_error=_mean([m / one.asked for m, one in zip(missed, inched, strict=True)]),
            inching_settled=_mean([float(m <= SETTLING_BAND) for m in missed]),
            stop_distance=_mean(distances),
            stop_spread=max(distances) - min(distances) if distances else math.nan,
            settling_time=_mean([one.settling_time for one in travelled]),
            inching_settling_time=_mean([one.settling_time for one in inched]),
            failures=failures,
            stops=stops,
        )

    def as_dict(self) -> dict[str, float]:
        """Index name to value."""
        return {
            one.name: getattr(self, one.name)
            for one in dataclasses.fields(self)
            if one.name != "stops"
        }


def stop_contract(
    env: gymnasium.Env[Any, Any],
    controller: Controller,
    *,
    holds: tuple[float, ...] = HOLDS,
    seed: int = 0,
) -> StopContract:
    """Plays the presses and measures what the controller made of them.

    Args:
        env: an OILCrane environment, wrapped or not, of whatever crane and imperfections.
        controller: it is reset before each press.
        holds: how long the button is held [s].
        seed: of every episode.

    Raises:
        ValueError: as `run_episode`.
    """
    parameters: CraneParameters = env.get_wrapper_attr("parameters")
    span = parameters.cable_length_max - parameters.cable_length_min
    stops, failures = [], 0
    for hold, share, hoist in itertools.product(holds, LENGTHS, HOISTING):
        length = parameters.cable_length_min + share * span
        presses = [Press("forward", BEGIN, BEGIN + hold)]
        if hoist is not None:
            lifted = max(BEGIN + hold - 1.0, 0.0)
            longest = 0.25 * span / parameters.hoist_speed
            presses.append(Press(hoist, lifted, lifted + min(HOISTED, longest)))
        played = run_episode(
            env,
            controller,
            seed=seed,
            options={
                "operator": ButtonScript(tuple(press_events(presses))),
                "cable_length": length,
            },
            max_steps=round((BEGIN + hold + WAIT) / parameters.control_period),
        )
        if played.simulation_failed:
            failures += 1
        else:
            stops.append(_stop(played, hold, length, hoist))
    return StopContract.of(tuple(stops), failures)


def rest_of(played: Trajectory) -> float:
    """Where the payload comes to rest [m]: its mean position over the last sway period."""
    turn = played.parameters.sway_period(float(played.cable_length[-1]))
    return float(played.payload_position[-round(turn / played.parameters.control_period) :].mean())


def _stop(played: Trajectory, hold: float, length: float, hoist: str | None) -> PressOutcome:
    period, position = played.parameters.control_period, played.payload_position
    release = release_step(played.travel_reference)
    assert release is not None, "a press has a release"
    rest = rest_of(played)
    unsettled = np.flatnonzero(np.abs(position[release:] - rest) > SETTLING_BAND)
    return PressOutcome(
        hold=hold,
        cable_length=length,
        hoist=hoist,
        asked=float(played.travel_reference.sum() * period),
        displacement=rest - float(position[0]),
        stopping_distance=rest - float(position[release]),
        settling_time=(int(unsettled[-1]) + 1 if unsettled.size else 0) * period,
    )


def _mean(values: list[float]) -> float:
    return float(np.mean(values)) if values else math.nan
