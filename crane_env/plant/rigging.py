"""Rigging: a payload that swings on slings below the hook, which makes a double pendulum of it.

The hook, a point mass m_h, hangs on the cable at sway theta; the payload, of mass m_p, has its
centre at the distance d below the hook, at the angle phi from the vertical, and its radius of
gyration r about that centre. Slings are stiff and without friction. m = m_h + m_p is the payload
mass of `CraneParameters`. The payload's centre and its velocity, d below, to the sheave:

    x = l sin(theta) + d sin(phi),      z = l cos(theta) + d cos(phi)

On a driven trolley and a rigid cable, small oscillations obey

    [ m l^2      m_p l d           ] (theta, phi)'' + diag(m g l, m_p g d) (theta, phi) = 0
    [ m_p l d    m_p (d^2 + r^2)   ]

Sheave and payload are joined by a straight line that has a length and an angle, too. By these the
crane's state is the payload's: all that asks where the payload of a plain crane is gets the truth.
Sensors sit on the cable, and see its length and angle.

An obstacle that stops the payload's centre gives it an impulse across its face. The hook takes part
through the slings: with q = (hook across, hook down, phi), mass matrix M and the Jacobian J of the
centre across the face,

    dq = M^-1 J' (J M^-1 J')^-1 dx

for what the velocity loses and for how far the centre is put back. Cable and trolley give no
impulse.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from crane_env.kinematics import about_sheave
from crane_env.observation import CraneState
from crane_env.parameters import MAX_SWAY_STEP, CraneParameters
from crane_env.plant.contact import Stopped, halt, velocity_of
from crane_env.support.checks import positive
from crane_env.support.fields import check_fields
from crane_env.tasks.task import Obstacle, place_of

MAX_HOOK_STEP = 1.5
"""Largest axial frequency of the cable times physics step with the slings at right angles to it,
where the payload holds the hook least; stability ends at 2."""


@dataclass(frozen=True, kw_only=True)
class Rigging:
    """What hangs between cable and payload.

    Attributes:
        hook_mass: of the payload mass [kg].
        offset: from the hook to the payload's centre [m].
        gyration_radius: of the payload about its centre [m].

    Raises:
        ValueError: a number that is not positive.
    """

    hook_mass: float
    offset: float
    gyration_radius: float

    def __post_init__(self) -> None:
        """Refuses what does not hang."""
        check_fields(self, positive, ("hook_mass", "offset", "gyration_radius"))

    def check(self, parameters: CraneParameters) -> None:
        """Makes sure that a crane can be simulated with it.

        Raises:
            ValueError: it cannot; the message says why.
        """
        p, step = parameters, parameters.simulation_step
        if self.hook_mass >= p.payload_mass:
            raise ValueError(
                f"The hook ({self.hook_mass:g} kg) is part of the payload's mass "
                f"({p.payload_mass:g} kg) and must be lighter."
            )
        self.hook_length(p, p.cable_length_initial)
        gyration = self.gyration_radius**2
        held = (p.payload_mass - self.hook_mass) * gyration / (gyration + self.offset**2)
        inertia = 1.0 / (self.hook_mass + held) + 1.0 / p.trolley_mass
        axial = math.sqrt(p.cable_stiffness / p.cable_length_min * inertia)
        fastest = max(self.frequencies(p, p.cable_length_min))
        longest = min(MAX_HOOK_STEP / axial, MAX_SWAY_STEP / fastest)
        if step > longest:
            raise ValueError(
                f"physics_step ({step:g} s) must be at most {longest:.3g} s for a hook of "
                f"{self.hook_mass:g} kg with its payload {self.offset:g} m below it."
            )

    def hook_length(self, parameters: CraneParameters, cable_length: float) -> float:
        """From the sheave to the hook [m], where the payload hangs `cable_length` [m] below.

        Raises:
            ValueError: the hook would be above its limit switch.
        """
        length, shortest = cable_length - self.offset, parameters.cable_length_min
        if length < shortest:
            raise ValueError(
                f"cable_length must be at least {shortest + self.offset:g} m with the payload "
                f"{self.offset:g} m below the hook, not {cable_length:g} m."
            )
        return length

    def frequencies(self, parameters: CraneParameters, cable_length: float) -> tuple[float, float]:
        """Of small oscillations below a driven trolley, the slow one first [rad/s].

        Args:
            parameters: the crane.
            cable_length: from the sheave to the hook [m].
        """
        d, p = self.offset, parameters.payload_mass - self.hook_mass
        m, g, length = parameters.payload_mass, parameters.gravity, cable_length
        joint, about = p * length * d, p * (d * d + self.gyration_radius**2)
        mass = np.array([[m * length**2, joint], [joint, about]])
        weight = np.diag((m * g * length, p * g * d))
        squares = np.linalg.eigvals(np.linalg.solve(mass, weight))
        slow, fast = np.sqrt(np.sort(squares.real)).tolist()
        return slow, fast

    def payload(self, cable: CraneState, swing: float, swing_rate: float) -> CraneState:
        """State of a crane by the straight line from the sheave to the payload's centre.

        Args:
            cable: state by the cable.
            swing: angle of the slings from the cable, phi - theta [rad].
            swing_rate: [rad/s].
        """
        angle, rate = cable.sway_angle + swing, cable.sway_rate + swing_rate
        sine, cosine, d = math.sin(angle), math.cos(angle), self.offset
        (x, depth), (across, down) = place_of(cable), velocity_of(cable)
        trolley, speed = cable.trolley_position, cable.trolley_velocity
        sway, reach, sway_rate, reach_rate = about_sheave(
            x - trolley + d * sine,
            depth + d * cosine,
            across - speed + d * rate * cosine,
            down - d * rate * sine,
        )
        return CraneState(trolley, speed, reach, reach_rate, sway, sway_rate)

    def stop(
        self,
        obstacles: Sequence[Obstacle],
        before: CraneState,
        now: CraneState,
        cable: CraneState,
        swing: float,
        swing_rate: float,
        payload_mass: float,
    ) -> Stopped | None:
        """Stops the payload at obstacles that its centre met; None if it met none.

        Args:
            obstacles: that stand in its way.
            before: the crane a physics step ago, by the payload.
            now: the crane, by the payload.
            cable: the crane, by the cable.
            swing: angle of the slings from the cable [rad].
            swing_rate: [rad/s].
            payload_mass: with the hook [kg].
        """
        met = halt(obstacles, before, now)
        if met is None:
            return None
        angle = cable.sway_angle + swing
        axes = list(met.axes)
        response = self._response(angle, payload_mass, axes)
        (x, depth), (across, down) = place_of(cable), velocity_of(cable)
        moved = (response @ np.subtract(met.place, place_of(now))[axes]).tolist()
        turned = (response @ np.subtract(met.velocity, velocity_of(now))[axes]).tolist()
        sway, reach, sway_rate, reach_rate = about_sheave(
            x + moved[0] - cable.trolley_position,
            depth + moved[1],
            across + turned[0] - cable.trolley_velocity,
            down + turned[1],
        )
        rate = cable.sway_rate + swing_rate + turned[2]
        return Stopped(
            (sway, reach, angle + moved[2] - sway),
            (sway_rate, reach_rate, rate - sway_rate),
            met.speed,
        )

    def _response(self, angle: float, payload_mass: float, held: list[int]) -> NDArray[np.float64]:
        """What hook and slings make of a displacement of the payload's centre along some axes."""
        d, m, p = self.offset, payload_mass, payload_mass - self.hook_mass
        sine, cosine = d * math.sin(angle), d * math.cos(angle)
        about = d * d + self.gyration_radius**2
        mass = np.array(
            [[m, 0.0, p * cosine], [0.0, m, -p * sine], [p * cosine, -p * sine, p * about]]
        )
        jacobian = np.array([[1.0, 0.0, cosine], [0.0, 1.0, -sine]])[held]
        compliance = np.linalg.solve(mass, jacobian.T)
        response: NDArray[np.float64] = compliance @ np.linalg.inv(jacobian @ compliance)
        return response
