"""Evaluation: many episodes played side by side, kept, compared, tabulated and drawn."""
