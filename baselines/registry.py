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
    "nmpc-a": "baselines.nmpc:nmpc_a",
    "nmpc-b": "baselines.nmpc:nmpc_b",
    "nmpc-a-rti": "baselines.nmpc:nmpc_a_rti",
    "nmpc-b-rti": "baselines.nmpc:nmpc_b_rti",
    "nmpc-a-ipopt": "baselines.nmpc_ipopt:nmpc_a_ipopt",
    "nmpc-b-ipopt": "baselines.nmpc_ipopt:nmpc_b_ipopt",
    "nmpc-a-do-mpc": "baselines.nmpc_do_mpc:nmpc_a_do_mpc",
    "ltv": "baselines.ltv:ltv",
    "tabulated": "baselines.tabulated:tabulated",
    "tabulated-ltv": "baselines.tabulated:tabulated_ltv",
    "linear-cvxpy": "baselines.equation6:linear_cvxpy",
    "adaptive-cvxpy": "baselines.equation6:adaptive_cvxpy",
    "ppo": "baselines.onnx_policy:ppo",
    "sac": "baselines.onnx_policy:sac",
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
        name: one of `CONTROLLERS`, or a factory of your own as "package.module:factory".
        parameters: the crane that the controller believes in; None: the paper's.
        settings: the optimal control problem; None: the paper's. Ignored by controllers that
            solve none.

    Raises:
        ValueError: an unknown name (the message lists the valid ones), or values out of range.
        ImportError: a package is missing; the message names the extra that brings it.
    """
    module, colon, factory = CONTROLLERS.get(name, name).partition(":")
    if not colon:
        raise ValueError(
            f"Unknown controller {name!r}; valid: {', '.join(CONTROLLERS)}, or a factory of your "
            "own as package.module:factory."
        )
    try:
        build = getattr(importlib.import_module(module), factory, None)
    except ModuleNotFoundError as error:
        raise ImportError(f"The controller {name!r} cannot be imported: {error}.") from error
    if not callable(build):
        raise ValueError(f"The module {module!r} has no controller factory {factory!r}.")
    controller: Controller = build(CraneParameters.of(parameters), MpcSettings.of(settings))
    return controller
