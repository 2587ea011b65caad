"""Predictive controllers: eq. (6) of the paper in its linear, nonlinear and tabulated forms."""
