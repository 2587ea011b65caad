"""Claims: each check finds what it should, on evidence made up for it and against it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from baselines.evaluation.episode_spec import Setup
from baselines.mpc.settings import MpcSettings
from baselines.paper.claims import CLAIMS, Claim
from baselines.paper.evidence import Evidence, Tracking, tracking, turning_points
from tests.paper.paper_evidence import COUNT, agreeing_evidence, scaled

AGREEING = agreeing_evidence()
BY_NAME = {claim.name: claim for claim in CLAIMS}
ONE_OF_TEN = [1.0] * (COUNT - 1)


def with_times(**factors: float) -> Evidence:
    timed = {
        name: {
            index: factors.get(name.replace("-", "_"), 1.0) * value for index, value in own.items()
        }
        for name, own in AGREEING.timed.items()
    }
    return dataclasses.replace(AGREEING, timed=timed)


def with_steady(controller: str, factor: float) -> Evidence:
    own = {"IAE": factor * AGREEING.steady[controller]["IAE"]}
    return dataclasses.replace(AGREEING, steady={**AGREEING.steady, controller: own})


def change(controller: str, index: str, factor: float | list[float]) -> Evidence:
    return scaled(AGREEING, controller, index, factor)


AGAINST: dict[str, list[Evidence]] = {
    "linear-oscillates": [
        change("linear", "hoisted_swing", 0.0),
        change("adaptive", "hoisted_swing", 5.1),  # so does the other
    ],
    "linear-cannot-cope": [
        change("linear", "short_cable_error", 0.19),
        # Ten times an error that nobody notices is none either.
        scaled(change("linear", "short_cable_error", 0.09), "adaptive", "short_cable_error", 0.09),
    ],
    "adaptive-equals-nmpc-a": [
        change("nmpc-a", "IAE", [1.005, *ONE_OF_TEN]),
        change("nmpc-a", "release_drift", [0.99, *ONE_OF_TEN]),
    ],
    "sway-is-small": [change("nmpc-b", "max_sway", [0.25 / 0.08, *ONE_OF_TEN])],
    "assumption-b-needs-nmpc": [
        scaled(change("ltv", "IAE", 2.95 / 3.2), "ltv", "release_drift", 1.47 / 1.6)
    ],
    "horizon-is-1-s": [dataclasses.replace(AGREEING, setup=Setup())],
    "acceleration-limit": [
        change("linear", "peak_acceleration", [2.0001, *ONE_OF_TEN]),
        dataclasses.replace(
            AGREEING,
            setup=Setup(
                settings=MpcSettings(prediction_horizon=50, acceleration_limits=(-2.0, 5.0))
            ),
        ),
    ],
    "linear-worst-iae": [change("linear", "IAE", [0.7, *ONE_OF_TEN])],
    "linear-worst-drift": [change("linear", "release_drift", [0.7, 0.7, *ONE_OF_TEN[1:]])],
    "nmpc-b-reduces-iae": [
        change("nmpc-b", "IAE", 1.02),
        change("nmpc-b", "IAE", [1.02, 1.02, *ONE_OF_TEN[1:]]),  # on average only
    ],
    "nmpc-b-reduces-drift": [change("nmpc-b", "release_drift", 1.03)],
    "similar-iae": [change("nmpc-b", "IAE", [0.96, *ONE_OF_TEN])],
    "similar-drift": [change("adaptive", "release_drift", [1.04, *ONE_OF_TEN])],
    "nmpc-takes-longer": [with_times(nmpc_a=0.05), with_times(adaptive=20.0)],
    "table-suffices": [change("tabulated", "IAE", [1.01, *ONE_OF_TEN])],
    "linear-degrades": [
        with_steady("linear", 1.25),
        with_steady("adaptive", 0.8),  # so does the other
    ],
    "varying-mpcs-cope": [with_steady("nmpc-b", 0.85), with_steady("adaptive", 0.9)],
    "no-advantage-of-nmpc": [change("nmpc-b", "release_drift", 0.96)],
}


@pytest.mark.parametrize("claim", CLAIMS, ids=lambda claim: claim.name)
def test_a_claim_holds_on_evidence_made_up_to_agree(claim: Claim) -> None:
    finding = claim.check(AGREEING)
    assert finding.holds, finding.measured


@pytest.mark.parametrize(
    ("name", "evidence"),
    [(name, evidence) for name, against in AGAINST.items() for evidence in against],
)
def test_a_claim_fails_on_evidence_made_up_against_it(name: str, evidence: Evidence) -> None:
    finding = BY_NAME[name].check(evidence)
    assert not finding.holds, finding.measured


def test_every_claim_has_its_own_name_and_evidence_against_it() -> None:
    assert len(BY_NAME) == len(CLAIMS)
    assert AGAINST.keys() == BY_NAME.keys()


def test_an_effect_without_the_word_always_may_miss_one_manoeuvre_of_ten() -> None:
    for name, controller, index, factor in (
        ("linear-oscillates", "linear", "hoisted_swing", 0.0),
        ("linear-worst-drift", "linear", "release_drift", 0.5),
        ("nmpc-b-reduces-iae", "nmpc-b", "IAE", 1.05),
    ):
        finding = BY_NAME[name].check(change(controller, index, [factor, *ONE_OF_TEN]))
        assert finding.holds
        assert (finding.numbers["met"], finding.numbers["of"]) == (9, 10)


@given(
    half_periods=st.integers(1, 12),
    amplitude=st.floats(0.006, 10.0),
    offset=st.floats(-5.0, 5.0),
    noise=st.floats(0.0, 0.4),
    seed=st.integers(0, 1000),
)
def test_a_sine_turns_once_in_each_half_period_whatever_its_offset_and_noise(
    half_periods: int, amplitude: float, offset: float, noise: float, seed: int
) -> None:
    phase = np.linspace(0.0, half_periods * np.pi, 100 * half_periods)
    rough = np.random.default_rng(seed).uniform(-1.0, 1.0, phase.size)
    signal = offset + amplitude * (np.sin(phase) + noise * rough)
    # Noise alone goes up and down by 0.8 amplitudes at most; the first and last quarter of the sine
    # go by one, and noise only adds to their range.
    turns = turning_points(signal, 0.85 * amplitude)
    assert len(turns) == half_periods
    levels = offset + amplitude * np.resize([1.0, -1.0], half_periods)
    assert np.abs(turns - levels).max() <= (noise + 1e-3) * amplitude
    assert turning_points(-signal, 0.85 * amplitude) == [-turn for turn in turns]


def tracked(error: np.ndarray, short: np.ndarray, travelling: np.ndarray) -> Tracking:
    reference = np.where(travelling, -1.0, 0.0)
    return tracking(np.where(short, 4.0, 8.0), reference, reference + error, 0.02)


@pytest.mark.parametrize(
    ("error", "swing"),
    [
        (lambda t: 0.05 * np.sin(np.pi * t), 0.1),
        (lambda t: 0.05 * np.sin(np.pi * t) - 0.03, 0.1),
        (lambda t: 0.05 * np.sin(np.pi * t) - 0.06, 0.0),  # a ripple on one side
        (lambda t: -0.2 * np.exp(4.0 - t), 0.0),  # a lag that dies away
        (lambda t: 0.0049 * np.sin(9.0 * t), 0.0),  # too small to count
        (lambda t: np.where(t < 6.0, t - 5.0, 7.0 - t), 0.0),  # one overshoot
        (lambda t: 0.0 * t, 0.0),
    ],
)
def test_a_swing_goes_from_one_side_of_the_reference_to_the_other(
    error: Callable[[np.ndarray], np.ndarray], swing: float
) -> None:
    time = np.arange(0.0, 12.0, 0.02)
    short, travelling = time >= 4.0, time < 10.0
    # What happens on the long cable or without a travel button must not matter.
    wild = np.where(short & travelling, error(time), 7.0 * np.sin(9.0 * time))
    found = tracked(wild, short, travelling)
    assert found.hoisted_swing == pytest.approx(swing, abs=1e-3)
    assert found.short_cable_error == pytest.approx(
        np.sqrt(np.mean(error(time[short & travelling]) ** 2))
    )


def test_without_travel_on_the_short_cable_there_is_nothing_to_measure() -> None:
    time = np.arange(0.0, 2.0, 0.02)
    found = tracked(0.5 + 0.0 * time, time >= 1.0, time < 1.0)
    assert np.isnan(found[:2]).all()
    assert found.error_after_release == pytest.approx(0.5)
