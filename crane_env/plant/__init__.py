"""The simulated crane: one, or a batch, with its drives."""
