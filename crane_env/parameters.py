"""Parameters of an overhead crane: masses, cable, drives, limits and time steps, all in SI units.

Two presets: `CraneParameters()` is the crane of the paper (section V), `CraneParameters.field()`
a pendant-controlled shop crane with the ramps and speeds that such cranes really have.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from crane_env.support.checks import choice, not_negative, positive, within
from crane_env.support.fields import from_fields

MAY_BE_ZERO = frozenset(
    {
        "cable_damping",
        "trolley_friction",
        "sway_friction",
        "hoist_ramp_time",
        "drive_bandwidth",
        "limit_switch_margin",
    }
)
"""Quantities that a crane may be without."""

RANGES = {
    "trolley_mass": (1e-3, 1e8, "kg"),
    "payload_mass": (1e-3, 1e8, "kg"),
    "cable_stiffness": (1e-1, 1e12, "N"),
    "cable_damping": (1e-9, 1e12, "N s"),
    "trolley_friction": (1e-9, 1e12, "N s/m"),
    "sway_friction": (1e-9, 1e12, "N m s/rad"),
    "gravity": (1e-2, 1e3, "m/s^2"),
    "travel_speed": (1e-6, 1e3, "m/s"),
    "hoist_speed": (1e-6, 1e3, "m/s"),
    "hoist_ramp_time": (1e-6, 1e6, "s"),
    "acceleration_max": (1e-6, 1e3, "m/s^2"),
    "trolley_speed_max": (1e-6, 1e3, "m/s"),
    "drive_bandwidth": (1e-3, 1e6, "rad/s"),
    "cable_length_initial": (1e-2, 1e5, "m"),
    "cable_length_min": (1e-2, 1e5, "m"),
    "cable_length_max": (1e-2, 1e5, "m"),
    "rail_half_length": (1e-2, 1e6, "m"),
    "limit_switch_margin": (1e-6, 1e6, "m"),
    "control_period": (1e-4, 10.0, "s"),
    "physics_step": (1e-6, 1.0, "s"),
}
"""Ranges in which numbers and the plant's kinematic coordinates are exact enough for a crane."""

MAX_DRIVE_STEP = 4.0
"""Largest drive bandwidth times physics step; the position loop is integrated explicitly."""

MAX_CABLE_STEP = 1.0
"""Largest axial frequency of the cable times physics step; stability ends at 2."""

MAX_SWAY_STEP = 0.25
"""Largest frequency of the pendulum, or of one thrown by the trolley, times physics step."""

MAX_STRAIN = 0.1
"""Largest stretch of the cable under the payload's weight, as a share of its length."""

MAX_HOISTED_SHARE = 0.2
"""Largest share of the shortest cable that is hoisted in a control period, for which its gains are
held."""

MAX_SUBSTEPS = 10_000
"""Most physics steps in a control period."""


