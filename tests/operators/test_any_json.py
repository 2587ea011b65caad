"""Whatever JSON can say: an operator that presses, or one sentence that says why not."""

from __future__ import annotations

import contextlib
import dataclasses
import json
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from crane_env.episode.trajectory import Trajectory
from crane_env.observation import CraneState
from crane_env.operators.manoeuvre import RandomManoeuvre
from crane_env.operators.memoryless import MemorylessManoeuvre
from crane_env.operators.person.person import Person
from crane_env.operators.recording import RecordedButtons, read_recording
from crane_env.operators.registry import make_operator
from crane_env.operators.script import ButtonScript, read_script
from crane_env.operators.semi_markov import ButtonHabits, RandomButtons
from crane_env.operators.table1 import Table1Manoeuvre
from crane_env.parameters import CraneParameters

PAPER = CraneParameters.paper()
CRANE = gymnasium.make("OILCrane-v0").unwrapped
START = CraneState(0.0, 0.0, 8.0, 0.0, 0.0, 0.0)
NAMES = (
    "random",
    "manoeuvre",
    "memoryless",
    "table1:3",
    "person:trained",
    "script",
    "script:a.csv",
    "script:a.json",
    "recording:a.parquet",
)
DESCRIBED = [
    f.name
    for kind in (ButtonHabits, RandomManoeuvre, MemorylessManoeuvre, Person, RecordedButtons)
    for f in dataclasses.fields(kind)
]
FIELDS = ("name", "time", "buttons", "schedule", "number", "travel", "hoist", *DESCRIBED)

scalars = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.sampled_from([0, 1, 10**400, -1, 1e308, 5e-324, 0.5, 3.0]),
    st.floats(),
    st.text(max_size=5),
    st.sampled_from((*NAMES, *FIELDS, "up")),
)
values = st.recursive(
    scalars,
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.dictionaries(st.sampled_from(FIELDS) | st.text(max_size=3), inner, max_size=4),
    ),
    max_leaves=12,
)
mappings = st.builds(
    lambda name, fields: {**fields, "name": name},
    st.sampled_from(NAMES),
    st.dictionaries(st.sampled_from(FIELDS), scalars | values, max_size=3),
)
scripts = st.lists(
    st.tuples(scalars, st.lists(scalars, min_size=3, max_size=5)) | scalars, max_size=4
)
"""Lists that may be scripts of Python events."""


def presses(operator: Any) -> None:
    """Plays an operator for 20 s."""
    operator.reset(np.random.default_rng(0), START, PAPER)
    for k in range(1000):
        assert len(operator.press(0.02 * k, START)) == 4


@given(values | mappings | scripts)
@settings(deadline=None, max_examples=200)
def test_any_json_value_is_an_operator_that_presses_or_a_value_error(value: Any) -> None:
    with contextlib.suppress(ValueError, FileNotFoundError, ImportError):
        presses(make_operator(value))


@given(values | mappings | scripts)
@settings(deadline=None, max_examples=30)
def test_so_it_is_among_the_options_of_a_reset(value: Any) -> None:
    with contextlib.suppress(ValueError, FileNotFoundError, ImportError):
        CRANE.reset(options={"operator": value})


@pytest.mark.parametrize("kind", [Table1Manoeuvre, ButtonScript])
@given(first=values, second=values)
@settings(deadline=None)
def test_so_it_is_of_the_programs_themselves(kind: Any, first: Any, second: Any) -> None:
    with contextlib.suppress(ValueError):
        kind(first)
    with contextlib.suppress(ValueError):
        ButtonScript(first, second)
    with contextlib.suppress(ValueError):
        RecordedButtons(first, PAPER, second, "recording:a.parquet")
    with contextlib.suppress(ValueError):
        RandomButtons(travel=first, hoist=second)
    for read in (read_script, read_recording, Trajectory.from_parquet):
        with contextlib.suppress(ValueError, FileNotFoundError):
            read(first)


texts = st.one_of(
    st.text(),
    values.map(json.dumps),
    st.lists(st.fixed_dictionaries({"time": scalars, "buttons": values})).map(json.dumps),
    st.lists(st.lists(st.text(',;#"\t01.e time', max_size=6), max_size=4)).map(
        lambda rows: "time,up\n" + "\n".join(",".join(row) for row in rows)
    ),
).map(lambda text: text.encode("utf-8", errors="surrogatepass"))


@pytest.mark.parametrize("ending", ["csv", "json"])
@given(content=texts | st.binary())
@settings(deadline=None)
def test_any_file_is_a_script_or_a_value_error(
    tmp_path_factory: pytest.TempPathFactory, ending: str, content: bytes
) -> None:
    path: Path = tmp_path_factory.getbasetemp() / f"any.{ending}"
    path.write_bytes(content)
    with contextlib.suppress(ValueError):
        presses(make_operator(read_script(path)))
