"""Tests of bloom: laws that any blur or bloom can be held against, and frames against references.

The laws need no reference picture; they work on any callable that takes an image and returns one.
`FrameRegression` is what the pytest fixture `frame_regression` gives.
"""

from __future__ import annotations

from vkbloom.testing.judging import Tolerances
from vkbloom.testing.regression import FrameDifferenceWarning, FrameRegression

__all__ = [
    "FrameDifferenceWarning",
    "FrameRegression",
    "Tolerances",
]
