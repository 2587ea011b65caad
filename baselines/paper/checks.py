"""Claim checks: what measurements say about each statement of the paper, as pure functions.

A check takes the `Evidence` of one setup and gives a `Finding`. Where the paper says "always" or
"in all", a claim must be met in each manoeuvre; an effect without these words must be consistent,
that is, met in the share `CONSISTENT` of them. The paper's words for nearness mean, of the larger
over the smaller value:

    "almost exactly the same"     within `EQUAL`
    "very similar"                within `SIMILAR`
    "significant"                 beyond `SIMILAR`
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from baselines.paper.evidence import Evidence

EQUAL = 0.005
"""Largest difference of what is "almost exactly the same" [-]."""

SIMILAR = 0.05
"""Largest difference of what is "very similar"; an advantage beyond is "significant" [-]."""

CONSISTENT = 0.9
"""Share of manoeuvres that makes an effect consistent [-]: 9 of 10 is the least at which a sign
test rejects chance at 5 %."""

DEGRADED = 0.10
"""Increase of the IAE at which performance "strongly degrades" [-]."""

MULTIPLE = 2.0
"""What the fixed model must cost, relative to the adaptive MPC, to count as an effect [-]."""

NOTICEABLE = 0.01
"""Least error on the short cable that counts as one at all; 1 % of alpha [m/s]."""

SMALL_ANGLE_ERROR = 0.01
"""Largest relative error of sin(theta) = theta at a "small" angle [-]."""

HORIZON_SAID = 1.0
"""Duration of the prediction horizon by the text of section V [s]."""

PAPER_MPCS = ("linear", "adaptive", "nmpc-a", "nmpc-b")
"""The four controllers that the paper compares."""

VARYING_MPCS = ("adaptive", "nmpc-a", "nmpc-b")
"""Those that know the measured cable length."""


@dataclass(frozen=True)
class Finding:
    """What measurements say about a claim under one setup.

    Attributes:
        holds: whether the claim's definition is met.
        measured: the measured numbers, in a phrase.
        numbers: the same for programs; "met" and "of" count manoeuvres where the claim does.
    """

    holds: bool
    measured: str
    numbers: Mapping[str, float] = field(default_factory=dict)


def linear_oscillates(evidence: Evidence) -> Finding:
    """The linear MPC swings about the reference on the hoisted cable, the adaptive far less."""
    linear = evidence.of("linear", "hoisted_swing")
    adaptive = evidence.of("adaptive", "hoisted_swing")
    met = (linear > 0.0) & (linear >= MULTIPLE * adaptive)
    return Finding(
        consistent(met),
        f"swing of {1e3 * linear.mean():.0f} mm/s on average against "
        f"{1e3 * adaptive.mean():.0f} mm/s of adaptive; met in {share(met)}",
        {**counts(met), "linear": linear.mean(), "adaptive": adaptive.mean()},
    )


def linear_cannot_cope(evidence: Evidence) -> Finding:
    """The linear MPC's error on the short cable is noticeable, and a multiple of the adaptive's."""
    linear = evidence.of("linear", "short_cable_error")
    ratio = linear / evidence.of("adaptive", "short_cable_error")
    met = (ratio >= MULTIPLE) & (linear >= NOTICEABLE)
    return Finding(
        consistent(met),
        f"{ratio.min():.1f} to {ratio.max():.1f} times adaptive's, "
        f"{1e3 * linear.mean():.0f} mm/s on average; met in {share(met)}",
        {**counts(met), "least_ratio": ratio.min(), "largest_ratio": ratio.max()},
    )


def adaptive_equals_nmpc_a(evidence: Evidence) -> Finding:
    """Under Assumption A linear and nonlinear prediction come to the same."""
    return nearness(evidence, ("adaptive", "nmpc-a"), ("IAE", "release_drift"), EQUAL)


def sway_is_small(evidence: Evidence) -> Finding:
    """The sway angles justify the linearisation."""
    largest = float(evidence.stack(VARYING_MPCS, "max_sway").max())
    error = largest / math.sin(largest) - 1.0
    return Finding(
        error <= SMALL_ANGLE_ERROR,
        f"at most {math.degrees(largest):.1f} degrees, where sin θ = θ is {100 * error:.2f} % off",
        {"largest_sway": largest, "error": error},
    )


def assumption_b_needs_nmpc(evidence: Evidence) -> Finding:
    """No linear MPC can do under Assumption B what the nonlinear one does."""
    same = nearness(evidence, ("ltv", "nmpc-b"), ("IAE", "release_drift"), EQUAL)
    return Finding(
        not same.holds,
        f"the linear time-varying `ltv` against nmpc-b: {same.measured}",
        {**same.numbers, "met": same.numbers["of"] - same.numbers["met"]},
    )


def horizon_is_one_second(evidence: Evidence) -> Finding:
    """The prediction horizon lasts 1 s."""
    settings, crane = evidence.setup.settings, evidence.setup.crane
    horizon = settings.prediction_horizon * crane.control_period
    return Finding(
        math.isclose(horizon, HORIZON_SAID),
        f"N_p T_s = {horizon:g} s, so that Δl = ±{horizon * crane.hoist_speed:g} m",
        {"horizon": horizon},
    )


def comparable(index: str) -> Callable[[Evidence], Finding]:
    """Adaptive MPC and both NMPCs come to nearly the same index in each manoeuvre."""

    def check(evidence: Evidence) -> Finding:
        return nearness(evidence, VARYING_MPCS, (index,), SIMILAR)

    return check


def acceleration_keeps_its_limit(evidence: Evidence) -> Finding:
    """No MPC asks for more acceleration than allowed."""
    crane = evidence.setup.crane
    low, high = evidence.setup.settings.acceleration_range(crane)
    peak = float(evidence.stack(PAPER_MPCS, "peak_acceleration").max())
    limit = min(-low, high)
    activity = "the limit is never active" if peak < limit else "the limit is active"
    return Finding(
        peak <= limit, f"at most {peak:.2f} of {limit:g} m/s²: {activity}", {"peak": peak}
    )


def linear_is_worst(index: str, least_share: float) -> Callable[[Evidence], Finding]:
    """The linear MPC has the largest index of the four, in so many of the manoeuvres [-]."""

    def check(evidence: Evidence) -> Finding:
        linear = evidence.of("linear", index)
        margin = linear / evidence.stack(VARYING_MPCS, index).max(axis=0) - 1.0
        met = margin > 0.0
        return Finding(
            bool(met.mean() >= least_share),
            f"largest in {share(met)}, {signed_percent(margin.min())} to "
            f"{signed_percent(margin.max())} against the next; mean {linear.mean():.3f} m against "
            f"{means(evidence, VARYING_MPCS, index)}",
            {**counts(met), "least_margin": margin.min(), "largest_margin": margin.max()},
        )

    return check


def nmpc_b_reduces(index: str) -> Callable[[Evidence], Finding]:
    """NMPC-B's index is consistently below those of both that take the length for constant."""

    def check(evidence: Evidence) -> Finding:
        own = evidence.of("nmpc-b", index)
        others = evidence.stack(("adaptive", "nmpc-a"), index)
        met = own < others.min(axis=0)
        gain = own.mean() / others.mean(axis=1).min() - 1.0
        return Finding(
            bool(gain < 0.0) and consistent(met),
            f"mean {signed_percent(gain)}, lower in {share(met)}",
            {**counts(met), "mean_difference": gain},
        )

    return check


