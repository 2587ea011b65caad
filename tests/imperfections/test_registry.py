"""Registry: what describes imperfections, and what does not."""

from __future__ import annotations

import dataclasses
import json
from typing import Any

import gymnasium
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from crane_env.imperfections.base import MOST_SEVERE
from crane_env.imperfections.registry import (
    OUT_OF_FIELD,
    PARTS,
    SCENARIOS,
    describe,
    make_all_imperfections,
    make_imperfections,
    scaled,
)
from crane_env.imperfections.sensing import SensorNoise

ANY_JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.sampled_from([*PARTS, *SCENARIOS]),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(
            st.sampled_from(["name", "severity", "sway_angle", "gap", "x"]), inner, max_size=3
        )
    ),
    max_leaves=6,
)


@pytest.mark.parametrize("name", [*PARTS, *SCENARIOS])
def test_plain_data_makes_the_same_imperfections_again(name: str) -> None:
    parts = make_imperfections({"name": name, "severity": 0.5})
    assert parts == make_imperfections(f"{name}:0.5") == scaled(make_imperfections(name), 0.5)
    assert make_imperfections(json.loads(json.dumps(describe(parts)))) == parts


def test_parts_stand_in_the_order_of_the_signals_whatever_the_order_given() -> None:
    names = ["sensor-noise", {"name": "backlash", "gap": 0.01}, SensorNoise(severity=2.0)]
    assert [part.name for part in make_imperfections(names[:2])] == ["backlash", "sensor-noise"]
    assert make_imperfections(None) == make_imperfections([]) == ()
    with pytest.raises(ValueError, match="'sensor-noise' is given twice"):
        make_imperfections(names)


def test_field_is_what_all_cranes_can_have_and_says_where_it_comes_from() -> None:
    lasting = [part for part in PARTS.values() if part.name not in OUT_OF_FIELD]
    assert make_imperfections("field") == tuple(lasting)
    for part in PARTS.values():
        assert part.severity == 1.0
        for field in dataclasses.fields(part):
            assert not field.init or field.metadata["source"], f"{part.name}: {field.name}"


@pytest.mark.parametrize(
    ("spec", "sentence"),
    [
        ("rust", "Unknown imperfection 'rust'; valid: field, noise, .*sensor-noise"),
        ("field:much", "severity must be a finite number, not 'much'"),
        ("sensor-noise:much", "severity of 'sensor-noise' must be from 0 to 10, not 'much'"),
        ({"severity": 1.0}, "Unknown imperfection None; valid"),
        ({"name": "field", "gap": 1.0}, "Unknown 'field' field 'gap'; valid: severity"),
        (
            {"name": "backlash", "sway": 1.0},
            "Unknown 'backlash' field 'sway'; valid: severity, gap",
        ),
        ({"name": "backlash", "gap": -1.0}, "gap of 'backlash' must be from 0 to 1 m, not -1.0"),
        ({"name": "field", "severity": 11}, "severity of 'pendant-latency' must be from 0 to 10"),
        (3.0, "Imperfections are a name, a mapping with a name, .* not 3.0"),
    ],
)
def test_what_describes_no_imperfection_is_refused_with_a_sentence(
    spec: Any, sentence: str
) -> None:
    with pytest.raises(ValueError, match=sentence):
        make_imperfections(spec)
    with pytest.raises(ValueError, match=sentence):
        gymnasium.make("OILCrane-v0", imperfections=spec)
    env = gymnasium.make_vec("OILCrane-v0", num_envs=2)
    with pytest.raises(ValueError, match=sentence):
        env.reset(options={"imperfections": spec})
    env.close()


def test_a_list_of_lists_describes_each_crane() -> None:
    both = make_all_imperfections([None, ["noise", "backlash"]], 2)
    assert both == [(), make_imperfections(["noise", "backlash"])]
    assert make_all_imperfections(["noise", "backlash"], 3) == [both[1]] * 3
    with pytest.raises(ValueError, match="one for each of the 3 environments, not 2"):
        make_all_imperfections([None, ["noise"]], 3)
    with pytest.raises(ValueError, match=f"must be from 0 to {MOST_SEVERE:g}"):
        gymnasium.make_vec(
            "OILCrane-v0", imperfections="noise:5", randomisation={"severity": (0.0, 3.0)}
        )


@given(ANY_JSON)
@settings(max_examples=200, deadline=None)
def test_any_json_is_imperfections_or_a_sentence(spec: Any) -> None:
    try:
        parts = make_imperfections(spec)
    except ValueError as error:
        assert str(error).endswith(".")  # noqa: PT017
    else:
        assert make_imperfections(json.loads(json.dumps(describe(parts)))) == parts
