"""The automatic exposures of Unity: HDRP and Post Processing v2."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar, Final, Literal, get_args

from vkbloom._exposure.mask import read_mask
from vkbloom._public import public
from vkbloom._settings.exposure import Exposure, check_ends, half_lives
from vkbloom._settings.fields import number_field, value_field

Mode = Literal["histogram", "automatic"]
Metering = Literal["average", "spot", "center_weighted", "mask", "procedural"]
#: In the order of METERING_* of the core.
METERINGS: Final = get_args(Metering)


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class HdrpExposure(Exposure):
    """The automatic exposure of Unity HDRP.

    Parameters
    ----------
    mode : {"histogram", "automatic"}
        A histogram of each second pixel of each second row; or a mean on 1024 x 1024 points.
    metering : {"average", "spot", "center_weighted", "mask", "procedural"}
        What counts how much.
    compensation : float
        Stops that are added, -32 to 32.
    limit_min, limit_max : float
        Least and largest EV100, -32 to 32; also the ends of the histogram.
    percent_min, percent_max : float
        Shares of the histogram in percent, 0 to 100: what is darker than the first, and what is
        brighter than the second does not count.
    speed_dark_to_light, speed_light_to_dark : float
        Rates at which the exposure follows a scene that became brighter, or darker, 0 to 1000 1/s.
        After 1 / rate seconds half of the distance is left.
    grey : float
        The K of EV100 = log2(100 L / K), 1 to 100; the engine offers 12.5, 14 and 18.
    mask : array-like, shape (h, w), or None
        Weights of 0 to 1 for the metering "mask" (uint8 is read as value / 255).
    centre_x, centre_y : float
        Centre of the procedural metering, -1 to 2, in shares of width and height from the upper
        left corner.
    radius_x, radius_y : float
        Its radii in shares of width and height, 0.001 to 10.
    softness : float
        Its softness, 0.001 to 100.
    mask_min, mask_max : float
        Range of EV100 that the procedural metering counts, -64 to 64.

    Notes
    -----
    The multiplier 1 / (1.2 * 2^EV) of a frame is applied to the next one, before its bloom.

    Source: Unity HDRP 13.0.0, HistogramExposure.compute and Exposure.compute @ a645acddce97, which
    were read.
    """

    engine: ClassVar[str] = "hdrp"
    _exposes_bloom: ClassVar[bool] = True
    _is_before_taa: ClassVar[bool] = True

    mode: Mode = "histogram"
    metering: Metering = value_field("center_weighted", kind="choice")
    compensation: float = number_field(default=0.0, range=(-32.0, 32.0), unit="stop")
    limit_min: float = number_field(default=-1.0, range=(-32.0, 32.0), unit="EV100")
    limit_max: float = number_field(default=14.0, range=(-32.0, 32.0), unit="EV100")
    percent_min: float = number_field(default=40.0, range=(0.0, 100.0), unit="%")
    percent_max: float = number_field(default=90.0, range=(0.0, 100.0), unit="%")
    speed_dark_to_light: float = number_field(default=3.0, range=(0.0, 1000.0), unit="1/s")
    speed_light_to_dark: float = number_field(default=1.0, range=(0.0, 1000.0), unit="1/s")
    grey: float = number_field(default=12.5, range=(1.0, 100.0))
    mask: Any = value_field(None, optional=True, read=read_mask)
    centre_x: float = number_field(default=0.5, range=(-1.0, 2.0))
    centre_y: float = number_field(default=0.5, range=(-1.0, 2.0))
    radius_x: float = number_field(default=0.3, range=(1e-3, 10.0))
    radius_y: float = number_field(default=0.3, range=(1e-3, 10.0))
    softness: float = number_field(default=0.5, range=(1e-3, 100.0))
    mask_min: float = number_field(default=-30.0, range=(-64.0, 64.0), unit="EV100")
    mask_max: float = number_field(default=30.0, range=(-64.0, 64.0), unit="EV100")

    def __post_init__(self) -> None:
        super().__post_init__()
        check_ends(self, "limit_min", "limit_max", apart=True)
        check_ends(self, "percent_min", "percent_max")
        if (self.metering == "mask") != (self.mask is not None):
            raise ValueError('mask: give one with metering="mask", and only then')

    @property
    def _core_engine(self) -> str:
        return self.engine if self.mode == "histogram" else "hdrp_automatic"

    def _numbers_of_step(self, dt: float) -> dict[str, float]:
        # Light of 0 EV100 has the luminance K / 100.
        least, most = (self.grey / 100 * 2.0**ev for ev in (self.mask_min, self.mask_max))
        return {
            "low": self.limit_min,
            "high": self.limit_max,
            "minimum": self.limit_min,
            "maximum": self.limit_max,
            "cut_low": self.percent_min / 100,
            "cut_high": self.percent_max / 100,
            "step_up": half_lives(dt, self.speed_dark_to_light),
            "step_down": half_lives(dt, self.speed_light_to_dark),
            "compensation": self.compensation,
            "grey": self.grey,
            "masked": self.mask is not None,
            "metering": METERINGS.index(self.metering),
            "centre_x": self.centre_x,
            "centre_y": self.centre_y,
            "radius_x": self.radius_x,
            "radius_y": self.radius_y,
            "power": 1 / self.softness,
            "least": least,
            "most": most,
        }


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class PostProcessingExposure(Exposure):
    """The automatic exposure of Unity's Post Processing v2, by a histogram.

    Parameters
    ----------
    percent_min, percent_max : float
        Shares of the histogram in percent, 0 to 100: what is darker than the first, and what is
        brighter than the second does not count.
    minimum, maximum : float
        Limits of the mean's log2, -9 to 9 EV. By default both are 0, so that nothing changes.
    key_value : float
        The luminance that the mean becomes, 0 to 100.
    speed_up, speed_down : float
        Rates at which the multiplier follows a scene that became brighter, or darker,
        0 to 1000 1/s. After 1 / rate seconds half of the distance is left.

    Notes
    -----
    The bloom reads exposed light. A mean of multipliers moves, not of stops.

    Source: Unity Post Processing 3.5.1, AutoExposure.compute and ExposureHistogram.hlsl @
    1872927df2d3, which were read.
    """

    engine: ClassVar[str] = "ppv2"
    _exposes_bloom: ClassVar[bool] = True

    percent_min: float = number_field(default=50.0, range=(0.0, 100.0), unit="%")
    percent_max: float = number_field(default=95.0, range=(0.0, 100.0), unit="%")
    minimum: float = number_field(default=0.0, range=(-9.0, 9.0), unit="EV")
    maximum: float = number_field(default=0.0, range=(-9.0, 9.0), unit="EV")
    key_value: float = number_field(default=1.0, range=(0.0, 100.0))
    speed_up: float = number_field(default=2.0, range=(0.0, 1000.0), unit="1/s")
    speed_down: float = number_field(default=1.0, range=(0.0, 1000.0), unit="1/s")

    def __post_init__(self) -> None:
        super().__post_init__()
        check_ends(self, "percent_min", "percent_max")
        check_ends(self, "minimum", "maximum")

    def _numbers_of_step(self, dt: float) -> dict[str, float]:
        return {
            "low": -9.0,
            "high": 9.0,
            "minimum": self.minimum,
            "maximum": self.maximum,
            "cut_low": self.percent_min / 100,
            "cut_high": self.percent_max / 100,
            "step_up": half_lives(dt, self.speed_up),
            "step_down": half_lives(dt, self.speed_down),
            "scale": self.key_value,
        }
