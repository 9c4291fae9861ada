"""Tests of bloom: laws that every blur or bloom should obey, and comparisons with references.

The laws need no reference picture. They take any callable that maps an image to an image. What
measures one raises AssertionError if a law does not hold or a result is not finite, and TypeError
or ValueError if the callable returns something else, an argument is out of range, or light reaches
the border of an image that is too small.
`FrameRegression` is the type of the pytest fixture `frame_regression`.
"""

from __future__ import annotations

from vkbloom._views.diagnosis import Diagnosis, diagnose
from vkbloom._views.tolerances import Tolerances
from vkbloom.testing._frame_files import read_frame
from vkbloom.testing._law_report import LawReport, LawRow, report
from vkbloom.testing._laws import (
    assert_additive,
    assert_bounded_fireflies,
    assert_gain,
    assert_no_ringing,
    assert_superposition,
    assert_symmetric,
)
from vkbloom.testing._moving_light import Stability, assert_stable, stability
from vkbloom.testing._point_spread import (
    Response,
    assert_centroid_kept,
    assert_separable,
    assert_spread,
    point_spread,
    response,
)
from vkbloom.testing._probe import Probe
from vkbloom.testing._programs import command
from vkbloom.testing._regression import FrameDifferenceWarning, FrameRegression
from vkbloom.testing._scaled_scene import (
    ResolutionResponse,
    assert_resolution_independent,
    resolution_response,
)
from vkbloom.testing._veiling_glare import veiling_glare_index

__all__ = [
    "Diagnosis",
    "FrameDifferenceWarning",
    "FrameRegression",
    "LawReport",
    "LawRow",
    "Probe",
    "ResolutionResponse",
    "Response",
    "Stability",
    "Tolerances",
    "assert_additive",
    "assert_bounded_fireflies",
    "assert_centroid_kept",
    "assert_gain",
    "assert_no_ringing",
    "assert_resolution_independent",
    "assert_separable",
    "assert_spread",
    "assert_stable",
    "assert_superposition",
    "assert_symmetric",
    "command",
    "diagnose",
    "point_spread",
    "read_frame",
    "report",
    "resolution_response",
    "response",
    "stability",
    "veiling_glare_index",
]
