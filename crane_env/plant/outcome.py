"""Outcome: what a control period made of a crane (floats) or of many (arrays)."""

from __future__ import annotations

from typing import Any, NamedTuple

from crane_env.observation import CraneState


class Outcome(NamedTuple):
    """Where a control period led.

    Attributes:
        state: of the crane now.
        cable_tension: now [N]; exactly 0 when slack.
        acceleration: mean acceleration of the trolley's setpoint over the period [m/s^2].
        limited: the speed limit or a limit switch overruled the commanded acceleration.
        collision_speed: at which the payload met an obstacle, across its face; 0 if it met none
            [m/s].
        failed: the equations of motion had no usable solution; the crane is where it was before.
    """

    state: CraneState
    cable_tension: Any
    acceleration: Any
    limited: Any
    collision_speed: Any
    failed: Any
