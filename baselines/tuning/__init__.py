"""Tuning: settings of the controllers, searched with the same budget for each."""
