"""Registry of controllers: a controller is one file plus one line here."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any

from baselines.mpc.settings import MpcSettings
from crane_env.controller import Controller
from crane_env.parameters import CraneParameters

CONTROLLERS: dict[str, str] = {
    "manual": "baselines.manual:manual",
    "linear": "baselines.mpc.linear:linear",
    "adaptive": "baselines.mpc.linear:adaptive",
    "nmpc-a": "baselines.mpc.nonlinear:nmpc_a",
    "nmpc-b": "baselines.mpc.nonlinear:nmpc_b",
    "nmpc-a-rti": "baselines.mpc.nonlinear:nmpc_a_rti",
    "nmpc-b-rti": "baselines.mpc.nonlinear:nmpc_b_rti",
    "nmpc-a-ipopt": "baselines.mpc.ipopt_form:nmpc_a_ipopt",
    "nmpc-b-ipopt": "baselines.mpc.ipopt_form:nmpc_b_ipopt",
    "nmpc-a-do-mpc": "baselines.mpc.do_mpc_form:nmpc_a_do_mpc",
    "ltv": "baselines.mpc.ltv:ltv",
    "tabulated": "baselines.mpc.tabulated:tabulated",
    "tabulated-ltv": "baselines.mpc.tabulated:tabulated_ltv",
    "linear-cvxpy": "baselines.mpc.cvxpy_form:linear_cvxpy",
    "adaptive-cvxpy": "baselines.mpc.cvxpy_form:adaptive_cvxpy",
    "ppo": "baselines.rl.onnx_policy:ppo",
    "sac": "baselines.rl.onnx_policy:sac",
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
