"""The settings and formats with which all paths through the core are tested."""

from __future__ import annotations

from vkbloom._doctor.cases import DTYPES, HARD_THRESHOLD, METHODS, presets_of_low_levels

__all__ = ["DTYPES", "HARD_THRESHOLD", "METHODS", "presets_of_low_levels"]
