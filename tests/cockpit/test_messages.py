"""Messages: what a page says is read, and everything else is refused."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from baselines.cockpit.messages import LONGEST, Choose, Hold, Stop, read
from crane_env.operators.base import Buttons

HOLD = {"type": "hold", "token": "t", "sequence": 3, "tick": 8, "buttons": [True] + 3 * [False]}


def test_what_a_page_says_is_read() -> None:
    assert read(json.dumps(HOLD)) == Hold("t", 3, 8, Buttons(forward=True))
    assert read('{"type": "stop"}') == Stop()
    chosen = {"type": "choose", "token": "t", "what": "controller", "name": "ltv"}
    assert read(json.dumps(chosen)) == Choose("t", "controller", "ltv")


@pytest.mark.parametrize(
    "change",
    [
        {"type": "press"},
        {"type": None},
        {"sequence": -1},
        {"sequence": 2**53},
        {"sequence": True},
        {"tick": 1.0},
        {"tick": float("nan")},
        {"buttons": [1, 0, 0, 0]},
        {"buttons": [True]},
        {"buttons": None},
        {"token": 7},
        {"more": 1},
        {"token": "t" * LONGEST},
    ],
)
def test_what_no_page_says_is_refused(change: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=r"message|No page says"):
        read(json.dumps(HOLD | change))


values = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=9)
objects = st.dictionaries(st.sampled_from([*HOLD]), values | st.lists(values, max_size=4))


@given(st.text() | st.binary() | objects.map(lambda change: json.dumps(HOLD | change)))
def test_any_text_is_a_message_or_refused_in_a_sentence(given_: object) -> None:
    told = "."
    try:
        read(given_)
    except ValueError as error:
        told = str(error)
    assert told.endswith(".")
