"""The temporal anti-aliasing of Godot."""

from __future__ import annotations

import dataclasses
from typing import ClassVar

from vkbloom._public import public
from vkbloom._settings.antialiasing import Antialiasing
from vkbloom._settings.fields import number_field


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class GodotAntialiasing(Antialiasing):
    """The temporal anti-aliasing of Godot.

    Parameters
    ----------
    frames : float
        The most frames that the history counts as, 1 to 1024.
    moving_box : float
        What the box around the colours of 3 x 3 pixels is multiplied by in fast motion, 0 to 1.
    disocclusion : float
        Pixels by which the motion may differ from that of the frame before, 0 to 1024, before the
        history counts less.
    order : {"before", "after"}
        As of `Antialiasing`.

    Notes
    -----
    `depth` is smaller where the surface is nearer. The motion of a pixel is that of the nearest of
    3 x 3 pixels, read one pixel to the upper left of it, and 0 outside, as in the engine. Colours
    are c / (1 + c) in each channel. The history has the frames that it counts as in its alpha, and
    the framebuffer ``history_motion`` the motion of the frame before.

    Source: godotengine/godot, taa_resolve.glsl @ 0c64c88a78ca (MIT).
    """

    engine: ClassVar[str] = "godot"
    phases: ClassVar[int] = 16

    frames: float = number_field(default=16.0, range=(1.0, 1024.0))
    moving_box: float = number_field(default=0.4, range=(0.0, 1.0))
    disocclusion: float = number_field(default=2.5, range=(0.0, 1024.0), unit="px")

    def _core_numbers_of_frame(self) -> dict[str, float]:
        return {
            "frames": self.frames,
            "moving_box": self.moving_box,
            "disocclusion": self.disocclusion,
        }
