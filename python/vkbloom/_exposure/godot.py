"""The automatic exposure of Godot."""

from __future__ import annotations

import dataclasses
from typing import ClassVar

from vkbloom._public import public
from vkbloom._settings.exposure import Exposure, check_ends
from vkbloom._settings.fields import number_field


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class GodotExposure(Exposure):
    """The automatic exposure of Godot, by the mean of the brightest channel.

    Parameters
    ----------
    scale : float
        The value that the mean becomes, 0 to 64.
    speed : float
        Share of the distance that the exposure moves in a second, 0 to 1000 1/s. With more than
        1 / speed seconds from frame to frame it goes beyond its goal.
    min_sensitivity, max_sensitivity : float
        Limits in ISO, 0 to 1e6: the luminance adapted to is that times 0.125 / sensitivity.
    sensitivity : float
        The camera's own in ISO, 0.1 to 1e6.

    Notes
    -----
    Means of 8 x 8 pixels are taken until one is left. Blocks that a side has no room for are not
    metered: of 1920 x 1080 the right 20 % and the lower 5 %. The multiplier of a black scene is
    infinite. Both are as in the engine. The bloom reads exposed light.

    Source: godotengine/godot, luminance_reduce.glsl @ 386e8dc6668a and luminance.cpp @ 0dd74c5021ce
    (MIT).
    """

    engine: ClassVar[str] = "godot"
    _exposes_bloom: ClassVar[bool] = True

    scale: float = number_field(default=0.4, range=(0.0, 64.0))
    speed: float = number_field(default=0.5, range=(0.0, 1000.0), unit="1/s")
    min_sensitivity: float = number_field(default=0.0, range=(0.0, 1e6), unit="ISO")
    max_sensitivity: float = number_field(default=800.0, range=(0.0, 1e6), unit="ISO")
    sensitivity: float = number_field(default=100.0, range=(0.1, 1e6), unit="ISO")

    def __post_init__(self) -> None:
        super().__post_init__()
        check_ends(self, "min_sensitivity", "max_sensitivity")

    def _numbers_of_step(self, dt: float) -> dict[str, float]:
        return {
            "minimum": self.min_sensitivity * 0.125 / self.sensitivity,
            "maximum": self.max_sensitivity * 0.125 / self.sensitivity,
            "step_up": self.speed * dt,
            "scale": self.scale,
        }
