"""Bloom of PlayCanvas."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar

from vkbloom._public import public
from vkbloom._settings.fields import number_field
from vkbloom._settings.pass_sentences import HALVED_BY_13
from vkbloom._settings.settings import PublishedSettings


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class PlayCanvasBloom(PublishedSettings):
    """Bloom of PlayCanvas' CameraFrame.

    Parameters
    ----------
    blur_level : int
        Largest number of levels, 1 to 16.
    threshold : float or None
        Middle of a soft threshold; None or 0: none.
    composite : {"add"}
    intensity : float
        The engine's default is 0, which is off, and its range ends at 0.1; here it is 0.01.
    **settings
        The other fields of `Settings`; there is no knee.

    Notes
    -----
    ``half`` is one bilinear tap at half of the frame's size, floored; negative values become 0.
    There are clamp(floor(log2(shorter side of half)), 1, blur_level) levels. ``down_0`` has half
    the size of ``half``, each next level half of the one before, by the 13 taps of `Pyramid`. The
    knee curve of `Settings` is applied to ``down_0``, with k = threshold / 2, 4k + 1e-4 and 1e-4.
    up_k = down_k + tent(up_k+1), whose taps are a texel apart; ``bloom`` is one bilinear sample of
    up_0, the sum of the levels.

    Source: playcanvas/engine 2.23, frame-pass-bloom.js and downsample.js @ 1f7213d06f78,
    2.22.0-beta.20 @ 0aaef5e432c4.
    """

    method: ClassVar[str] = "playcanvas"
    _knobs: ClassVar[tuple[str, ...]] = ("threshold", "blur_level")
    _pass_sentences: ClassVar[Mapping[str, str]] = MappingProxyType({"down": HALVED_BY_13})
    _threshold_fields: ClassVar[tuple[str, ...]] = ("threshold",)

    intensity: float = number_field(default=0.01, slider=(0, 0.1))
    blur_level: int = number_field(default=16, range=(1, 16))

    def _core_values(self) -> dict[str, Any]:
        """Return what the core names or counts otherwise."""
        return {
            "threshold": self.threshold or None,
            "knee": 0.5,
            "levels": self.blur_level,
        }

    def _threshold_slopes(self) -> dict[str, float]:
        # 0 stands for none.
        return {"threshold": float(self.threshold != 0)}
