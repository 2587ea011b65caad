"""Registry of controllers: a controller is one file plus one line here."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any

from baselines.controller import Controller
from baselines.mpc_settings import MpcSettings
from crane_env.parameters import CraneParameters

CONTROLLERS: dict[str, str] = {
    "manual": "baselines.manual:manual",
    "linear": "baselines.linear_mpc:linear",
    "adaptive": "baselines.linear_mpc:adaptive",
    "adaptive-cvxpy": "baselines.equation6:adaptive_cvxpy",
}
"""Name of each controller and where its factory (crane, settings) -> Controller is."""


def make_controller(
    name: str,
    *,
    parameters: CraneParameters | Mapping[str, Any] | str | None = None,
    settings: MpcSettings | Mapping[str, Any] | None = None,
) -> Controller:
    """Builds a controller from nominal parameters.

    Args:
        name: one of `CONTROLLERS`.
        parameters: the crane that the controller believes in; None: the paper's.
        settings: the optimal control problem; None: the paper's. Ignored by controllers that
            solve none.

    Raises:
        ValueError: an unknown name (the message lists the valid ones), or values out of range.
        ImportError: a package is missing; the message names the extra that brings it.
    """
    if name not in CONTROLLERS:
        raise ValueError(f"Unknown controller {name!r}; valid: {', '.join(CONTROLLERS)}.")
    module, factory = CONTROLLERS[name].split(":")
    build = getattr(importlib.import_module(module), factory)
    controller: Controller = build(CraneParameters.of(parameters), MpcSettings.of(settings))
    return controller