def linear_degrades(evidence: Evidence) -> Finding:
    """Hoisting costs the linear MPC more than the adaptive: a shorter cable is easier for all."""
    own, others = (hoisting_effect(evidence, name) for name in ("linear", "adaptive"))
    change = (1.0 + own) / (1.0 + others) - 1.0
    return Finding(
        change >= DEGRADED,
        f"hoisting changes the mean IAE by {signed_percent(own)}, adaptive's by "
        f"{signed_percent(others)}: {signed_percent(change)} beside it",
        {"change": change, "linear": own, "adaptive": others},
    )


def varying_mpcs_cope(evidence: Evidence) -> Finding:
    """Hoisting does not make adaptive MPC and NMPC worse than without."""
    changes = {name: hoisting_effect(evidence, name) for name in ("adaptive", "nmpc-b")}
    words = [f"{name} {signed_percent(change)}" for name, change in changes.items()]
    return Finding(
        max(changes.values()) < DEGRADED,
        f"mean IAE of {', '.join(words)} against the same manoeuvres without hoisting",
        changes,
    )


def nmpc_has_no_advantage(evidence: Evidence) -> Finding:
    """The better of the NMPCs is not significantly better than the adaptive MPC."""
    gains = {
        index: float(
            evidence.stack(("nmpc-a", "nmpc-b"), index).mean(axis=1).min()
            / evidence.of("adaptive", index).mean()
            - 1.0
        )
        for index in ("IAE", "release_drift")
    }
    return Finding(
        min(gains.values()) >= -SIMILAR,
        f"the better NMPC on average: IAE {signed_percent(gains['IAE'])}, "
        f"drift {signed_percent(gains['release_drift'])}",
        gains,
    )


