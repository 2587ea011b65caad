"""Tabulated MPC: convergence to what is tabulated, convexity, documented errors, closed loop."""

from __future__ import annotations

import math
import re
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import crane_env
from baselines.commands.table_memory import (
    LENGTH_GRIDS,
    LENGTH_RATE_GRIDS,
    PAGE,
    Measurement,
    measure_length_grids,
    measure_length_rate_grids,
)
from baselines.mpc.cost_table import (
    INTERPOLATIONS,
    NODES_MIN,
    SWAY,
    Axis,
    first_move_errors,
    measured,
    square_root,
)
from baselines.mpc.linear import (
    CostModel,
    adaptive,
    adaptive_cost,
    ltv,
    time_varying_cost,
)
from baselines.mpc.settings import MpcSettings
from baselines.mpc.tabulated import (
    AdaptiveTable,
    LengthGrid,
    LengthRateGrid,
    TimeVaryingTable,
    tabulated,
    tabulated_ltv,
)
from crane_env.controller import Controller
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters
from tests.mpc.prediction.linear_crane import act, random_observation

CRANE = CraneParameters()
PAPER = MpcSettings()
SMALL = {
    "tabulated": AdaptiveTable(CRANE, PAPER, LengthGrid(lengths=9)),
    "tabulated-ltv": TimeVaryingTable(
        CRANE, PAPER, LengthRateGrid(lengths=9, stops=5, rates=4, interpolation="linear")
    ),
}


def observe(length: float, rate: float = 0.0) -> Observation:
    return Observation(0.0, 0.4, length, rate, 0.1, -0.2, 1.0, 0.0)


@given(
    position=st.floats(0.0, 11.0),
    name=st.sampled_from(list(INTERPOLATIONS)),
    nodes=st.integers(NODES_MIN, 12),
)
def test_interpolation_reproduces_polynomials_of_its_degree(
    position: float, name: str, nodes: int
) -> None:
    position = min(position, nodes - 1.0)
    degree = {"nearest": 0, "linear": 1, "cubic": 3}[name]
    first, weights = INTERPOLATIONS[name](position, nodes)
    points = np.arange(first, first + len(weights))
    assert points[0] >= 0
    assert points[-1] < nodes
    assert len(points) == degree + 1
    for power in range(degree + 1):
        assert weights @ points**power == pytest.approx(position**power, abs=1e-9)


@pytest.mark.parametrize("term", ["displacement", "angle", "printed"])
@pytest.mark.parametrize("tail", ["hold", "zero"])
def test_at_its_nodes_a_table_has_the_cost_itself(tail: str, term: str) -> None:
    problem = MpcSettings(tail=tail, cost={"sway_term": term}, control_horizon=7)
    exact = time_varying_cost(CRANE, problem)
    tables: list[CostModel] = [
        AdaptiveTable(CRANE, problem, LengthGrid(lengths=7)),
        TimeVaryingTable(CRANE, problem, LengthRateGrid(lengths=7, stops=5, rates=6)),
    ]
    lengths = np.geomspace(1.0, 12.0, 7)
    cables = [(0, length, 0.0) for length in lengths]
    # Rates come in steps of 0.25 m/s, stops in steps of 0.5 s; the horizon is 2 s.
    cables += [(1, lengths[3] + 2.0 * 0.5, -0.5), (1, lengths[3], 0.75)]
    cables += [(1, 1.0 + 0.5 * 1.5, -0.5), (1, 12.0 - 1.0 * 0.5, 1.0), (1, 12.0, 1.25)]
    for which, length, rate in cables:
        start = observe(length, rate)
        for looked_up, computed in zip(tables[which].cost(start), exact.cost(start), strict=True):
            np.testing.assert_allclose(looked_up, computed, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(("interpolation", "order"), [("nearest", 1), ("linear", 2), ("cubic", 4)])
def test_tabulated_converges_to_adaptive_with_the_order_of_its_interpolation(
    interpolation: str, order: int
) -> None:
    cables = [(float(length), 0.0) for length in np.geomspace(1.0, 12.0, 200)]
    errors = []
    for lengths in (33, 65, 129):
        grid = LengthGrid(lengths=lengths, interpolation=interpolation)
        table = AdaptiveTable(CRANE, PAPER, grid)
        error = first_move_errors(table, adaptive_cost(CRANE, PAPER), cables, CRANE)
        errors.append(np.sqrt(np.mean(error**2)))
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), order, atol=0.2)


