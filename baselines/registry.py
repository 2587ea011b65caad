"""Registry of controllers: a controller is one file plus one line here.

A factory takes what its controller needs: `build(crane)`, or `build(crane, settings)` where the
annotation of `settings` says which: a frozen dataclass whose classmethod `of` reads a mapping of
its fields, such as `MpcSettings`. A factory of your own may leave the annotation out; it then gets
`MpcSettings`.

A preset is a name for settings of a controller, kept in presets.json with where they come from. In
text, such as a command line, it follows the controller's name: "l1@sway".

What may stand in front of any of them, "estimated:adaptive", is in `baselines.wrappers`.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
import json
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any, NamedTuple

from baselines.mpc.settings import MpcSettings
from baselines.wrappers import WRAPPERS, innermost, unwrap
from crane_env.controller import Controller, check_controller
from crane_env.parameters import CraneParameters
from crane_env.support.checks import choice, shown
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
    "l1": "baselines.mpc.l1:l1",
    "tabulated": "baselines.mpc.tabulated:tabulated",
    "tabulated-ltv": "baselines.mpc.tabulated:tabulated_ltv",
    "linear-cvxpy": "baselines.mpc.cvxpy_form:linear_cvxpy",
    "adaptive-cvxpy": "baselines.mpc.cvxpy_form:adaptive_cvxpy",
    "ppo": "baselines.rl.onnx_policy:ppo",
    "sac": "baselines.rl.onnx_policy:sac",
    "lqr": "baselines.classical.lqr:lqr",
    "lqr-integral": "baselines.classical.lqr_integral:lqr_integral",
    "energy": "baselines.classical.energy:energy",
    "delayed-feedback": "baselines.classical.delayed_feedback:delayed_feedback",
    "commercial": "baselines.classical.commercial:commercial",
    "shaper-zv": "baselines.classical.shaper:zv",
    "shaper-zv-frozen": "baselines.classical.shaper:zv_frozen",
    "shaper-zvd": "baselines.classical.shaper:zvd",
    "shaper-ei": "baselines.classical.shaper:ei",
    "shaper-um-zv": "baselines.classical.shaper:um_zv",
    "flat": "baselines.classical.flat:flat",
    "recommended": "baselines.classical.recommended:recommended",
    "gambler": "baselines.limits.gambler:gambler",
}
"""Name of each controller and where its factory is."""

DEFAULT_PRESET = "paper"
"""Of every controller: the defaults of its settings, the paper's where the paper has it."""


class Preset(NamedTuple):
    """Settings under a name.

    Attributes:
        settings: the fields that differ from the defaults.
        provenance: where they come from, in a sentence.
    """

    settings: Mapping[str, Any]
    provenance: str


def make_controller(
    name: str,
    *,
    parameters: CraneParameters | Mapping[str, Any] | str | None = None,
    settings: object = None,
    preset: str | None = None,
) -> Controller:
    """Builds a controller from nominal parameters.

    Args:
        name: one of `CONTROLLERS`, alone or as "name@preset", or a factory of your own as
            "package.module:factory"; behind any of `WRAPPERS`, as "estimated:adaptive".
        parameters: the crane that the controller believes in; None: the paper's.
        settings: of the type that the controller takes, see `settings_type`, or a mapping of
            fields that differ from the preset's; None: the preset's.
        preset: one of `presets`; None: the name's, or "paper".

    Raises:
        ValueError: an unknown name or preset (the message lists the valid ones), values out of
            range, unknown settings, settings for a controller that takes none, or whole settings
            beside a preset other than "paper", which they would replace. `FactoryError`, if a
            factory of your own fails or its result has no `reset` and `act`.
        ImportError: a package is missing; the message names the extra that brings it.
    """
    crane = CraneParameters.of(parameters)
    wrapped = unwrap(name)
    if wrapped is not None:
        wrapper, told, inner = wrapped
        behind = make_controller(inner, parameters=crane, settings=settings, preset=preset)
        return found_at(WRAPPERS[wrapper])(crane, behind, told)  # type: ignore[no-any-return]
    name, named = _split(name)
    if named is not None:
        if preset not in (None, named):
            raise ValueError(
                f"The controller {name!r} can have one preset, not {named!r} and {shown(preset)}."
            )
        preset = named
    build = _factory(name)
    settings = _with_preset(name, settings, preset)
    takes = _settings_type(name, build)
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
    name, _ = _split(innermost(name))
    takes: type | None = _settings_type(name, _factory(name))
    return takes


def presets(name: str) -> dict[str, Preset]:
    """Presets of a controller by name, "paper" first.

    Args:
        name: as `make_controller` takes it.

    Raises:
        ValueError: an unknown name.
    """
    name, _ = _split(innermost(name))
    _factory(name)
    default = Preset({}, "the defaults of the controller's settings")
    return {DEFAULT_PRESET: default, **_shipped_presets().get(name, {})}


@functools.cache
def _shipped_presets() -> dict[str, dict[str, Preset]]:
    read = json.loads(Path(__file__).with_name("presets.json").read_text(encoding="utf-8"))
    return {
        controller: {preset: Preset(**fields) for preset, fields in named.items()}
        for controller, named in read.items()
    }


def _split(name: str) -> tuple[str, str | None]:
    """The controller's name, and the preset's if there is one; only the registry's have presets."""
    controller, at, preset = name.partition("@") if isinstance(name, str) else ("", "", "")
    return (controller, preset) if at and controller in CONTROLLERS else (name, None)


def _with_preset(name: str, settings: object, preset: str | None) -> object:
    if preset is None or preset == DEFAULT_PRESET:
        return settings
    known = presets(name)
    chosen = known[choice(f"preset of {name!r}", preset, known)].settings
    if settings is not None and not isinstance(settings, Mapping):
        raise ValueError(
            f"Beside the preset {preset!r}, settings of {name!r} must be a mapping of fields that "
            f"differ from it, not {type(settings).__name__}."
        )
    return _merged(chosen, settings or {})


def _merged(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """A mapping with entries of another put in place of its own, mappings among them likewise."""
    merged = {**below, **above}
    for key in below.keys() & above.keys():
        if isinstance(below[key], Mapping) and isinstance(above[key], Mapping):
            merged[key] = _merged(below[key], above[key])
    return merged


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
