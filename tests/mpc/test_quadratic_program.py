"""Quadratic program: optimality by the KKT conditions, and failures that come back as data."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from baselines.mpc.quadratic_program import OPTIMAL, QuadraticProgram

TRIANGLE = np.tril(np.ones((4, 4)))


def definite(rng: np.random.Generator, size: int) -> np.ndarray:
    factor = rng.normal(size=(size, size))
    return factor @ factor.T + 0.1 * np.eye(size)


@given(size=st.integers(1, 12), rows=st.integers(1, 12), seed=st.integers(0, 2**32 - 1))
@settings(max_examples=300, deadline=None)
def test_the_solution_satisfies_the_kkt_conditions(size: int, rows: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    matrix, hessian = rng.normal(size=(rows, size)), definite(rng, size)
    gradient = 5.0 * rng.normal(size=size)
    everything = np.vstack([np.eye(size), matrix])
    inside = everything @ rng.normal(size=size)
    lower = inside - rng.exponential(size=size + rows)
    upper = inside + rng.exponential(size=size + rows)

    found = QuadraticProgram(matrix).solve(hessian, gradient, lower, upper)

    assert found.exit_flag == OPTIMAL
    assert found.minimiser is not None
    reached, dual = everything @ found.minimiser, found.multipliers
    scale = 1.0 + np.abs(hessian).max() + np.abs(gradient).max() + np.abs(dual).max()
    stationarity = hessian @ found.minimiser + gradient + everything.T @ dual
    np.testing.assert_allclose(stationarity, 0.0, atol=1e-9 * scale)
    assert np.all(reached >= lower - 1e-8)
    assert np.all(reached <= upper + 1e-8)
    np.testing.assert_allclose(reached[dual > 0.0], upper[dual > 0.0], atol=1e-8)
    np.testing.assert_allclose(reached[dual < 0.0], lower[dual < 0.0], atol=1e-8)


def test_a_strided_hessian_is_read_as_the_matrix_it_is() -> None:
    rng = np.random.default_rng(1)
    wide = np.zeros((4, 9))
    wide[:, ::2][:, :4] = definite(rng, 4)
    view = wide[:, ::2][:, :4]
    assert not view.flags.c_contiguous
    program, gradient, limit = QuadraticProgram(TRIANGLE), rng.normal(size=4), np.full(8, 0.3)
    np.testing.assert_array_equal(
        program.solve(view, gradient, -limit, limit).minimiser,
        program.solve(view.copy(), gradient, -limit, limit).minimiser,
    )


def test_an_answer_depends_on_the_question_alone() -> None:
    rng = np.random.default_rng(2)
    program, limit = QuadraticProgram(TRIANGLE), np.full(8, 0.5)
    questions = [(definite(rng, 4), 3.0 * rng.normal(size=4)) for _ in range(20)]
    first = [program.solve(*question, -limit, limit).minimiser for question in questions]
    again = [program.solve(*question, -limit, limit).minimiser for question in questions[::-1]]
    np.testing.assert_array_equal(first, again[::-1])


@pytest.mark.parametrize(
    ("hessian", "gradient", "lower"),
    [
        (np.eye(4), np.ones(4), np.full(8, 2.0)),
        (-np.eye(4), np.ones(4), np.full(8, -1.0)),
        (np.eye(4), np.full(4, np.nan), np.full(8, -1.0)),
        (np.full((4, 4), np.nan), np.ones(4), np.full(8, -1.0)),
        (np.eye(4), np.full(4, np.inf), np.full(8, -1.0)),
    ],
    ids=["infeasible", "not convex", "poisoned gradient", "poisoned hessian", "overflow"],
)
def test_a_failure_is_data(hessian: np.ndarray, gradient: np.ndarray, lower: np.ndarray) -> None:
    program = QuadraticProgram(TRIANGLE)
    assert program.solve(hessian, gradient, lower, np.ones(8)).minimiser is None
    usable = program.solve(np.eye(4), np.ones(4), -np.ones(8), np.ones(8))
    assert usable.minimiser is not None


def test_without_daqp_the_error_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "daqp", None)
    with pytest.raises(ImportError, match=r"'daqp'.*oilcrane\[mpc\]"):
        QuadraticProgram(TRIANGLE)