def table_replaces_computation(evidence: Evidence) -> Finding:
    """Prediction matrices from a table do what computed ones do."""
    return nearness(evidence, ("adaptive", "tabulated"), ("IAE", "release_drift"), EQUAL)


def nmpc_takes_longer(evidence: Evidence) -> Finding:
    """Both NMPCs compute longer than the adaptive MPC; how much longer, fast and with IPOPT."""
    median = {name: float(own["act_median"].mean()) for name, own in evidence.timed.items()}
    p99 = {name: float(own["act_p99"].mean()) for name, own in evidence.timed.items()}
    ratios = {name: median[name] / median["adaptive"] for name in median}
    period = evidence.setup.crane.control_period
    return Finding(
        ratios["nmpc-a"] > 1.0 and ratios["nmpc-b"] > 1.0,
        f"median {1e6 * median['adaptive']:.0f} µs of adaptive; "
        + ", ".join(
            f"{name} {ratios[name]:.3g} times (p99 {percent(p99[name] / period)} of T_s)"
            for name in ("nmpc-a", "nmpc-b", "nmpc-b-ipopt")
            if name in ratios
        ),
        {
            **{f"{name}_median": value for name, value in median.items()},
            **{f"{name}_p99": value for name, value in p99.items()},
        },
    )


def nearness(
    evidence: Evidence, controllers: Sequence[str], indices: Sequence[str], tolerance: float
) -> Finding:
    """Whether indices of several controllers are the same within a tolerance in each manoeuvre."""
    spreads = {}
    for index in indices:
        values = evidence.stack(controllers, index)
        spreads[index] = values.max(axis=0) / values.min(axis=0) - 1.0
    met = np.all([spread <= tolerance for spread in spreads.values()], axis=0)
    words = [
        f"{WORDS[index]} within {100 * spread.max():.2g} %" for index, spread in spreads.items()
    ]
    return Finding(
        bool(met.all()),
        f"{', '.join(words)}; within {percent(tolerance)} in {share(met)}",
        {**counts(met), **{index: float(spread.max()) for index, spread in spreads.items()}},
    )


def hoisting_effect(evidence: Evidence, controller: str) -> float:
    """Relative change of the mean IAE that hoisting brings [-]."""
    with_hoisting = evidence.of(controller, "IAE").mean()
    return float(with_hoisting / evidence.steady[controller]["IAE"].mean() - 1.0)


def consistent(met: NDArray[np.bool_]) -> bool:
    """Whether something is met in so many manoeuvres that chance is no explanation."""
    return bool(met.mean() >= CONSISTENT)


def counts(met: NDArray[np.bool_]) -> dict[str, float]:
    """In how many manoeuvres something is met, and of how many."""
    return {"met": float(np.count_nonzero(met)), "of": float(met.size)}


def share(met: NDArray[np.bool_]) -> str:
    """The same as a phrase."""
    return f"{np.count_nonzero(met)} of {met.size}"


def percent(value: float) -> str:
    """A share in percent, to one decimal if there is any."""
    return f"{100 * value:.1f}".removesuffix(".0") + " %"


def signed_percent(value: float) -> str:
    """A relative change in percent, to one decimal."""
    return f"{100 * value:+.1f} %"


def means(evidence: Evidence, controllers: Sequence[str], index: str) -> str:
    """Mean of an index for each controller."""
    return ", ".join(f"{name} {evidence.of(name, index).mean():.3f}" for name in controllers)


WORDS = {"IAE": "IAE", "release_drift": "drift"}
"""Indices as they are called in a sentence."""
