"""Registry of operators: an operator's program is one file plus one case here."""

from __future__ import annotations

import copy
import dataclasses
import json
from collections.abc import Mapping, Sequence
from typing import Any

from crane_env.observation import CraneState
from crane_env.operators.base import ButtonEvent, Operator, Program, ScheduledOperator
from crane_env.operators.manoeuvre import RandomManoeuvre
from crane_env.operators.memoryless import MemorylessManoeuvre
from crane_env.operators.person.operator import PersonOperator
from crane_env.operators.person.person import PERSONS, Person
from crane_env.operators.recording import RecordedButtons, read_recording
from crane_env.operators.script import ButtonScript, read_script
from crane_env.operators.semi_markov import RandomButtons
from crane_env.operators.table1 import TABLE_1, Table1Manoeuvre
from crane_env.parameters import CraneParameters
from crane_env.support.checks import shown
from crane_env.support.factory import FactoryError, found_at, is_place, placed_errors
from crane_env.support.fields import with_fields

OperatorSpec = str | Mapping[str, Any] | Program | Operator | Sequence[ButtonEvent]
"""What `make_operator` makes an operator of."""

TABLE_1_NUMBERS = [str(number) for number in range(1, len(TABLE_1) + 1)]
"""What may follow "table1:"."""

VALID_NAMES = (
    f"random, stress, manoeuvre, memoryless, table1:1 … table1:{len(TABLE_1)}, "
    f"person:{'|'.join(PERSONS)}, script:FILE, recording:FILE, package.module:factory"
)
NOWHERE = CraneState(0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
"""Start of a recording of which all fields are yet to be given."""

FAMILIES = (
    *("random", "stress", "manoeuvre", "memoryless"),
    *("table1", "person", "script", "recording"),
)
"""What the names of operators begin with; no module of a factory is looked for under these."""


def make_operator(spec: OperatorSpec) -> Operator:
    """Makes an operator.

    Args:
        spec: a name: "random" or "stress" (see `RandomButtons`), "manoeuvre" (`RandomManoeuvre`),
            "memoryless" (`MemorylessManoeuvre`), "table1:1" to "table1:10" (`Table1Manoeuvre`),
            "script:FILE" (`ButtonScript`),
            "recording:FILE" (`RecordedButtons`), or "package.module:factory", a function of your
            own that takes nothing and returns a program or an operator; a mapping of a name and
            fields of that program, as `dataclasses.asdict` makes it; a program; an operator, which
            is returned as it is; or a sequence of `ButtonEvent`s.

    Raises:
        ValueError: an unknown name (the message lists the valid ones) or field, a value out of
            range, a malformed script or recording, or something that is no operator at all.
        FileNotFoundError: there is no such script or recording.
        ImportError: the module of a factory of your own cannot be imported, or a recording cannot
            be read for want of pyarrow.
    """
    given: Any = spec
    if isinstance(given, str):
        given = _program(given, {})
    elif isinstance(given, Mapping):
        fields = dict(given)
        if "name" not in fields:
            raise ValueError(f"An operator's mapping needs a 'name', one of: {VALID_NAMES}.")
        given = _program(fields.pop("name"), fields)
    elif isinstance(given, Sequence):
        given = ButtonScript(tuple(given))
    if isinstance(given, Person):
        return PersonOperator(given)
    if _presses(given):
        return given  # type: ignore[no-any-return]
    if _is_program(given):
        return ScheduledOperator(given)
    raise ValueError(
        f"An operator is a name ({VALID_NAMES}), a mapping with a name, a program, an "
        f"operator or a sequence of button events, not {shown(given)}."
    )


def _presses(given: Any) -> bool:
    return not isinstance(given, type) and hasattr(given, "reset") and hasattr(given, "press")


def _is_program(given: Any) -> bool:
    return not isinstance(given, type) and hasattr(given, "events")


def own_operator(spec: OperatorSpec) -> Operator:
    """Makes an operator that shares no state with the one given, nor with any other.

    An operator is copied (`copy.deepcopy`), so that each environment has one of its own. One that
    stands for something there is only one of, such as a real pendant, may define a `__deepcopy__`
    that returns itself.

    Raises:
        ValueError: as `make_operator`, or an operator that cannot be copied.
        FileNotFoundError: there is no such script.
    """
    operator = make_operator(spec)
    if type(operator) is ScheduledOperator:
        return ScheduledOperator(operator.program)
    try:
        return copy.deepcopy(operator)
    except Exception as error:
        raise ValueError(
            f"Each environment needs an operator of its own, and {shown(operator)} cannot be "
            f"copied: {error}."
        ) from error


def operator_program(name: str) -> dict[str, Any]:
    """Mapping of an operator with all its fields, from its name, which `make_operator` takes back.

    It is the same before and after its way through JSON. The file of a script or a recording need
    not be there any more; of an operator of your own that is no dataclass, the name is all.

    Raises:
        ValueError: an unknown name or a malformed script.
        FileNotFoundError: there is no such script.
        ImportError: the module of a factory of your own cannot be imported.
    """
    try:
        return {**describe_operator(make_operator(name)), "name": name}
    except TypeError as error:
        raise ValueError(f"The fields of operator {name!r} are no plain data: {error}.") from error


def describe_operator(operator: Operator) -> dict[str, Any]:
    """Name and fields of an operator as plain data; of one that is no dataclass, the name is all.

    Raises:
        TypeError: the fields are no plain data.
    """
    program = getattr(operator, "program", operator)
    name = str(getattr(program, "name", type(program).__name__))
    if not dataclasses.is_dataclass(program) or isinstance(program, type):
        return {"name": name}
    try:
        fields: dict[str, Any] = json.loads(json.dumps(dataclasses.asdict(program)))
    except ValueError as error:  # a circle
        raise TypeError(str(error)) from error
    return {**fields, "name": name}


def _program(name: object, fields: Mapping[str, Any]) -> Any:
    """The program of a name with some fields replaced; an operator where a factory made one."""
    own = False
    program: Any
    match str(name).partition(":"):
        case "random", "", "":
            program = RandomButtons()
        case "stress", "", "":
            program = RandomButtons.stress()
        case "manoeuvre", "", "":
            program = RandomManoeuvre()
        case "memoryless", "", "":
            program = MemorylessManoeuvre()
        case "table1", ":", number if number in TABLE_1_NUMBERS:
            program = Table1Manoeuvre(int(number))
        case "person", ":", skill if skill in PERSONS:
            program = PERSONS[skill]
        case "script", _, _ if "schedule" in fields:  # need not be read any more
            program = ButtonScript((), str(name))
        case "script", ":", file if file:
            program = read_script(file)
        case "recording", _, _ if fields.keys() >= {"schedule", "parameters", "start"}:
            program = RecordedButtons((), CraneParameters(), NOWHERE, str(name))
        case "recording", ":", file if file:
            program = read_recording(file)
        case head, _, _ if head not in FAMILIES and is_place(name):
            program, own = _of_factory(str(name)), True
        case _:
            raise ValueError(f"Unknown operator {shown(name)}; valid: {VALID_NAMES}.")
    if own and not fields:
        return program
    if not dataclasses.is_dataclass(program):
        raise ValueError(f"The operator {shown(name)} has no fields that could be given.")
    restored: Any = with_fields(
        program, fields, must_be="Fields must be a mapping", unknown=f"{str(name)!r} field"
    )
    if not own and restored.name != name:
        raise ValueError(
            f"The fields of operator {shown(name)} are those of {shown(restored.name)}."
        )
    return restored


def _of_factory(place: str) -> Any:
    with placed_errors(f"operator {place!r}"):
        build = found_at(place)
        made = build() if callable(build) else None
    if not _presses(made) and not _is_program(made):
        raise FactoryError(
            f"The factory of {place!r} must return a program, an object with events(rng, start, "
            f"parameters), or an operator, with reset and press, not {shown(made)}."
        )
    return made
