"""Operator-in-the-loop overhead crane: MuJoCo plant, random operators, Gymnasium environment.

Importing this package registers `OILCrane-v0` and `OILCraneTask-v0` with Gymnasium.
"""

from __future__ import annotations

import importlib.metadata

import gymnasium

from crane_env.controller import Controller
from crane_env.episode.data_card import write_data_card
from crane_env.episode.metrics import Metrics
from crane_env.episode.play import run_episode, run_episodes
from crane_env.episode.practice import practise
from crane_env.episode.recording import replay
from crane_env.episode.trajectory import Trajectory
from crane_env.imperfections.registry import make_imperfections
from crane_env.observation import CraneState, Observation
from crane_env.operators.base import ButtonEvent, Buttons, Operator
from crane_env.operators.manoeuvre import RandomManoeuvre
from crane_env.operators.person.person import Person
from crane_env.operators.registry import make_operator
from crane_env.operators.script import ButtonScript, read_script, write_script
from crane_env.operators.semi_markov import ButtonHabits, RandomButtons
from crane_env.operators.table1 import Table1Manoeuvre
from crane_env.parameters import CraneParameters
from crane_env.stage_cost import StageCost
from crane_env.tasks.registry import make_task
from crane_env.tasks.task import Goal, Obstacle, Task

EPISODE_STEPS = 1250
"""Control steps of one episode: 25 s at 20 ms; the last event of Table I is at 17.75 s."""

TASK_STEPS = 6000
"""Control steps in which a task is to be done: 120 s."""

gymnasium.register(
    id="OILCrane-v0",
    entry_point="crane_env.environment.single:OILCraneEnv",
    vector_entry_point="crane_env.environment.vector:OILCraneVectorEnv",
    max_episode_steps=EPISODE_STEPS,
    # The checker repeats on every step what the tests prove once; it costs as much as the physics.
    disable_env_checker=True,
)
gymnasium.register(
    id="OILCraneTask-v0",
    entry_point="crane_env.environment.single:OILCraneEnv",
    vector_entry_point="crane_env.environment.vector:OILCraneVectorEnv",
    max_episode_steps=TASK_STEPS,
    disable_env_checker=True,
    kwargs={"task": "position", "operator": "person:trained"},
)

__all__ = [
    "ButtonEvent",
    "ButtonHabits",
    "ButtonScript",
    "Buttons",
    "Controller",
    "CraneParameters",
    "CraneState",
    "Goal",
    "Metrics",
    "Observation",
    "Obstacle",
    "Operator",
    "Person",
    "RandomButtons",
    "RandomManoeuvre",
    "StageCost",
    "Table1Manoeuvre",
    "Task",
    "Trajectory",
    "make_imperfections",
    "make_operator",
    "make_task",
    "practise",
    "read_script",
    "replay",
    "run_episode",
    "run_episodes",
    "write_data_card",
    "write_script",
]


def __getattr__(name: str) -> str:
    """`__version__`, of the installed distribution; looked up only when it is asked for."""
    if name == "__version__":
        return importlib.metadata.version("oilcrane")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
