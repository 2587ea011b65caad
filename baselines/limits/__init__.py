"""Limits: how small the IAE of any policy can be, and what knowing the buttons ahead is worth."""
