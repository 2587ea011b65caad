"""
A first drive
=============

One manoeuvre of the paper's Table I, driven without help and by the adaptive MPC: the record of an
episode, its indices, two plots and a film.
"""

import gymnasium as gym
import matplotlib.pyplot as plt
import numpy as np

import crane_env
from baselines import make_controller
from crane_env.rendering.film import write_film

# %%
# An environment holds the crane and its operator. Here the operator presses the buttons at the
# times of manoeuvre 1: travel forward, lift on the way, release, lower.

env = gym.make("OILCrane-v0", operator="table1:1")
trajectories = {
    name: crane_env.run_episode(env, make_controller(name), seed=0)
    for name in ("manual", "adaptive")
}

# %%
# A trajectory has one array a quantity, in SI units, one entry a control period of 20 ms. Its
# metrics sum it up.

for name, trajectory in trajectories.items():
    m = trajectory.metrics()
    degrees = np.degrees(m.max_sway)
    print(f"{name:9s} IAE {m.IAE:5.2f} m, largest sway {degrees:5.2f} degrees")

# %%
# Without help the payload swings about the reference, and goes on swinging after the release.

figure, (velocity, sway) = plt.subplots(2, sharex=True, layout="constrained")
for name, trajectory in trajectories.items():
    velocity.plot(trajectory.time, trajectory.payload_velocity, label=name)
    sway.plot(trajectory.time, np.degrees(trajectory.sway_angle))
velocity.plot(trajectory.time, trajectory.travel_reference, "k--", label="reference")
velocity.set_ylabel("payload velocity [m/s]")
figure.legend(loc="outside upper center", ncols=3)
sway.set_ylabel("sway angle [degrees]")
sway.set_xlabel("time [s]")
figure.show()

# %%
# A film takes three lines beside an environment that draws: a wrapper of Gymnasium's that keeps the
# pictures, an episode, and a file. Every fifth picture of 50 a second makes 10 a second; the ending
# ``.gif`` makes a GIF. (``pip install 'oilcrane[film]'``; the pictures need no screen.)

view = {"render_mode": "rgb_array", "render_width": 640, "render_height": 528}
env = gym.make("OILCrane-v0", operator="table1:1", **view)
film = gym.wrappers.RenderCollection(env)
crane_env.run_episode(film, make_controller("adaptive"), seed=0, max_steps=400)
write_film("first_drive.mp4", film.render()[::5], rate=10)
