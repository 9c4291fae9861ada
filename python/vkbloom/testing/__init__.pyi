# The public names of `vkbloom.testing`; lazy_loader reads them, and imports what is asked for.
from ._border import assert_border, assert_views
from ._judging import Diagnosis, Tolerances, diagnose
from ._law_report import LawReport, LawRow, report
from ._laws import (
    assert_additive,
    assert_bounded_fireflies,
    assert_gain,
    assert_no_ringing,
    assert_superposition,
    assert_symmetric,
)
from ._moving_light import Stability, assert_stable, stability
from ._point_spread import (
    assert_centroid_kept,
    assert_separable,
    point_spread,
    veiling_glare_index,
)
from ._probe import Probe
from ._programs import command
from ._regression import FrameRegression
from ._scaled_scene import (
    ResolutionResponse,
    assert_resolution_independent,
    resolution_response,
)
from ._sequences import Flash, Flicker, flash, flicker
from ._shape import assert_round, assert_sizes
from ._time import assert_history, assert_jitter
from ._transparency import assert_alpha

__all__ = [
    "Diagnosis",
    "Flash",
    "Flicker",
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
    "assert_stable",
    "assert_superposition",
    "assert_symmetric",
    "assert_views",
    "command",
    "diagnose",
    "flash",
    "flicker",
    "point_spread",
    "report",
    "resolution_response",
    "stability",
    "veiling_glare_index",
]
