"""The paper: which of its statements reproduce on the default setup, and by how much.

These are results, not requirements: a change that turns one of them has changed the science and
has to say so. All of Table I is played once, by the script itself.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from baselines.commands.reproduce import main
from baselines.evaluation.results import ResultsFolder
from baselines.paper.checks import EQUAL, SIMILAR
from baselines.paper.stages import defaults_stage
from baselines.paper.verdicts import COUNTED
from crane_env.operators.table1 import HOIST_PRESS_DURATION, TABLE_1

FAILING = {"assumption-b-needs-nmpc", "horizon-is-1-s", "nmpc-b-reduces-iae", "similar-drift"}
"""Claims that fail on the defaults; the one about computing time is left to the script."""

QUIET_AFTER = 5.0
"""From so long after the last button on Fig. 4 is looked at [s]."""

Indices = dict[str, dict[str, NDArray[np.float64]]]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the script put what it found on the defaults."""
    output = tmp_path_factory.mktemp("paper")
    options = ("--grid", "none", "--manoeuvres", "0", "--no-timing", "--output", str(output))
    assert main(options) == 0
    return output


@pytest.fixture(scope="module")
def data(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "verdicts.json").read_text(encoding="utf-8"))
    return found


@pytest.fixture(scope="module")
def indices(data: dict[str, Any]) -> Indices:
    return {
        controller: {index: np.array(values, dtype=float) for index, values in own.items()}
        for controller, own in data["default"]["indices"].items()
    }


def test_on_the_defaults_14_of_the_16_counted_claims_hold(data: dict[str, Any]) -> None:
    claims = {claim["claim"]: claim for claim in data["claims"]}
    measured = {name: claim["default"]["measured"] for name, claim in claims.items()}
    assert {n for n, c in claims.items() if not c["default"]["holds"]} == FAILING, measured
    # The script is not asked for times; that a nonlinear MPC takes longer is beyond doubt.
    counted = [name for name, claim in claims.items() if claim["counted"]]
    assert len(counted) + 1 == COUNTED == 16
    assert len({*counted} - FAILING) + 1 == 14


def test_in_figure_4_the_linear_mpc_goes_on_swinging_and_no_other_does(folder: Path) -> None:
    results = ResultsFolder(folder / "defaults")
    last_button = TABLE_1[0].lower_press + HOIST_PRESS_DURATION
    swings = {}
    for spec in defaults_stage().traced:
        if spec.operator_name == "table1:1":
            seen = results.trajectory(spec)
            velocity = seen.payload_velocity[seen.time >= last_button + QUIET_AFTER]
            swings[spec.controller] = float(np.ptp(velocity))
    assert swings.pop("linear") > 0.1
    swings.pop("manual")
    assert max(swings.values()) < 0.05, swings


@pytest.mark.parametrize("index", ["IAE", "release_drift"])
def test_the_linear_mpc_is_the_worst_in_each_of_the_ten_manoeuvres(
    indices: Indices, index: str
) -> None:
    others = [indices[name][index] for name in ("adaptive", "nmpc-a", "nmpc-b", "ltv", "tabulated")]
    assert (indices["linear"][index] > np.max(others, axis=0)).all()


@pytest.mark.parametrize(
    ("first", "second"),
    [("nmpc-a", "adaptive"), ("ltv", "nmpc-b"), ("tabulated", "adaptive")],
)
@pytest.mark.parametrize("index", ["IAE", "release_drift"])
def test_these_two_differ_by_less_than_half_a_percent_in_each_manoeuvre(
    indices: Indices, first: str, second: str, index: str
) -> None:
    assert (np.abs(indices[first][index] / indices[second][index] - 1.0) < EQUAL).all()


def test_nmpc_b_lowers_the_drift_in_each_manoeuvre_but_the_iae_hardly(indices: Indices) -> None:
    drift, iae = (
        indices["nmpc-b"][index] / indices["adaptive"][index] - 1.0
        for index in ("release_drift", "IAE")
    )
    assert (drift < 0.0).all()
    assert -SIMILAR < drift.mean() < -0.01
    assert abs(iae.mean()) < 0.01
    assert (iae > 0.0).any()


def test_the_means_are_those_of_the_independent_trial(indices: Indices) -> None:
    # Another plant and other solvers of the same problem, given to two decimals.
    for controller, iae, drift in (
        ("linear", 5.35, 2.00),
        ("adaptive", 3.13, 1.52),
        ("nmpc-a", 3.13, 1.52),
        ("nmpc-b", 3.11, 1.48),
    ):
        assert indices[controller]["IAE"].mean() == pytest.approx(iae, abs=0.02)
        assert indices[controller]["release_drift"].mean() == pytest.approx(drift, abs=0.02)


def test_no_predictive_controller_ever_reaches_a_limit_or_loses_its_plan(indices: Indices) -> None:
    for name in indices.keys() - {"manual"}:
        assert indices[name]["peak_acceleration"].max() < 3.0
        assert not indices[name]["limit_violations"].any()
        assert not indices[name]["solver_failures"].any()
        assert not indices[name]["slack_time"].any()
