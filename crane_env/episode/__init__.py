"""Episodes: played, recorded as trajectories, and measured."""
