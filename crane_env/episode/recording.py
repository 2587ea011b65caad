"""Recording of an episode: the file of its trajectory, played again with any controller."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium

from crane_env.controller import Controller
from crane_env.episode.play import run_episode
from crane_env.episode.trajectory import Trajectory
from crane_env.operators.recording import ENVIRONMENT


def replay(
    path: str | Path, controller: Controller, *, controller_name: str | None = None
) -> Trajectory:
    """Plays a recorded episode again, with all that it was made with.

    With the controller that drove it, the trajectory is the recorded one bit for bit, as long as no
    wrapper stood between the two and, with imperfections, its reset was seeded; with another it is
    that one's.

    Args:
        path: what `Trajectory.to_parquet` wrote.
        controller: anything with `reset` and `act`.
        controller_name: what the controller is called in the record; None: its class.

    Raises:
        ImportError: pyarrow is missing; the message names the extra.
        FileNotFoundError: there is no such file.
        ValueError: the file is no whole recording of this version, or no controller is given.
    """
    recorded = Trajectory.from_parquet(path)
    env = gymnasium.make(ENVIRONMENT, **arguments_of(path, recorded))
    return run_episode(env, controller, seed=recorded.origin.seed, controller_name=controller_name)


def arguments_of(path: str | Path, recorded: Trajectory) -> dict[str, Any]:
    """What `gymnasium.make` is to make the environment of a recorded episode with.

    Args:
        path: of the file.
        recorded: what is in it.
    """
    return {
        "operator": f"recording:{path}",
        "parameters": recorded.parameters,
        "cost": recorded.origin.cost,
        "task": recorded.task,
        "imperfections": recorded.origin.imperfections,
        "max_episode_steps": len(recorded),
    }
