"""ONNX policy: a controller that is a trained network, run by onnxruntime, without PyTorch.

A policy is two files. NAME.onnx is the network from observations in SI units to accelerations in
m/s^2; every scaling is inside the graph. NAME.json is its card: how it was trained and what it
reached. Both are data: nothing in them is executed as code, so that files from strangers are no
more than bad policies. The controller adds nothing but the limits of `TrolleyLimits.saturate`,
which the predictive controllers' moves also pass.

Graph: input "observation", float64, shape (batch, 8); output "acceleration", float64, shape
(batch, 1); metadata "format" = `FORMAT`.
"""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from baselines.controller import finite_observation
from baselines.mpc.limits import TrolleyLimits
from baselines.mpc.settings import MpcSettings
from crane_env.controller import Controller
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters
from crane_env.support.extras import require

FORMAT = "oilcrane-policy-1"
"""Version of the graph's layout and of the card."""

INPUT, OUTPUT = "observation", "acceleration"

SHIPPED = Path(__file__).parent / "policies"
"""Folder of the policies that come with the package."""


class OnnxPolicy:
    """A trained policy.

    Args:
        path: the .onnx file.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: the file is no ONNX model, or none of this format and shape.
        ImportError: onnxruntime is missing; the message names the extra.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        onnxruntime = require("onnxruntime", extra="policies")
        file = Path(path)
        if not file.is_file():
            raise FileNotFoundError(f"There is no policy file {str(file)!r}.")
        options = onnxruntime.SessionOptions()
        # One observation of eight numbers: threads cost more than they bring.
        options.intra_op_num_threads = 1
        options.inter_op_num_threads = 1
        options.log_severity_level = FATAL
        try:
            # From memory: a graph in memory cannot refer to other files.
            self._session: Any = onnxruntime.InferenceSession(
                file.read_bytes(), options, providers=["CPUExecutionProvider"]
            )
        except Exception as error:
            raise ValueError(
                f"{str(file)!r} is not a readable ONNX model ({type(error).__name__}): the file is "
                "corrupt or something else."
            ) from error
        self._check(file)

    def accelerations(self, observations: NDArray[np.float64]) -> NDArray[np.float64]:
        """Trolley accelerations [m/s^2], shape (N, 1), for observations, shape (N, 8)."""
        (answer,) = self._session.run([OUTPUT], {INPUT: observations})
        accelerations: NDArray[np.float64] = answer
        return accelerations

    def _check(self, file: Path) -> None:
        """Refuses a graph of another format, or with other inputs or outputs.

        Raises:
            ValueError: it is one; the message says what differs.
        """
        found = self._session.get_modelmeta().custom_metadata_map.get("format")
        if found != FORMAT:
            raise ValueError(
                f"{str(file)!r} is not a policy of format {FORMAT!r} (found {found!r}); "
                "export it again with oilcrane train --export."
            )
        for kind, nodes, name, width in (
            ("input", self._session.get_inputs(), INPUT, len(Observation._fields)),
            ("output", self._session.get_outputs(), OUTPUT, 1),
        ):
            ports = [(node.name, node.type, list(node.shape)) for node in nodes]
            fits = (
                len(ports) == 1
                and ports[0][:2] == (name, "tensor(double)")
                and len(ports[0][2]) == 2
                and not isinstance(ports[0][2][0], int)
                and ports[0][2][1] == width
            )
            if not fits:
                raise ValueError(
                    f"A policy has one {kind}, {name!r}, float64 of shape (batch, {width}); "
                    f"{str(file)!r} has {ports}."
                )


FATAL = 4
"""onnxruntime's log level that leaves errors to exceptions."""


def read_card(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The card of a policy, checked against the policy's file.

    Args:
        path: the .onnx file, beside which the card lies.

    Raises:
        FileNotFoundError: there is no card or no policy.
        ValueError: the card is no JSON object of this format, or belongs to another file.
    """
    file = Path(path)
    card_file = file.with_suffix(".json")
    if not card_file.is_file():
        raise FileNotFoundError(f"The policy {str(file)!r} has no card {str(card_file)!r}.")
    try:
        card = json.loads(card_file.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ValueError(f"The card {str(card_file)!r} is not readable JSON: {error}.") from error
    if not isinstance(card, dict) or card.get("format") != FORMAT:
        raise ValueError(f"The card {str(card_file)!r} is none of format {FORMAT!r}.")
    if card.get("sha256") != hashlib.sha256(file.read_bytes()).hexdigest():
        raise ValueError(
            f"The card {str(card_file)!r} does not belong to {str(file)!r}: its sha256 differs."
        )
    return card


@final
class OnnxController(Controller):
    """Drives by a policy, within the trolley's limits; remembers nothing.

    Args:
        policy: the network.
        crane: nominal parameters, for their limits.
    """

    def __init__(self, policy: OnnxPolicy, crane: CraneParameters) -> None:
        self._policy = policy
        self._limits = TrolleyLimits(crane, MpcSettings())

    def reset(self) -> None:
        """Nothing to forget; see `Controller.reset`."""

    def act(self, observation: NDArray[np.float64]) -> NDArray[np.float64]:
        """The policy's answer; see `Controller.act`."""
        measured = finite_observation(observation)
        asked = float(self._policy.accelerations(np.array([measured]))[0, 0])
        return np.array([self._limits.saturate(asked, measured.trolley_velocity)])


def ppo(crane: CraneParameters) -> OnnxController:
    """The shipped PPO policy."""
    return OnnxController(OnnxPolicy(SHIPPED / "ppo.onnx"), crane)


def sac(crane: CraneParameters) -> OnnxController:
    """The shipped SAC policy."""
    return OnnxController(OnnxPolicy(SHIPPED / "sac.onnx"), crane)
