"""Controller: the contract of whatever drives the trolley; nothing else is required of it."""

from __future__ import annotations

from abc import abstractmethod
from numbers import Integral
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from crane_env.support.checks import shown


@runtime_checkable
class Controller(Protocol):
    """Anything that answers an observation with a trolley acceleration.

    A controller that may fail to find an answer, and then acts by a fallback of its own, may say
    how often it did: by an attribute `statistics` with a whole number `failures`, counted since its
    reset. `reported_failures` reads it.
    """

    @abstractmethod
    def reset(self) -> None:
        """Forgets the last episode."""

    @abstractmethod
    def act(self, observation: NDArray[np.float64]) -> NDArray[np.float64]:
        """Trolley acceleration [m/s^2], shape (1,), for an observation, shape (8,).

        One that drives N cranes at once gets shape (N, 8) and answers with shape (N, 1).

        Raises:
            ValueError: the observation has the wrong shape or an entry that is not finite.
        """


def check_controller(given: object) -> None:
    """Makes sure that something can drive before anything is played.

    Raises:
        ValueError: it lacks `reset` or `act`, or is a class instead of an object.
    """
    if isinstance(given, type) or not isinstance(given, Controller):
        raise ValueError(f"A controller is an object with reset and act, not {shown(given)}.")


def reported_failures(controller: Controller) -> int:
    """Answers since the reset that were a fallback's; 0 of a controller that reports none."""
    statistics = getattr(controller, "statistics", None)
    failures = getattr(statistics, "failures", 0)
    return int(failures) if isinstance(failures, Integral) else 0
