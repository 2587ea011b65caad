"""Scorecard: which controller survives which imperfection, and how severe a one."""