@pytest.mark.parametrize(("interpolation", "order"), [("linear", 2), ("cubic", 4)])
def test_tabulated_ltv_converges_to_ltv_where_the_hoist_runs_on(
    interpolation: str, order: int
) -> None:
    lengths_between = np.linspace(3.5, 9.5, 9).tolist()
    cables = [(x, rate) for x in lengths_between for rate in (-0.93, -0.31, 0.55, 1.12)]
    errors = []
    for lengths, rates in ((13, 5), (25, 9), (49, 17)):
        grid = LengthRateGrid(
            lengths=lengths, stops=NODES_MIN, rates=rates, interpolation=interpolation
        )
        table = TimeVaryingTable(CRANE, PAPER, grid)
        error = first_move_errors(table, time_varying_cost(CRANE, PAPER), cables, CRANE)
        errors.append(np.sqrt(np.mean(error**2)))
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), order, atol=0.5)


def test_the_default_tables_are_small_and_good() -> None:
    table = AdaptiveTable(CRANE, PAPER, LengthGrid())
    cables = [(float(length), 0.0) for length in np.geomspace(1.0, 12.0, 300)]
    assert first_move_errors(table, adaptive_cost(CRANE, PAPER), cables, CRANE).max() < 1e-4
    # 55 entries of S and 4 gradients of 10, 8 bytes each.
    assert table.memory == 48 * (55 + 40) * 8
    tables = TimeVaryingTable(CRANE, PAPER, LengthRateGrid())
    assert tables.memory == 2 * (32 + 17) * 7 * (55 + 40) * 8


def test_the_stated_error_is_the_worst_in_the_box_of_states() -> None:
    model, length = SMALL["tabulated"], 1.37
    (stated,) = first_move_errors(model, adaptive_cost(CRANE, PAPER), [(length, 0.0)], CRANE)
    limits = np.array([1.0, SWAY, SWAY * math.sqrt(CRANE.gravity / length), 1.0])

    def first_move(cost: CostModel, state: np.ndarray) -> float:
        velocity, sway, sway_rate, reference = state
        start = Observation(0.0, velocity, length, 0.0, sway, sway_rate, reference, 0.0)
        hessian, gradient = cost.cost(start)
        assert measured(start) == tuple(state)
        return float(np.linalg.solve(hessian, -gradient)[0])

    corners = [limits * np.array(signs) for signs in np.ndindex(2, 2, 2, 2)]
    corners = [2.0 * corner - limits for corner in corners]
    inside = np.random.default_rng(1).uniform(-limits, limits, (50, 4))
    errors = [
        abs(first_move(model, state) - first_move(adaptive_cost(CRANE, PAPER), state))
        for state in (*corners, *inside)
    ]
    assert max(errors) == pytest.approx(stated, rel=1e-9)


@given(
    length=st.floats(0.0, 14.0),
    rate=st.floats(-3.0, 3.0),
    interpolation=st.sampled_from(list(INTERPOLATIONS)),
    weight=st.sampled_from([1e-6, 0.2]),
)
@settings(max_examples=60, deadline=None)
def test_the_hessian_is_symmetric_and_at_least_lambda_u_however_coarse_the_table(
    length: float, rate: float, interpolation: str, weight: float
) -> None:
    for table in coarse_tables(interpolation, weight):
        hessian, _ = table.cost(observe(length, rate))
        np.testing.assert_array_equal(hessian, hessian.T)
        assert np.linalg.eigvalsh(hessian).min() > weight - 1e-10 * np.abs(hessian).max()


def coarse_tables(interpolation: str, weight: float) -> tuple[CostModel, CostModel]:
    if (interpolation, weight) not in COARSE:
        problem = MpcSettings(cost={"acceleration_weight": weight})
        COARSE[interpolation, weight] = (
            AdaptiveTable(CRANE, problem, LengthGrid(lengths=4, interpolation=interpolation)),
            TimeVaryingTable(
                CRANE,
                problem,
                LengthRateGrid(lengths=4, stops=4, rates=4, interpolation=interpolation),
            ),
        )
    return COARSE[interpolation, weight]


COARSE: dict[tuple[str, float], tuple[CostModel, CostModel]] = {}


def test_a_square_root_squares_to_the_matrix_also_to_a_singular_one() -> None:
    factor = np.random.default_rng(1).normal(size=(6, 3))
    root = square_root(factor @ factor.T)
    np.testing.assert_allclose(root @ root, factor @ factor.T, rtol=0.0, atol=1e-12)


