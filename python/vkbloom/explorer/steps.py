"""The steps of sliders."""

from __future__ import annotations

from typing import Final

__all__ = ["slider_step"]

_STEPS: Final = 200


def slider_step(start: float, end: float) -> float:
    """Return the largest step of 1, 2 or 5 times a power of ten that gives at least 200 steps."""
    step = (end - start) / _STEPS
    for power in range(3, -9, -1):
        for digit in (5, 2, 1):
            # Parsed from text, since a product may not be the nearest float.
            if (round_one := float(f"{digit}e{power}")) <= step * (1 + 1e-9):
                return round_one
    raise ValueError(f"step: {step!r} is too small")
