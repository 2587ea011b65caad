"""Everything that drives the crane of `crane_env`: `make_controller` builds one by its name."""

from __future__ import annotations

from baselines.registry import CONTROLLERS, make_controller, presets, settings_type

__all__ = ["CONTROLLERS", "make_controller", "presets", "settings_type"]
