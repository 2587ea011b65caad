"""Predictions: what the crane will do over the horizon, as the predictive controllers need it."""