def test_beyond_the_hoists_limits_the_tables_hold_the_cost_at_the_limit() -> None:
    for model in SMALL.values():
        for beyond, limit in ((0.6, 1.0), (0.0, 1.0), (-1.0, 1.0), (12.4, 12.0), (24.0, 12.0)):
            for a, b in zip(model.cost(observe(beyond)), model.cost(observe(limit)), strict=True):
                np.testing.assert_array_equal(a, b)


def test_cables_faster_than_the_tables_count_as_the_fastest() -> None:
    table = SMALL["tabulated-ltv"]
    # Lowering, the shortest length over the horizon is the one now; hoisting, the one at its end.
    for fast, fastest, length_fast, length_fastest in (
        (2.0, 1.25, 6.0, 6.0),
        (-2.0, -1.25, 3.0 + 4.0, 3.0 + 2.5),
    ):
        costs = table.cost(observe(length_fast, fast)), table.cost(observe(length_fastest, fastest))
        for a, b in zip(*costs, strict=True):
            np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("periods", [1, 100])
@pytest.mark.parametrize(
    "crane", [CraneParameters.field(), CraneParameters(cable_length_min=3.0)], ids=["field", "tall"]
)
def test_other_cranes_and_horizons_have_tables_of_their_own(
    crane: CraneParameters, periods: int
) -> None:
    problem = MpcSettings(prediction_horizon=periods, control_horizon=min(periods, 3))
    rng = np.random.default_rng(6)
    for table, exact in ((tabulated, adaptive), (tabulated_ltv, ltv)):
        looked_up, computed = table(crane, problem), exact(crane, problem)
        for _ in range(20):
            start = random_observation(rng)._replace(
                cable_length=rng.uniform(crane.cable_length_min, crane.cable_length_max),
                cable_rate=rng.uniform(-1.0, 1.0) * crane.hoist_speed,
            )
            assert act(looked_up, start) == pytest.approx(act(computed, start), abs=0.02)


def test_tables_that_cannot_be_are_refused() -> None:
    with pytest.raises(ValueError, match="nodes of an axis must be a whole number of at least 4"):
        AdaptiveTable(CRANE, PAPER, LengthGrid(lengths=3))
    with pytest.raises(ValueError, match="Unknown interpolation 'quintic'; valid: nearest, linear"):
        AdaptiveTable(CRANE, PAPER, LengthGrid(interpolation="quintic"))
    with pytest.raises(ValueError, match=r"must run upwards, not from 1.0 to 1.0"):
        Axis(1.0, 1.0, 5)


def documented(name: str) -> list[list[str]]:
    """Rows of a table of the page, without its heads."""
    page = Path(PAGE).read_text(encoding="utf-8")
    found = re.search(f"<!-- {name} -->(.*)<!-- end of {name} -->", page, re.DOTALL)
    assert found
    lines = found.group(1).strip().splitlines()[2:]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


@pytest.mark.parametrize("name", ["tabulated", "tabulated-ltv"])
def test_the_documented_errors_are_those_of_the_code(name: str) -> None:
    measurements: list[Measurement] = (
        measure_length_grids(LENGTH_GRIDS[::5])
        if name == "tabulated"
        else measure_length_rate_grids(LENGTH_RATE_GRIDS[::4])
    )
    rows = documented(name)[:: 5 if name == "tabulated" else 4]
    for row, measurement in zip(rows, measurements, strict=True):
        errors = [
            error
            for pair in zip(measurement.worst, measurement.median, strict=True)
            for error in pair
        ]
        numbers = [float(cell) for cell in row[-len(errors) - 1 :]]
        assert row[0] == measurement.grid.interpolation
        assert int(row[1]) == measurement.grid.lengths
        assert numbers[0] == round(measurement.memory / 1000)
        # Two digits are written; the last may fall otherwise on another machine.
        assert numbers[1:] == pytest.approx(errors, rel=0.06)


def iae(controller: Controller, operator: str, length: float) -> float:
    env = gymnasium.make("OILCrane-v0", operator=operator)
    options = {"cable_length": length}
    trajectory = crane_env.run_episode(env, controller, seed=1, options=options)
    assert trajectory.solver_failures == 0
    return trajectory.metrics().IAE


def test_on_table_1_tables_follow_the_operator_as_well_as_predictions() -> None:
    pairs = [
        (tabulated(CRANE, PAPER), adaptive(CRANE, PAPER)),
        (tabulated_ltv(CRANE, PAPER), ltv(CRANE, PAPER)),
    ]
    for manoeuvre in (1, 5):
        for table, exact in pairs:
            looked_up, computed = (iae(c, f"table1:{manoeuvre}", 8.0) for c in (table, exact))
            assert looked_up == pytest.approx(computed, rel=1e-3)
