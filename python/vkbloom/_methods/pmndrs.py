"""Bloom of the library postprocessing for three.js."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar

from vkbloom._formats import MAX_HALF
from vkbloom._public import public
from vkbloom._settings.fields import choice_field, number_field
from vkbloom._settings.pass_sentences import HALVED_BY_13
from vkbloom._settings.settings import Composite, PublishedSettings


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class PmndrsBloom(PublishedSettings):
    """BloomEffect of pmndrs/postprocessing with its blur of a mip chain.

    Parameters
    ----------
    radius : float
        Share of the larger blurs, 0 to 1.
    levels : int
        Number of levels, 1 to 16.
    smoothing : float
        Luminance over which the threshold fades in, 0 to 65504; less than 0.0001 counts as that.
    threshold : float or None
        Luminance at which the fade begins. Where threshold and smoothing are 0, there is none.
    composite : {"screen", "add"}
        With b the bloom times the intensity, the screen is s + b - min(s b, 1), without clamps.
    **settings
        The other fields of `Settings`; there is no knee.

    Notes
    -----
    ``bright`` is the frame times smoothstep(threshold, threshold + smoothing, luminance). Each
    level has half the size of the image above it, rounded, at least 1, by 13 taps: 0.125 at
    (+-1, +-1), 0.05556 at (0, 0), (+-2, 0), (0, +-2) and (+-2, +-2), in texels of that image. A tap
    whose position is outside of 0..1 counts as 0, so that borders darken; the one in the middle
    always counts. up_k = lerp(down_k, tent(up_k+1), radius), whose taps are a texel apart; a single
    level is mixed with its own tent. ``bloom`` is one bilinear sample of up_0.

    Source: pmndrs/postprocessing @ 69c61a640078 (6.39.0), BloomEffect.js, LuminancePass.js,
    MipmapBlurPass.js and their shaders.
    """

    method: ClassVar[str] = "pmndrs"
    _knobs: ClassVar[tuple[str, ...]] = ("threshold", "radius")
    _pass_sentences: ClassVar[Mapping[str, str]] = MappingProxyType({"down": HALVED_BY_13})
    _threshold_fields: ClassVar[tuple[str, ...]] = ("threshold", "smoothing")

    threshold: float | None = number_field(default=1.0, slider=(0, 4))
    composite: Composite = choice_field(("screen", "add"))
    radius: float = number_field(default=0.85, range=(0, 1))
    levels: int = number_field(default=8)
    smoothing: float = number_field(default=0.03, range=(0, MAX_HALF), slider=(0, 1))

    def _core_values(self) -> dict[str, Any]:
        """Return what the core names or counts otherwise."""
        return {
            "smooth_width": max(self.smoothing, 1e-4),
            "threshold": None if self.threshold == self.smoothing == 0 else self.threshold,
        }

    def _threshold_slopes(self) -> dict[str, float]:
        # Two zeros stand for none, and a narrow step for the narrowest, with the mean at this kink.
        is_none = self.threshold == self.smoothing == 0
        wider = ((self.smoothing > 1e-4) + (self.smoothing >= 1e-4)) / 2
        return {"threshold": float(not is_none), "smoothing": wider}
