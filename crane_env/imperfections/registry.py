"""Registry of imperfections and named scenarios: what a name, a mapping or a list stands for."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from crane_env.imperfections.base import Imperfection
from crane_env.imperfections.drive import (
    AccelerationQuantisation,
    Backlash,
    DriveDeadTime,
    DriveLag,
    HoistSag,
    WornBrake,
)
from crane_env.imperfections.force import Bumps, SteadyForce
from crane_env.imperfections.operation import EmergencyStop, PendantLatency
from crane_env.imperfections.payload import DoublePendulum, Ground, PayloadMass
from crane_env.imperfections.sensing import (
    CableLengthError,
    SensorBias,
    SensorDelay,
    SensorDropout,
    SensorNoise,
    SensorQuantisation,
)
from crane_env.imperfections.wind import Wind
from crane_env.support.checks import choice, real, shown
from crane_env.support.fields import with_fields

PARTS: dict[str, Imperfection] = {
    part.name: part
    for part in (
        PendantLatency(),
        DriveDeadTime(),
        DriveLag(),
        AccelerationQuantisation(),
        EmergencyStop(),
        Backlash(),
        WornBrake(),
        HoistSag(),
        PayloadMass(),
        DoublePendulum(),
        Wind(),
        SteadyForce(),
        Bumps(),
        Ground(),
        SensorDelay(),
        CableLengthError(),
        SensorBias(),
        SensorNoise(),
        SensorQuantisation(),
        SensorDropout(),
    )
}
"""Each imperfection as in the field, in the order in which signals meet them."""

OUT_OF_FIELD = ("steady-force", "double-pendulum")
"""A steady force, for the field has wind; and slings, which make another plant of the crane: in a
vector environment all cranes have them, equally severe, or none."""

SCENARIOS: dict[str, tuple[Imperfection, ...]] = {
    "field": tuple(part for name, part in PARTS.items() if name not in OUT_OF_FIELD),
    "noise": (SensorNoise(), SensorBias(), SensorQuantisation()),
    "delay": (SensorDelay(),),
    "noise-and-delay": (SensorDelay(), SensorNoise()),
    "dropout": (SensorDropout(sway_angle=0.2, sway_rate=0.2, outage=0.2),),
    "wrong-length": (CableLengthError(gain=0.1, offset=0.0),),
    "soft-drive": (DriveDeadTime(), DriveLag()),
    "worn-drive": (AccelerationQuantisation(), Backlash(), WornBrake(), HoistSag()),
    "late-buttons": (PendantLatency(latency=0.3),),
    "stops": (EmergencyStop(mean_interval=10.0, reset_time=2.0),),
    "long-payload": (DoublePendulum(offset=1.5, gyration_radius=1.2),),
    "gust": (Wind(mean_speed=0.0, gust_speed=10.0),),
    "air-drag": (Wind(mean_speed=0.0),),
    "pick-up": (PayloadMass(gain=0.0, pick_up=0.5),),
    "release": (PayloadMass(gain=0.0, pick_up=-0.3),),
}
"""Named sets of imperfections; "field" is all but `OUT_OF_FIELD`."""

ImperfectionSpec = str | Mapping[str, Any] | Imperfection | Sequence[Any] | None
"""What `make_imperfections` makes imperfections of."""

VectorImperfectionSpec = ImperfectionSpec
"""One description for all cranes, or a list or tuple with one list or tuple for each."""


def make_imperfections(spec: ImperfectionSpec) -> tuple[Imperfection, ...]:
    """Makes a set of imperfections.

    Args:
        spec: a name of `SCENARIOS` or `PARTS`, also with a severity that multiplies those of its
            parts, as "field:0.5"; a mapping of such a name and fields of the imperfection, or of a
            scenario's name and a severity; an imperfection; a sequence of such; or None: none.

    Returns:
        The imperfections, in the order in which signals meet them.

    Raises:
        ValueError: an unknown name or field, a value out of range, or one imperfection twice.
    """
    parts: dict[str, Imperfection] = {}
    for part in _parts(spec):
        if part.name in parts:
            raise ValueError(f"The imperfection {part.name!r} is given twice.")
        parts[part.name] = part
    places = list(PARTS)
    return tuple(sorted(parts.values(), key=lambda part: places.index(part.name)))


def make_all_imperfections(spec: Any, count: int) -> list[tuple[Imperfection, ...]]:
    """Makes the imperfections of each crane.

    Args:
        spec: as for `make_imperfections`, for all; or a list or tuple, of which each entry is None,
            a list or a tuple and describes one crane.
        count: number of cranes.

    Raises:
        ValueError: as `make_imperfections`, or a list of another length.
    """
    each = isinstance(spec, (list, tuple)) and any(
        one is None or isinstance(one, (list, tuple)) for one in spec
    )
    if not each:
        return [make_imperfections(spec)] * count
    if len(spec) != count:
        raise ValueError(
            f"A list of imperfections of each crane needs one for each of the {count} "
            f"environments, not {len(spec)}."
        )
    return [make_imperfections(one) for one in spec]


def scaled(parts: Iterable[Imperfection], factor: float) -> tuple[Imperfection, ...]:
    """The same imperfections, their severities multiplied.

    Raises:
        ValueError: a severity leaves its range.
    """
    return tuple(
        dataclasses.replace(part, severity=part.severity * real("severity", factor))
        for part in parts
    )


def describe(parts: Iterable[Imperfection]) -> list[dict[str, Any]]:
    """Imperfections as plain data, which `make_imperfections` takes back."""
    return [dataclasses.asdict(part) for part in parts]


def _parts(spec: Any) -> Iterable[Imperfection]:
    if spec is None:
        return ()
    if isinstance(spec, Imperfection):
        return (spec,)
    if isinstance(spec, str):
        name, colon, severity = spec.partition(":")
        return _named(name, {"severity": _number(severity)} if colon else {})
    if isinstance(spec, Mapping):
        fields = dict(spec)
        return _named(fields.pop("name", None), fields)
    if isinstance(spec, Sequence):
        return [part for one in spec for part in _parts(one)]
    raise ValueError(
        "Imperfections are a name, a mapping with a name, an Imperfection, a list of these, or "
        f"None, not {shown(spec)}."
    )


def _number(text: str) -> object:
    try:
        return float(text)
    except ValueError:
        return text


def _named(name: object, fields: Mapping[str, Any]) -> Iterable[Imperfection]:
    choice("imperfection", name, (*SCENARIOS, *PARTS))
    if name in PARTS:
        part = PARTS[str(name)]
        return (
            with_fields(
                part, fields, must_be="Fields must be a mapping", unknown=f"{name!r} field"
            ),
        )
    for field in fields:
        choice(f"{name!r} field", field, ("severity",))
    return scaled(SCENARIOS[str(name)], fields.get("severity", 1.0))
