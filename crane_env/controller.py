"""Controller: the contract of whatever drives the trolley; nothing else is required of it."""

from __future__ import annotations

from abc import abstractmethod
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class Controller(Protocol):
    """Anything that answers an observation with a trolley acceleration."""

    @abstractmethod
    def reset(self) -> None:
        """Forgets the last episode."""

    @abstractmethod
    def act(self, observation: NDArray[np.float64]) -> NDArray[np.float64]:
        """Trolley acceleration [m/s^2], shape (1,), for an observation, shape (8,).

        Raises:
            ValueError: the observation has the wrong shape or an entry that is not finite.
        """
