"""Registry of controllers: a controller is one file plus one line here.

A factory takes what its controller needs: `build(crane)`, or `build(crane, settings)` where the
annotation of `settings` says which: a frozen dataclass whose classmethod `of` reads a mapping of
its fields, such as `MpcSettings`. A factory of your own may leave the annotation out; it then gets
`MpcSettings`.
"""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from typing import Any

from baselines.mpc.settings import MpcSettings
from crane_env.controller import Controller, check_controller
from crane_env.parameters import CraneParameters
from crane_env.support.checks import shown
from crane_env.support.factory import FactoryError, found_at, is_place, placed_errors

CONTROLLERS: dict[str, str] = {
    "manual": "baselines.manual:manual",
    "linear": "baselines.mpc.linear:linear",
    "linear-open-loop": "baselines.mpc.linear:linear_open_loop",
    "linear-measured": "baselines.mpc.linear:linear_measured",
    "adaptive": "baselines.mpc.linear:adaptive",
    "nmpc-a": "baselines.mpc.nonlinear:nmpc_a",
    "nmpc-b": "baselines.mpc.nonlinear:nmpc_b",
    "nmpc-a-rti": "baselines.mpc.nonlinear:nmpc_a_rti",
    "nmpc-b-rti": "baselines.mpc.nonlinear:nmpc_b_rti",
    "nmpc-a-ipopt": "baselines.mpc.ipopt_form:nmpc_a_ipopt",
    "nmpc-b-ipopt": "baselines.mpc.ipopt_form:nmpc_b_ipopt",
    "nmpc-a-do-mpc": "baselines.mpc.do_mpc_form:nmpc_a_do_mpc",
    "ltv": "baselines.mpc.linear:ltv",
    "tabulated": "baselines.mpc.tabulated:tabulated",
    "tabulated-ltv": "baselines.mpc.tabulated:tabulated_ltv",
    "linear-cvxpy": "baselines.mpc.cvxpy_form:linear_cvxpy",
    "adaptive-cvxpy": "baselines.mpc.cvxpy_form:adaptive_cvxpy",
    "ppo": "baselines.rl.onnx_policy:ppo",
    "sac": "baselines.rl.onnx_policy:sac",
    "lqr": "baselines.classical.lqr:lqr",
}
"""Name of each controller and where its factory is."""


def make_controller(
    name: str,
    *,
    parameters: CraneParameters | Mapping[str, Any] | str | None = None,
    settings: object = None,
) -> Controller:
    """Builds a controller from nominal parameters.

    Args:
        name: one of `CONTROLLERS`, or a factory of your own as "package.module:factory".
        parameters: the crane that the controller believes in; None: the paper's.
        settings: of the type that the controller takes, see `settings_type`, or a mapping of
            fields that differ from its defaults; None: the defaults, the paper's.

    Raises:
        ValueError: an unknown name (the message lists the valid ones), values out of range, unknown
            settings, or settings for a controller that takes none. `FactoryError`, if a factory of
            your own fails or its result has no `reset` and `act`.
        ImportError: a package is missing; the message names the extra that brings it.
    """
    build = _factory(name)
    takes = _settings_type(name, build)
    crane = CraneParameters.of(parameters)
    if takes is None:
        if settings is not None:
            raise ValueError(f"The controller {name!r} takes no settings, but was given some.")
        arguments: tuple[Any, ...] = (crane,)
    else:
        arguments = (crane, takes.of(settings))
    with _placed_errors(name):
        controller = build(*arguments)
    try:
        check_controller(controller)
    except ValueError as error:
        raise FactoryError(f"The factory of {name!r} makes no controller. {error}") from None
    return controller  # type: ignore[no-any-return]


def settings_type(name: str) -> type | None:
    """Type of the settings that a controller takes; None if it takes none.

    Args:
        name: as `make_controller` takes it.

    Raises:
        ValueError: an unknown name, or a factory of another form than `build(crane, settings)`.
        ImportError: a module is missing.
    """
    takes: type | None = _settings_type(name, _factory(name))
    return takes


def _factory(name: str) -> Callable[..., Any]:
    place = CONTROLLERS.get(name, name) if isinstance(name, str) else ""
    if not is_place(place):
        raise ValueError(
            f"Unknown controller {shown(name)}; valid: {', '.join(CONTROLLERS)}, or a factory of "
            "your own as package.module:factory."
        )
    with _placed_errors(name):
        build = found_at(place)
    if not callable(build):
        raise ValueError(f"There is no controller factory at {place!r}.")
    return build  # type: ignore[no-any-return]


def _settings_type(name: str, build: Callable[..., Any]) -> Any:
    try:
        parameters = inspect.signature(build, eval_str=True).parameters.values()
    except (TypeError, ValueError, NameError, AttributeError, SyntaxError) as error:
        raise FactoryError(f"The factory of {name!r} has no readable signature: {error}.") from None
    positional = [p for p in parameters if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)]
    if len(positional) == 1:
        return None
    if len(positional) == 2:
        takes = positional[1].annotation
        if takes is inspect.Parameter.empty:
            return MpcSettings
        if dataclasses.is_dataclass(takes) and callable(getattr(takes, "of", None)):
            return takes
    raise FactoryError(
        f"The factory of {name!r} must be build(crane), or build(crane, settings) with settings of "
        "MpcSettings or another frozen dataclass that has a classmethod of."
    )


def _placed_errors(name: str) -> AbstractContextManager[None]:
    return nullcontext() if name in CONTROLLERS else placed_errors(f"controller {name!r}")
