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
from vkbloom.testing._border import assert_border, assert_views, border_energy
from vkbloom.testing._frame_files import read_frame
from vkbloom.testing._law_report import LawReport, LawRow, report
from vkbloom.testing._laws import (
    assert_additive,
    assert_bounded_fireflies,
    assert_gain,
    assert_no_ringing,
    assert_superposition,
    assert_symmetric,
    first_infected,
)
from vkbloom.testing._moving_light import Stability, assert_stable, stability
from vkbloom.testing._point_spread import (
    assert_centroid_kept,
    assert_separable,
    assert_spread,
    point_spread,
)
from vkbloom.testing._probe import Probe
from vkbloom.testing._programs import command
from vkbloom.testing._regression import FrameDifferenceWarning, FrameRegression
from vkbloom.testing._scaled_scene import (
    ResolutionResponse,
    assert_resolution_independent,
    resolution_response,
)
from vkbloom.testing._sequences import Flash, Flicker, flash, flicker
from vkbloom.testing._shape import assert_round, assert_sizes, roundness
from vkbloom.testing._time import assert_history, assert_jitter
from vkbloom.testing._transparency import assert_alpha
from vkbloom.testing._veiling_glare import veiling_glare_index

__all__ = [
    "Diagnosis",
    "Flash",
    "Flicker",
    "FrameDifferenceWarning",
    "FrameRegression",
    "LawReport",
    "LawRow",
    "Probe",
    "ResolutionResponse",
    "Stability",
    "Tolerances",
    "assert_additive",
    "assert_alpha",
    "assert_border",
    "assert_bounded_fireflies",
    "assert_centroid_kept",
    "assert_gain",
    "assert_history",
    "assert_jitter",
    "assert_no_ringing",
    "assert_resolution_independent",
    "assert_round",
    "assert_separable",
    "assert_sizes",
    "assert_spread",
    "assert_stable",
    "assert_superposition",
    "assert_symmetric",
    "assert_views",
    "border_energy",
    "command",
    "diagnose",
    "first_infected",
    "flash",
    "flicker",
    "point_spread",
    "read_frame",
    "report",
    "resolution_response",
    "roundness",
    "stability",
    "veiling_glare_index",
]
