"""The eye adaptation of O3DE."""

from __future__ import annotations

import dataclasses
from typing import ClassVar

from vkbloom._public import public
from vkbloom._settings.exposure import Exposure, check_ends
from vkbloom._settings.fields import number_field


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class O3deExposure(Exposure):
    """The eye adaptation of O3DE, by the mean of the luminance.

    Parameters
    ----------
    minimum, maximum : float
        Limits of the goal in stops above grey, -32 to 32.
    speed_up, speed_down : float
        Share of the distance to a brighter, or a darker goal that is left behind in a second,
        0 to 1000 1/s. Steps of more than 1 / speed seconds go beyond the goal.

    Notes
    -----
    The picture is metered with its bloom. The exposure is applied after the bloom.

    Source: o3de/o3de, EyeAdaptation.azsl @ 354a2accd2a2 (Apache-2.0 or MIT).
    """

    engine: ClassVar[str] = "o3de"
    _exposes_picture: ClassVar[bool] = True
    _meters_bloom: ClassVar[bool] = True

    minimum: float = number_field(default=-16.0, range=(-32.0, 32.0), unit="stop")
    maximum: float = number_field(default=16.0, range=(-32.0, 32.0), unit="stop")
    speed_up: float = number_field(default=3.0, range=(0.0, 1000.0), unit="1/s")
    speed_down: float = number_field(default=1.0, range=(0.0, 1000.0), unit="1/s")

    def __post_init__(self) -> None:
        super().__post_init__()
        check_ends(self, "minimum", "maximum")

    def _numbers_of_step(self, dt: float) -> dict[str, float]:
        return {
            "minimum": self.minimum,
            "maximum": self.maximum,
            "step_up": self.speed_up * min(dt, 1.0),
            "step_down": self.speed_down * min(dt, 1.0),
        }
