"""Operators: who presses the buttons."""
