"""Estimation: what the crane does, from noisy and late measurements."""