@dataclass(frozen=True, kw_only=True)
class CraneParameters:
    """What the crane is made of; the defaults are the paper's (section V).

    Values that the paper does not give are marked "assumed"; docs/crane.md lists the reasons.

    Attributes:
        trolley_mass: m_c [kg].
        payload_mass: m [kg].
        cable_stiffness: K_l [N], stiffness times length: k = K_l / unstretched length.
        cable_damping: C_l [N s], damping times length: c = C_l / unstretched length.
        trolley_friction: C_c [N s/m], viscous, on the trolley.
        sway_friction: C_1 [N m s/rad], viscous, on the sway.
        gravity: g [m/s^2].
        travel_speed: alpha [m/s], payload velocity that a travel button asks for, eq. (4).
        hoist_speed: beta [m/s], cable rate that a hoist button asks for, eq. (5).
        hoist_ramp_time: time from rest to `hoist_speed` [s]; 0 is a true step (assumed).
        acceleration_max: limit of the trolley acceleration [m/s^2].
        trolley_speed_max: limit of the trolley speed [m/s] (assumed).
        drive_bandwidth: bandwidth of the drive's inner velocity loop [rad/s]; its position loop is
            a quarter of it (critically damped). 0 releases the drive: the trolley rolls freely.
        cable_length_initial: sheave to payload at reset [m] (assumed).
        cable_length_min: upper limit switch of the hoist [m] (assumed).
        cable_length_max: lower limit switch of the hoist [m] (assumed).
        rail_half_length: the rails reach from minus to plus this trolley position [m] (assumed).
        limit_switch_margin: the drive stops this far before the rail's end [m] (assumed).
        control_period: T_s [s].
        physics_step: longest time step of the simulation [s]; the control period is divided into
            equal steps of no more.

    Raises:
        ValueError: a value outside its physical range; the message names it and what is allowed.
    """

    trolley_mass: float = 600.0
    payload_mass: float = 100.0
    cable_stiffness: float = 1e6
    cable_damping: float = 1000.0
    trolley_friction: float = 0.1
    sway_friction: float = 0.01
    gravity: float = 9.81
    travel_speed: float = 1.0
    hoist_speed: float = 1.0
    hoist_ramp_time: float = 0.3
    acceleration_max: float = 5.0
    trolley_speed_max: float = 2.0
    drive_bandwidth: float = 1000.0
    cable_length_initial: float = 8.0
    cable_length_min: float = 1.0
    cable_length_max: float = 12.0
    rail_half_length: float = 20.0
    limit_switch_margin: float = 0.25
    control_period: float = 0.02
    physics_step: float = 0.004

    def __post_init__(self) -> None:
        """Refuses values that no crane can have."""
        for field in dataclasses.fields(self):
            check = not_negative if field.name in MAY_BE_ZERO else positive
            number = check(field.name, getattr(self, field.name))
            if number != 0.0:
                within(field.name, number, *RANGES[field.name])
            object.__setattr__(self, field.name, number)
        if not self.cable_length_min < self.cable_length_max:
            raise ValueError(
                f"cable_length_min ({self.cable_length_min} m) must be below "
                f"cable_length_max ({self.cable_length_max} m)."
            )
        if not self.cable_length_min <= self.cable_length_initial <= self.cable_length_max:
            raise ValueError(
                f"cable_length_initial ({self.cable_length_initial} m) must lie within the hoist "
                f"limits, {self.cable_length_min} to {self.cable_length_max} m."
            )
        if self.travel_speed > self.trolley_speed_max:
            raise ValueError(
                f"travel_speed ({self.travel_speed} m/s) must not exceed "
                f"trolley_speed_max ({self.trolley_speed_max} m/s)."
            )
        if self.limit_switch_margin >= self.rail_half_length:
            raise ValueError(
                f"limit_switch_margin ({self.limit_switch_margin} m) must be below "
                f"rail_half_length ({self.rail_half_length} m)."
            )
        self._check_simulation()

    def _check_simulation(self) -> None:
        """Refuses what the simulation would get wrong."""
        step, shortest = self.simulation_step, self.cable_length_min
        if self.substeps > MAX_SUBSTEPS:
            raise ValueError(
                f"control_period ({self.control_period} s) must be at most {MAX_SUBSTEPS} times "
                f"physics_step ({self.physics_step} s)."
            )
        if self.drive_bandwidth * step > MAX_DRIVE_STEP:
            raise ValueError(
                f"drive_bandwidth ({self.drive_bandwidth} rad/s) times physics_step "
                f"({step:g} s) must not exceed {MAX_DRIVE_STEP} for a stable simulation."
            )
        weight = self.payload_mass * self.gravity
        if weight > MAX_STRAIN * self.cable_stiffness:
            raise ValueError(
                f"cable_stiffness ({self.cable_stiffness:g} N) must be at least "
                f"{weight / MAX_STRAIN:g} N, or the payload stretches the cable by more than "
                f"{MAX_STRAIN:.0%}."
            )
        inertia = 1.0 / self.payload_mass + 1.0 / self.trolley_mass
        unstretched = self.unstretched_length(shortest)
        axial = math.sqrt(self.cable_stiffness / unstretched * inertia)
        pendulum = 2.0 * math.pi / self.sway_period(shortest, trolley_free=True)
        thrown = math.sqrt(self.acceleration_max / shortest)
        longest = min(MAX_CABLE_STEP / axial, MAX_SWAY_STEP / max(pendulum, thrown))
        if step > longest:
            raise ValueError(
                f"physics_step ({step:g} s) must be at most {longest:.3g} s for a cable of this "
                f"stiffness and a payload of this mass at the shortest length."
            )
        if self.hoist_speed * self.control_period > MAX_HOISTED_SHARE * shortest:
            raise ValueError(
                f"hoist_speed ({self.hoist_speed} m/s) must be at most "
                f"{MAX_HOISTED_SHARE * shortest / self.control_period:g} m/s, so that a control "
                f"period changes the shortest cable by no more than {MAX_HOISTED_SHARE:.0%}."
            )

    @classmethod
    def paper(cls) -> CraneParameters:
        """The crane of the paper, section V."""
        return cls()

    @classmethod
    def field(cls) -> CraneParameters:
        """A pendant-controlled 2 t shop crane: slow ramps, slow hoist, a drive that is not ideal.

        Travel 1 m/s with one speed step (EN 13557, operator walking along), ramps of 0.3 m/s^2,
        hoist 8 m/min; the cable keeps the axial frequency and damping ratio of four falls of
        10 mm wire rope.
        """
        return cls(
            trolley_mass=1500.0,
            payload_mass=2000.0,
            cable_stiffness=2e7,
            cable_damping=2e4,
            trolley_friction=100.0,
            sway_friction=50.0,
            hoist_speed=0.13,
            hoist_ramp_time=0.5,
            acceleration_max=0.3,
            trolley_speed_max=1.25,
            drive_bandwidth=30.0,
            cable_length_initial=6.0,
            cable_length_max=10.0,
        )

    @classmethod
    def of(cls, value: CraneParameters | Mapping[str, Any] | str | None) -> CraneParameters:
        """Reads parameters from themselves, a preset's name, a mapping of fields, or None (paper).

        Raises:
            ValueError: an unknown preset or field name, or a value out of range.
        """
        if isinstance(value, str):
            return PRESETS[choice("crane preset", value, PRESETS)]
        return from_fields(
            cls,
            value,
            must_be="Crane parameters must be CraneParameters, a mapping or a preset's name",
            unknown="crane parameter",
        )

    @property
    def substeps(self) -> int:
        """Physics steps per control period."""
        return max(1, math.ceil(self.control_period / self.physics_step - 1e-9))

    @property
    def simulation_step(self) -> float:
        """Time step that divides the control period, `physics_step` or a little less [s]."""
        return self.control_period / self.substeps

    @property
    def hoist_acceleration(self) -> float:
        """Rate of change of the hoist rate on its ramp [m/s^2]; infinite for a true step."""
        return self.hoist_speed / self.hoist_ramp_time if self.hoist_ramp_time else math.inf

    @property
    def trolley_position_limit(self) -> float:
        """Trolley position at which the limit switches have stopped the drive [m], either side."""
        return self.rail_half_length - self.limit_switch_margin

    def unstretched_length(self, cable_length: float) -> float:
        """Unstretched length [m] of a cable that hangs at rest with `cable_length` [m].

        The stretch m g / k with k = K_l / l_0 is l_0 (m g / K_l), so l = l_0 (1 + m g / K_l).
        """
        return cable_length / (1.0 + self.payload_mass * self.gravity / self.cable_stiffness)

    def sway_period(self, cable_length: float, *, trolley_free: bool = False) -> float:
        """Period of small sway at a constant length [s].

        Args:
            cable_length: sheave to payload, stretched [m].
            trolley_free: whether the trolley rolls freely instead of following its drive; the
                pendulum is then stiffened by the ratio of the masses.
        """
        ratio = 1.0 + self.payload_mass / self.trolley_mass if trolley_free else 1.0
        return 2.0 * math.pi * math.sqrt(cable_length / (self.gravity * ratio))


PRESETS: dict[str, CraneParameters] = {
    "paper": CraneParameters.paper(),
    "field": CraneParameters.field(),
}
