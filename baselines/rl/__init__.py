"""Reinforcement learning: training environments, learners, and their policies as controllers."""
