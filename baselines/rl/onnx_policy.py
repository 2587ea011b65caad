"""ONNX policy: a controller that is a trained network, run by onnxruntime, without PyTorch.

A policy is two files. NAME.onnx is the network from observations in SI units to accelerations in
m/s^2; every scaling is inside the graph. NAME.json is its card: how it was trained and what it
reached. Both are data: nothing in them is executed as code, so that files from strangers are no
more than bad policies. The controller adds nothing but the limits of `TrolleyLimits.saturate`,
which the predictive controllers' moves also pass.

Graph: input "observation", float64, shape (batch, 8); output "acceleration", float64, shape
(batch, 1). Its metadata, the texts that `description` makes, say what goes in and out: names, order
and units, the control period in which it acts and the largest acceleration that it asks for.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from baselines.controller import finite_observation
from baselines.mpc.limits import TrolleyLimits
from baselines.mpc.settings import MpcSettings
from crane_env.controller import Controller
from crane_env.episode.trajectory import UNITS
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters
from crane_env.support.checks import positive, regular_file
from crane_env.support.extras import require

FORMAT = "oilcrane-policy-2"
"""Version of the graph's layout, of its metadata and of the card."""

INPUT, OUTPUT = "observation", "acceleration"

SHIPPED = Path(__file__).parent / "policies"
"""Folder of the policies that come with the package."""

FATAL = 4
"""onnxruntime's log level that leaves errors to exceptions."""


def description(control_period: float, acceleration_max: float) -> dict[str, str]:
    """Metadata of a policy's graph; numbers and the units of what it observes are JSON.

    Args:
        control_period: in which it acts [s].
        acceleration_max: magnitude that it never exceeds [m/s^2].
    """
    return {
        "format": FORMAT,
        INPUT: json.dumps({name: UNITS[name] for name in Observation._fields}),
        OUTPUT: UNITS[OUTPUT],
        "control_period": json.dumps(control_period),
        "acceleration_max": json.dumps(acceleration_max),
    }


@final
class OnnxPolicy:
    """A trained policy; a copy or a pickle has the same graph in a session of its own.

    Args:
        path: the .onnx file.

    Attributes:
        sha256: of the file's content, which is what the policy is.
        metadata: what the graph says of itself; see `description`.
        control_period: in which it acts [s].
        acceleration_max: magnitude that it never exceeds, by its own account [m/s^2].

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: the file is no ONNX model, or none of this format and shape.
        ImportError: onnxruntime is missing; the message names the extra.
    """

    def __init__(self, path: str | Path) -> None:
        file = regular_file("policy file", path)
        self._open(str(file), file.read_bytes())

    def accelerations(self, observations: NDArray[np.float64]) -> NDArray[np.float64]:
        """Trolley accelerations [m/s^2], shape (N, 1), for observations, shape (N, 8).

        Raises:
            ValueError: the graph cannot be computed, or its answer has another shape.
        """
        try:
            (answer,) = self._session.run([OUTPUT], {INPUT: observations})
        except Exception as error:
            raise ValueError(f"{self._name!r} cannot be computed: {error}") from error
        accelerations: NDArray[np.float64] = answer
        if accelerations.shape != (len(observations), 1):
            raise ValueError(
                f"{self._name!r} answers {len(observations)} observations in shape "
                f"{accelerations.shape}."
            )
        return accelerations

    def __getstate__(self) -> tuple[str, bytes]:
        """The file, from which the session is made anew."""
        return self._name, self._content

    def __setstate__(self, state: tuple[str, bytes]) -> None:
        """Makes the session anew."""
        self._open(*state)

    def _open(self, name: str, content: bytes) -> None:
        onnxruntime = require("onnxruntime", extra="policies")
        self._name, self._content = name, content
        self.sha256 = hashlib.sha256(content).hexdigest()
        options = onnxruntime.SessionOptions()
        # One observation of eight numbers: threads cost more than they bring.
        options.intra_op_num_threads = 1
        options.inter_op_num_threads = 1
        options.log_severity_level = FATAL
        try:
            # From memory: a graph in memory cannot refer to other files.
            self._session: Any = onnxruntime.InferenceSession(
                content, options, providers=["CPUExecutionProvider"]
            )
        except Exception as error:
            raise ValueError(
                f"{name!r} is not a readable ONNX model ({type(error).__name__}): the file is "
                "corrupt or something else."
            ) from error
        self._check_description()
        self._check_ports()

    def _check_description(self) -> None:
        """Reads the metadata.

        Raises:
            ValueError: they are of another format, or say anything else than `description`.
        """
        found = self._session.get_modelmeta().custom_metadata_map
        if found.get("format") != FORMAT:
            raise ValueError(
                f"{self._name!r} is not a policy of format {FORMAT!r} (found "
                f"{found.get('format')!r}); export its model again by oilcrane train --export."
            )
        try:
            period, limit = (
                positive(name, json.loads(found[name]))
                for name in ("control_period", "acceleration_max")
            )
        except (KeyError, ValueError) as error:
            raise ValueError(f"The metadata of {self._name!r} are not whole: {error}") from error
        self.metadata = description(period, limit)
        for name in (INPUT, OUTPUT):
            if found.get(name) != self.metadata[name]:
                raise ValueError(
                    f"{self._name!r} has as {name} {found.get(name)}; a policy for the crane has "
                    f"{self.metadata[name]}."
                )
        self.control_period, self.acceleration_max = period, limit

    def _check_ports(self) -> None:
        """Makes sure of the graph's one input and output.

        Raises:
            ValueError: they are others; the message says which.
        """
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
                    f"{self._name!r} has {ports}."
                )


