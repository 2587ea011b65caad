"""Domain randomisation: its ranges, its distributions, its refusals."""

from __future__ import annotations

import dataclasses
import json
from typing import Any

import numpy as np
import pytest
from scipy.stats import kstest

from crane_env.environment.randomisation import Randomisation
from crane_env.parameters import CraneParameters

PAPER = CraneParameters.paper()
WIDE = Randomisation(
    payload_mass=(50.0, 200.0),
    cable_length_initial=(2.0, 12.0),
    cable_stiffness=(1e5, 2e6),
    drive_bandwidth=(10.0, 1000.0),
)


def test_each_quantity_is_drawn_from_its_own_distribution() -> None:
    rng = np.random.default_rng(0)
    cranes = [WIDE.draw(rng, PAPER) for _ in range(1000)]
    for name, (low, high) in WIDE.ranges.items():
        drawn = np.array([getattr(crane, name) for crane in cranes])
        assert ((low <= drawn) & (drawn <= high)).all()
        if name in ("cable_stiffness", "drive_bandwidth"):
            drawn, low, high = np.log(drawn), np.log(low), np.log(high)
        assert kstest((drawn - low) / (high - low), "uniform").pvalue > 0.01
    other = {name: getattr(PAPER, name) for name in WIDE.ranges}
    assert {dataclasses.replace(crane, **other) for crane in cranes} == {PAPER}


def test_without_ranges_nothing_is_drawn_and_the_crane_is_the_one_given() -> None:
    rng = np.random.default_rng(0)
    assert Randomisation().draw(rng, PAPER) is PAPER
    assert rng.bit_generator.state == np.random.default_rng(0).bit_generator.state


def test_a_range_of_one_value_is_that_value() -> None:
    one = Randomisation(payload_mass=(70.0, 70.0), cable_stiffness=(3e5, 3e5))
    crane = one.draw(np.random.default_rng(0), PAPER)
    assert (crane.payload_mass, crane.cable_stiffness) == (70.0, 3e5)


def test_it_is_read_from_what_json_makes_of_it() -> None:
    assert Randomisation.of(json.loads(json.dumps(dataclasses.asdict(WIDE)))) == WIDE
    assert Randomisation.of(WIDE) is WIDE
    assert Randomisation.of(None) == Randomisation()


@pytest.mark.parametrize("given", [(2.0, 1.0), (0.0, 1.0), (1.0, np.inf), (1.0,), 3.0, ("a", "b")])
def test_a_range_that_is_none_is_refused(given: Any) -> None:
    with pytest.raises(ValueError, match=r"drive_bandwidth must be a range .* in order, not"):
        Randomisation(drive_bandwidth=given)


def test_what_is_no_randomisation_is_refused() -> None:
    with pytest.raises(ValueError, match="Unknown randomisation field 'mass'; valid: payload_mas"):
        Randomisation.of({"mass": (1.0, 2.0)})
    with pytest.raises(ValueError, match="must be a Randomisation or a mapping, not list"):
        Randomisation.of([1.0])  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("ranges", "sentence"),
    [
        ({"cable_length_initial": (0.5, 3.0)}, r"cable_length_initial \(0.5 m\)"),
        ({"cable_length_initial": (3.0, 13.0)}, r"cable_length_initial \(13.0 m\)"),
        ({"drive_bandwidth": (30.0, 1e4)}, "drive_bandwidth .* must not exceed"),
        (
            {"payload_mass": (30.0, 200.0), "cable_stiffness": (1e5, 3e6)},
            "'payload_mass': 30.0, 'cable_stiffness': 3000000.0.*: physics_step .* at most",
        ),
    ],
)
def test_cranes_that_cannot_be_are_refused_before_one_is_drawn(
    ranges: dict[str, Any], sentence: str
) -> None:
    WIDE.check(PAPER)
    with pytest.raises(ValueError, match=sentence):
        Randomisation(**ranges).check(PAPER)
