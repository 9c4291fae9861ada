"""Tests of bloom: laws that any blur or bloom can be held against, and frames against references.

The laws need no reference picture; they work on any callable that takes an image and returns one.
`FrameRegression` is what the pytest fixture `frame_regression` gives.
"""

from __future__ import annotations

from vkbloom.testing.frame_files import read_frame
from vkbloom.testing.laws import (
    assert_additive,
    assert_bounded_fireflies,
    assert_gain,
    assert_no_ringing,
    assert_superposition,
    assert_symmetric,
)
from vkbloom.testing.point_spread import (
    Response,
    assert_centroid_kept,
    assert_separable,
    assert_spread,
    point_spread,
    response,
)
from vkbloom.testing.probe import Probe
from vkbloom.testing.regression import FrameDifferenceWarning, FrameRegression
from vkbloom.views.tolerances import Tolerances

__all__ = [
    "FrameDifferenceWarning",
    "FrameRegression",
    "Probe",
    "Response",
    "Tolerances",
    "assert_additive",
    "assert_bounded_fireflies",
    "assert_centroid_kept",
    "assert_gain",
    "assert_no_ringing",
    "assert_separable",
    "assert_spread",
    "assert_superposition",
    "assert_symmetric",
    "point_spread",
    "read_frame",
    "response",
]
