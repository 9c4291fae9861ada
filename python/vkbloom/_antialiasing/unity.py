"""The temporal anti-aliasing of Unity HDRP."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import ClassVar, Literal

from vkbloom._public import public
from vkbloom._settings.antialiasing import Antialiasing, gaussian_weights, read_jitter
from vkbloom._settings.fields import number_field, value_field

Quality = Literal["medium", "low", "high"]


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class HdrpAntialiasing(Antialiasing):
    """The temporal anti-aliasing of Unity HDRP.

    Parameters
    ----------
    quality : {"medium", "low", "high"}
        Low: the history stays within the range of five pixels. Medium: within their mean and
        deviation. High: within those of 3 x 3 pixels, and this frame is filtered.
    sharpening : float
        How much this frame is sharpened, 0 to 1.
    history_sharpening : float
        The c of the cubic filter of the history, 0 to 1; 0: it is bilinear.
    anti_flicker : float
        How far the history may be from the mean where it differs from this frame, 0 to 1.
    base_blend : float
        Share of the history in the result, 0.6 to 0.95.
    jitter : (float, float) or None
        Offset of the camera in this frame, pixels to the right and down, -1 to 1; only the quality
        "high" reads it. None: that of the engine in the frame of this number, `offset`; the number
        is counted in the alpha of the history.
    order : {"before", "after"}
        As of `Antialiasing`.

    Notes
    -----
    `depth` is larger where the surface is nearer. The motion of a pixel is that of the nearest of
    itself and four diagonal neighbours. Samples do not go beyond one texel before the right and the
    lower edge; the right sample of the history is read in the row above; a depth in the pixel's own
    quad is z(x') + z(y') - z. All are as in the engine. Light above 65472 is clamped.

    Source: Unity HDRP 13.0.0, TemporalAntiAliasing.shader and TemporalAntialiasing.hlsl
    @ a645acddce97, which were read.
    """

    engine: ClassVar[str] = "hdrp"

    quality: Quality = value_field("medium", kind="choice")
    sharpening: float = number_field(default=0.5, range=(0.0, 1.0))
    history_sharpening: float = number_field(default=0.35, range=(0.0, 1.0))
    anti_flicker: float = number_field(default=0.5, range=(0.0, 1.0))
    base_blend: float = number_field(default=0.875, range=(0.6, 0.95))
    jitter: tuple[float, float] | None = value_field(None, optional=True, read=read_jitter)

    @property
    def _core_engine(self) -> str:
        return f"hdrp_{self.quality}"

    @property
    def flicker_contrast(self) -> float:
        """The contrast at which the deviation is largest: 0.7 to 0.4, by a smooth step."""
        part = self.anti_flicker
        return 0.7 - 0.3 * (0.5 + 0.5 * (part * part * (3 - 2 * part)))

    def _core_numbers_of_frame(self) -> dict[str, float]:
        return {
            "weight": 1.0 - self.base_blend,
            "sharpening": 3.0 * self.sharpening,
            "sharpness": self.history_sharpening,
            "flicker": 3.5 * self.anti_flicker,
            "contrast": self.flicker_contrast,
        }

    def filter_weights(self) -> Sequence[Sequence[float]]:
        """Return exp(-d^2 / 0.44), with d from the offset on."""
        if self.quality != "high":
            return ()
        own = self.jitter
        offsets = [own] if own is not None else [*map(self.offset, range(self.phases))]
        return gaussian_weights(offsets, 0.5 / 0.22, 1.0)
