# The public names of `vkbloom.testing`; lazy_loader reads them, and imports what is asked for.
from ._bt1702 import FlashVerdict
from ._display import Display
from ._flare.chart import FlareChart
from ._flare.figures import FlareFigure
from ._flare.report import FlareReport, flare
from ._flash_rules import FlashRules, FlashTransitions
from ._judging import Diagnosis, Tolerances, diagnose
from ._law_report import LawReport, assert_laws, report
from ._moving_light import Stability, stability
from ._point_spread import point_spread, veiling_glare_index
from ._probe import Probe
from ._programs import command
from ._regression import FrameRegression
from ._scaled_scene import ResolutionResponse, resolution_response
from ._sequences import Flash, Flicker, flash, flicker

__all__ = [
    "Diagnosis",
    "Display",
    "FlareChart",
    "FlareFigure",
    "FlareReport",
    "Flash",
    "FlashRules",
    "FlashTransitions",
    "FlashVerdict",
    "Flicker",
    "FrameRegression",
    "LawReport",
    "Probe",
    "ResolutionResponse",
    "Stability",
    "Tolerances",
    "assert_laws",
    "command",
    "diagnose",
    "flare",
    "flash",
    "flicker",
    "point_spread",
    "report",
    "resolution_response",
    "stability",
    "veiling_glare_index",
]
