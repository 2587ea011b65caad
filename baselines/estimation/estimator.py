"""Estimator: what a crane does now, from readings that are noisy and late; for any controller.

The readings that come in period k are of trolley and hoist at k - m, and of the sway at k - n, with
n >= m known. The filter lives in the sway's past: it advances from k - n - 1 to k - n along the
trolley velocities and cable lengths of that time, and there meets the reading. From that corrected
state it predicts to k - m along what was measured, and on to now along the accelerations that were
asked for since: v + T u, l + T l'.

The controller behind it is shown an observation whose sway is

    theta - d / g        and        theta' = (q - v) / l

In it the crane with a disturbance d obeys the equations of one without: q' = -g (theta - d / g)
- l' theta'. So whatever the controller does to bring the sway to zero brings it to d / g, where the
payload follows the trolley; its steady velocity error and its drift in steady wind are gone, though
it knows of no wind. What remains is l' d / g, by which a payload that hangs aslant moves sideways
while it is hoisted.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from baselines.controller import finite_observation
from baselines.estimation.filter import Motion, SwayEstimate, SwayFilter
from baselines.estimation.settings import EstimatorSettings
from crane_env.controller import Controller, check_controller
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters


@final
class Estimator:
    """Observation without noise, delay and disturbance, from those that come in.

    Args:
        crane: nominal parameters.
        settings: deviations and delays.

    Attributes:
        sway: state of the filter now.
        innovation: of the last readings of angle [rad] and rate [rad/s].
    """

    def __init__(self, crane: CraneParameters, settings: EstimatorSettings) -> None:
        self._filter = SwayFilter(crane, settings)
        self._gravity, self._period = crane.gravity, crane.control_period
        late = round(settings.drive_delay / crane.control_period)
        self._behind = round(settings.sway_delay / crane.control_period) - late
        self._asked: deque[float] = deque(maxlen=late)
        """Accelerations of the last m periods, the oldest first."""
        self._motions: deque[Motion] = deque(maxlen=self._behind + 2)
        """Readings of trolley and hoist of the times k - n - 1 to k - m."""
        self.reset()

    def reset(self) -> None:
        """Forgets the last episode; until readings say more, the crane was before as it is then."""
        self._asked.extend([0.0] * (self._asked.maxlen or 0))
        self._motions.clear()
        self._past = self.sway = SwayEstimate(0.0, 0.0, 0.0)
        self.innovation = (0.0, 0.0)

    def estimate(self, read: Observation) -> Observation:
        """What the crane does now; asked once a control period.

        Args:
            read: what was measured, finite, and the references, which are no measurement. Readings
                beyond all arithmetic come back as they are, and the filter begins anew.
        """
        now = Motion(read.trolley_velocity, read.cable_length, read.cable_rate)
        motions = self._motions
        if motions:
            motions.append(now)
            self._past = self._filter.advance(self._past, motions[0], motions[1])
            then = motions[1]
            self.innovation = self._filter.innovation(
                self._past, then, read.sway_angle, read.sway_rate
            )
            self._past = self._filter.correct(self._past, then, self.innovation)
        else:
            motions.extend([now] * (self._behind + 2))
            velocity = now.velocity + now.length * read.sway_rate
            self._past = SwayEstimate(read.sway_angle, velocity, 0.0)
        sway, position = self._past, read.trolley_position
        for step in range(1, self._behind + 1):
            sway = self._filter.advance(sway, motions[step], motions[step + 1])
        for acceleration in self._asked:
            velocity = now.velocity + self._period * acceleration
            later = Motion(velocity, now.length + self._period * now.rate, now.rate)
            sway = self._filter.advance(sway, now, later)
            position += 0.5 * self._period * (now.velocity + velocity)
            now = later
        self.sway = sway
        estimate = read._replace(
            trolley_position=position,
            trolley_velocity=now.velocity,
            cable_length=now.length,
            sway_angle=sway.angle - sway.disturbance / self._gravity,
            sway_rate=self._filter.rate(sway, now),
        )
        if all(map(math.isfinite, estimate)):
            return estimate
        self.reset()
        return read

    def acted(self, acceleration: float) -> None:
        """Takes note of the acceleration that was asked for after the last estimate [m/s^2]."""
        self._asked.append(acceleration)


@final
class Estimated(Controller):
    """Any controller behind an estimator.

    Args:
        crane: nominal parameters.
        inner: the controller.
        settings: of the estimator; also a mapping or a preset's name.

    Attributes:
        inner: the controller.
        estimator: what it sees the crane through.

    Raises:
        ValueError: what is behind it is no controller, or settings that are none.
        ImportError: scipy is not installed; the message names the extra.
    """

    def __init__(self, crane: CraneParameters, inner: Controller, settings: Any = None) -> None:
        check_controller(inner)
        self.inner = inner
        self.estimator = Estimator(crane, EstimatorSettings.of(settings))

    def reset(self) -> None:
        """Forgets the last episode; see `Controller.reset`."""
        self.inner.reset()
        self.estimator.reset()

    def act(self, observation: NDArray[np.float64]) -> NDArray[np.float64]:
        """What the controller does about the estimate; see `Controller.act`."""
        estimate = self.estimator.estimate(finite_observation(observation))
        action = self.inner.act(np.array(estimate))
        self.estimator.acted(float(np.asarray(action).item()))
        return action

    @property
    def statistics(self) -> Any:
        """Those of the controller behind it; None if it keeps none."""
        return getattr(self.inner, "statistics", None)


def estimated(crane: CraneParameters, inner: Controller, preset: str | None) -> Estimated:
    """A controller behind the estimator of a preset; None: sensors without delay."""
    return Estimated(crane, inner, preset)
