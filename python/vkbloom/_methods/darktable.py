"""Bloom of darktable."""

from __future__ import annotations

import dataclasses
import math
from typing import Any, ClassVar

from vkbloom._public import public
from vkbloom._settings.fields import choice_field, number_field
from vkbloom._settings.settings import Composite, PublishedSettings


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class DarktableBloom(PublishedSettings):
    """Bloom of darktable, on the lightness of CIE Lab.

    Parameters
    ----------
    blur_size : float
        Width of the glow in percent, 0 to 100.
    strength : float
        Brightness of the glow in percent, 0 to 100.
    threshold : float or None
        Lightness after the strength, 0 to 100, that a colour must exceed.
    composite : {"screen"}
        Of lightness: L' = L + i b (100 - L). Above 100 it becomes darker.
    **settings
        The other fields of `Settings`; there is no knee.

    Notes
    -----
    ``bright`` is L 2^(min(100, strength + 1) / 100) / 100 where that is above the threshold, else
    0. L is that of CIE Lab (D50). ``bloom`` is ``bright``, eight times the mean of a box along x,
    then along y, of floor(256 min(100, blur_size + 1) / 100) pixels to each side, at most 256, as
    far as these are inside of the frame. a and b of a colour do not change.

    Source: darktable 4.2.1, src/iop/bloom.c.
    """

    method: ClassVar[str] = "darktable"
    _knobs: ClassVar[tuple[str, ...]] = ("threshold", "blur_size", "strength")
    _threshold_fields: ClassVar[tuple[str, ...]] = ("threshold",)

    threshold: float | None = number_field(default=90.0, range=(0, 100))
    composite: Composite = choice_field(("screen",))
    blur_size: float = number_field(default=20.0, range=(0, 100))
    strength: float = number_field(default=25.0, range=(0, 100))

    @property
    def box_radius(self) -> int:
        """Pixels to each side of a box."""
        return min(256, math.floor(256 * min(100.0, self.blur_size + 1) / 100))

    def _core_values(self) -> dict[str, Any]:
        """Return what the core names or counts otherwise."""
        gain = 2 ** (min(100.0, self.strength + 1) / 100)
        return {"size": self.box_radius / 256, "strength": gain}

    def _threshold_slopes(self) -> dict[str, float]:
        # A step.
        return {"threshold": 0.0}
