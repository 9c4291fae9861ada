"""The adaptation of Granite."""

from __future__ import annotations

import dataclasses
from typing import ClassVar

from vkbloom._public import public
from vkbloom._settings.exposure import Exposure, check_ends, half_lives
from vkbloom._settings.fields import number_field


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class GraniteExposure(Exposure):
    """The adaptation of Granite, by the mean of the log2 of the brightest channel.

    Parameters
    ----------
    minimum, maximum : float
        Limits of the mean in stops, -32 to 32.

    Notes
    -----
    Half of the distance is left after a second. The bloom reads light times the exposure of the
    frame before, so that a threshold t is t 2^l without exposure, with l the mean adapted to.

    Source: Themaister/Granite, luminance.comp, bloom_threshold.comp and hdr.cpp @ 7c59ad8089c0
    (MIT).
    """

    engine: ClassVar[str] = "granite"
    _exposes_bloom: ClassVar[bool] = True
    _exposes_picture: ClassVar[bool] = True

    minimum: float = number_field(default=-3.0, range=(-32.0, 32.0), unit="stop")
    maximum: float = number_field(default=2.0, range=(-32.0, 32.0), unit="stop")

    def __post_init__(self) -> None:
        super().__post_init__()
        check_ends(self, "minimum", "maximum")

    def _numbers_of_step(self, dt: float) -> dict[str, float]:
        return {
            "minimum": self.minimum,
            "maximum": self.maximum,
            "step_up": half_lives(dt, 1.0),
        }
