"""Registry of operators: an operator's program is one file plus one case here."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from numbers import Real
from typing import Any

from crane_env.operators.base import ButtonEvent, Operator, Program, ScheduledOperator
from crane_env.operators.manoeuvre import RandomManoeuvre
from crane_env.operators.script import ButtonScript, read_script
from crane_env.operators.semi_markov import RandomButtons
from crane_env.operators.table1 import TABLE_1, Table1Manoeuvre

OperatorSpec = str | Mapping[str, Any] | Program | Operator | Sequence[ButtonEvent]
"""What `make_operator` makes an operator of."""

VALID_NAMES = f"random, manoeuvre, table1:1 … table1:{len(TABLE_1)}, script:FILE"


def make_operator(spec: OperatorSpec) -> Operator:
    """Makes an operator.

    Args:
        spec: a name: "random" (see `RandomButtons`), "manoeuvre" (`RandomManoeuvre`), "table1:1" to
            "table1:10" (`Table1Manoeuvre`), "script:FILE" (`ButtonScript`);
            a mapping of a name and fields of that program, as `dataclasses.asdict` makes it;
            a program; an operator, which is returned as it is; or a sequence of `ButtonEvent`s.

    Raises:
        ValueError: an unknown name (the message lists the valid ones) or field, a value out of
            range, a malformed script, or something that is no operator at all.
        FileNotFoundError: there is no such script.
    """
    given: Any = spec
    if isinstance(given, str):
        return ScheduledOperator(_program(given, {}))
    if isinstance(given, Mapping):
        fields = dict(given)
        if "name" not in fields:
            raise ValueError(f"An operator's mapping needs a 'name', one of: {VALID_NAMES}.")
        return ScheduledOperator(_program(fields.pop("name"), fields))
    if isinstance(given, Sequence):
        return ScheduledOperator(ButtonScript(tuple(given)))
    if not isinstance(given, type):
        if hasattr(given, "reset") and hasattr(given, "press"):
            operator: Operator = given
            return operator
        if hasattr(given, "events"):
            return ScheduledOperator(given)
    raise ValueError(
        f"An operator is a name ({VALID_NAMES}), a mapping with a name, a program, an operator or "
        f"a sequence of button events, not {given!r}."
    )


def _program(name: object, fields: Mapping[str, Any]) -> Program:
    program: Any
    match str(name).partition(":"):
        case "random", "", "":
            program = RandomButtons()
        case "manoeuvre", "", "":
            program = RandomManoeuvre()
        case "table1", ":", number if number in _TABLE_1_NUMBERS:
            program = Table1Manoeuvre(int(number))
        case "script", _, _ if "schedule" in fields:  # need not be read any more
            program = ButtonScript((), str(name))
        case "script", ":", file if file:
            program = read_script(file)
        case _:
            raise ValueError(f"Unknown operator {name!r}; valid: {VALID_NAMES}.")
    restored: Program = _with_fields(program, fields, str(name))
    if restored.name != name:
        raise ValueError(f"The fields of operator {name!r} are those of {restored.name!r}.")
    return restored


_TABLE_1_NUMBERS = [str(number) for number in range(1, len(TABLE_1) + 1)]


def _with_fields(settings: Any, fields: Mapping[str, Any], where: str) -> Any:
    """A frozen dataclass with some fields replaced; mappings for those that are dataclasses."""
    names = [field.name for field in dataclasses.fields(settings) if field.init]
    changes: dict[str, Any] = {}
    for name, value in fields.items():
        if name not in names:
            raise ValueError(
                f"Operator {where!r} has no field {name!r}; valid: {', '.join(names)}."
            )
        present = getattr(settings, name)
        if dataclasses.is_dataclass(present) and isinstance(value, Mapping):
            changes[name] = _with_fields(present, value, f"{where}, {name}")
        elif isinstance(present, float) and (
            isinstance(value, bool) or not isinstance(value, Real)
        ):
            raise ValueError(f"Operator {where!r}: {name} must be a number, not {value!r}.")
        elif dataclasses.is_dataclass(present) and not isinstance(value, type(present)):
            raise ValueError(f"Operator {where!r}: {name} must be a mapping, not {value!r}.")
        else:
            changes[name] = value
    return dataclasses.replace(settings, **changes)
