"""Stub controllers: factories for `make_controller` of controllers that misbehave on purpose."""

from __future__ import annotations

import os
import signal
import sys
import time

import numpy as np
from numpy.typing import NDArray

from baselines.mpc.settings import MpcSettings
from crane_env import CraneParameters

ACT_TIME = 0.002
"""How long `slow` thinks [s]."""


class Stub:
    """Does nothing, after `before_act`."""

    def reset(self) -> None:
        """Nothing to forget."""

    def act(self, observation: NDArray[np.float64]) -> NDArray[np.float64]:
        """No acceleration."""
        self.before_act(observation)
        return np.zeros(1)

    def before_act(self, observation: NDArray[np.float64]) -> None:
        """What the stub does wrong."""


class Slow(Stub):
    """Takes its time."""

    def before_act(self, observation: NDArray[np.float64]) -> None:
        time.sleep(ACT_TIME)


class Raising(Stub):
    """Raises as soon as the operator travels."""

    def before_act(self, observation: NDArray[np.float64]) -> None:
        if observation[6] != 0.0:
            raise ArithmeticError("no plan for this")


class Dying(Stub):
    """Takes its process along."""

    def before_act(self, observation: NDArray[np.float64]) -> None:
        if observation[6] != 0.0:
            os.kill(os.getpid(), signal.SIGSEGV)


class Hanging(Stub):
    """Never answers once the operator travels."""

    def before_act(self, observation: NDArray[np.float64]) -> None:
        while observation[6] != 0.0:
            time.sleep(1.0)


class Chatty(Stub):
    """Writes to standard output, past Python too, as solvers do."""

    def before_act(self, observation: NDArray[np.float64]) -> None:
        sys.stdout.write("banner\n")
        os.write(1, b'{"banner": 1}\n')


class Threaded(Stub):
    """Raises the number of threads that its process is meant to use."""

    def before_act(self, observation: NDArray[np.float64]) -> None:
        raise RuntimeError(f"threads={os.environ['OMP_NUM_THREADS']}")


def slow(crane: CraneParameters, settings: MpcSettings) -> Slow:
    return Slow()


def raising(crane: CraneParameters, settings: MpcSettings) -> Raising:
    return Raising()


def unbuildable(crane: CraneParameters) -> Stub:
    raise LookupError("nothing to build of")


def dying(crane: CraneParameters, settings: MpcSettings) -> Dying:
    return Dying()


def hanging(crane: CraneParameters) -> Hanging:
    return Hanging()


def chatty(crane: CraneParameters, settings: MpcSettings) -> Chatty:
    return Chatty()


def threaded(crane: CraneParameters, settings: MpcSettings) -> Threaded:
    return Threaded()