def read_card(path: str | Path) -> dict[str, Any]:
    """The card of a policy, checked against the policy's file.

    Args:
        path: the .onnx file, beside which the card lies.

    Raises:
        FileNotFoundError: there is no card or no policy.
        ValueError: the card is no JSON object of this format, belongs to another file, or says
            something else of the graph than the graph.
    """
    policy = OnnxPolicy(path)
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
    for name, value in {"sha256": policy.sha256, "graph": policy.metadata}.items():
        if card.get(name) != value:
            raise ValueError(
                f"The card {str(card_file)!r} does not belong to {str(file)!r}: its {name} differs."
            )
    return card


def table1_means(card: Mapping[str, Any]) -> dict[str, float]:
    """Means over Table I from the card of a training run, infinite if a manoeuvre failed."""
    return {name: math.inf if x is None else x for name, x in card["table1_means"].items()}


@dataclass(frozen=True)
class PolicyStatistics:
    """What a policy did since the controller's reset.

    Attributes:
        failures: answers that were no number, for which the trolley was braked to rest instead.
    """

    failures: int = 0


@final
class OnnxController(Controller):
    """Drives by a policy, within the trolley's limits; remembers nothing but its failures.

    Args:
        policy: the network.
        crane: nominal parameters, for their limits.

    Attributes:
        statistics: since the last reset.

    Raises:
        ValueError: the policy acts in another control period than the crane's.
    """

    def __init__(self, policy: OnnxPolicy, crane: CraneParameters) -> None:
        if not math.isclose(policy.control_period, crane.control_period, rel_tol=1e-9):
            raise ValueError(
                f"The policy acts every {policy.control_period} s, but the crane's control period "
                f"is {crane.control_period} s."
            )
        self._policy = policy
        self._limits = TrolleyLimits(crane, MpcSettings())
        self.reset()

    def reset(self) -> None:
        """Forgets the failures."""
        self.statistics = PolicyStatistics()

    def act(self, observation: NDArray[np.float64]) -> NDArray[np.float64]:
        """The policy's answer; see `Controller.act`."""
        measured = finite_observation(observation)
        try:
            asked = float(self._policy.accelerations(np.array([measured]))[0, 0])
        except ValueError:
            asked = math.nan
        if not math.isfinite(asked):
            asked = math.nan  # for which `saturate` brakes
            self.statistics = PolicyStatistics(self.statistics.failures + 1)
        return np.array([self._limits.saturate(asked, measured.trolley_velocity)])


def ppo(crane: CraneParameters) -> OnnxController:
    """The shipped PPO policy."""
    return OnnxController(OnnxPolicy(SHIPPED / "ppo.onnx"), crane)


def sac(crane: CraneParameters) -> OnnxController:
    """The shipped SAC policy."""
    return OnnxController(OnnxPolicy(SHIPPED / "sac.onnx"), crane)
