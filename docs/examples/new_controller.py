"""
A new controller, compared
==========================

A controller is anything with ``reset`` and ``act``. This one is a state feedback; it is
compared with the crane without help and with the adaptive MPC, on the ten manoeuvres of Table I and
on ten random operators.
"""

import gymnasium as gym
import matplotlib.pyplot as plt
import numpy as np

import crane_env
from baselines import make_controller

# %%
# With small sway and a constant cable length the trolley's acceleration u moves three states:
#
# .. math:: \dot v = u, \qquad \dot\theta = q, \qquad l\,\dot q = -g \theta - u.
#
# The feedback :math:`u = k_1 (w - v) + k_2 \theta + k_3 q` gives the characteristic polynomial
#
# .. math:: p^3 + (k_1 + k_3 / l) p^2 + ((k_2 + g) / l) p + k_1 g / l.
#
# Butterworth poles at the frequency of the sway, :math:`\omega = \sqrt{g / l}`, are the zeros of
# :math:`p^3 + 2 \omega p^2 + 2 \omega^2 p + \omega^3`. Compare coefficients:
# :math:`k_1 = \omega`, :math:`k_2 = g`, :math:`k_3 = \omega l`. The measured length schedules them.


class SwayFeedback:
    """State feedback with Butterworth poles at the frequency of the sway."""

    def __init__(self, crane):
        self.crane = crane

    def reset(self):
        pass

    def act(self, observation):
        o = crane_env.Observation.of(observation)
        g, l, limit = self.crane.gravity, o.cable_length, self.crane.acceleration_max
        omega = np.sqrt(g / l)
        velocity_error = o.travel_reference - o.trolley_velocity
        u = omega * (velocity_error + l * o.sway_rate) + g * o.sway_angle
        return np.array([np.clip(u, -limit, limit)])


# %%
# Equal seeds give equal button presses, so the comparison is paired.

crane = crane_env.CraneParameters.paper()
controllers = {
    "manual": make_controller("manual"),
    "sway feedback": SwayFeedback(crane),
    "adaptive": make_controller("adaptive"),
}
IAE = {}
for family, operators in {
    "Table I": [f"table1:{number}" for number in range(1, 11)],
    "random": ["random"] * 10,
}.items():
    for name, controller in controllers.items():
        for seed, operator in enumerate(operators):
            env = gym.make("OILCrane-v0", operator=operator, parameters=crane)
            metrics = crane_env.run_episode(env, controller, seed=seed).metrics()
            IAE.setdefault((family, name), []).append(metrics.IAE)

for (family, name), values in IAE.items():
    print(f"{family:8s} {name:14s} mean IAE {np.mean(values):6.2f} m")

# %%
# One dot an episode, the bar at the mean.

figure, panels = plt.subplots(1, 2, figsize=(8, 4), layout="constrained")
for panel, family in zip(panels, ("Table I", "random")):
    for place, name in enumerate(controllers):
        values = IAE[family, name]
        panel.plot([place] * len(values), values, "o", alpha=0.5)
        panel.hlines(np.mean(values), place - 0.25, place + 0.25, colors="black")
    panel.set_xticks(range(len(controllers)), controllers)
    panel.set_ylim(bottom=0)
    panel.set_title(family)
panels[0].set_ylabel("IAE [m]")
figure.show()

# %%
# Saved in a module as ``build(crane)``, it joins the full evaluation, tables and figures included:
# see :doc:`/own_controller`.
