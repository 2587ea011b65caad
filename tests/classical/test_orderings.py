"""Orderings of controllers on unseen manoeuvres that the documentation leans on."""

from __future__ import annotations

import gymnasium
import numpy as np

import crane_env
from baselines import make_controller

SEEDS = (0, 1)


def test_methods_stand_in_the_order_that_is_published() -> None:
    env = gymnasium.make("OILCrane-v0", operator="manoeuvre")

    def played(name: str) -> list[crane_env.Metrics]:
        controller = make_controller(name)
        return [crane_env.run_episode(env, controller, seed=seed).metrics() for seed in SEEDS]

    means = {
        (name, index): np.mean([getattr(metrics, index) for metrics in found])
        for name in ("adaptive", "l1", "l1@robust", "recommended", "shaper-zv")
        for found in (played(name),)
        for index in ("IAE", "release_drift", "max_sway", "rms_acceleration")
    }

    def worse(index: str, *names: str) -> bool:
        values = [means[name, index] for name in names]
        return all(np.diff(values) < 0.0)

    frozen = np.mean([metrics.IAE for metrics in played("shaper-zv-frozen")])
    assert frozen > 1.3 * means["shaper-zv", "IAE"]
    assert worse("IAE", "adaptive", "l1@robust", "recommended", "l1")
    assert worse("release_drift", "adaptive", "l1@robust", "recommended", "l1")
    # At the sway and the effort of `adaptive` a seventh is to be had, not a third.
    assert means["l1@robust", "IAE"] > 0.8 * means["adaptive", "IAE"]
    for index in ("max_sway", "rms_acceleration"):
        assert means["l1@robust", index] < 1.1 * means["adaptive", index]
