"""KinoBloom."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from vkbloom._public import public
from vkbloom._settings.fields import flag_field, number_field
from vkbloom._settings.settings import PublishedSettings


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class KinoBloom(PublishedSettings):
    """Keijiro Takahashi's KinoBloom, version 2, in its high quality.

    Parameters
    ----------
    radius : float
        Of the blur, 1 to 7. An increase by one doubles the width.
    anti_flicker : bool
        Whether to take the median of five pixels before the threshold, and to weight the four taps
        of the first level by 1 / (1 + brightest channel).
    threshold : float or None
        In linear light; KinoBloom shows the default as 0.8 in sRGB.
    knee : float
        KinoBloom's "soft knee".
    composite : {"add"}
    **settings
        The other fields of `Settings`.

    Notes
    -----
    ``bright`` has the size of the frame. It is m = median(median(c, left, right), up, down) after
    the knee curve with k = threshold * knee + 1e-5 and
    q = clamp(b - threshold + k, 0, 2k)^2 / (4k).
    ``down_0`` has half of this size, floored, and each next level half of the one before, by four
    taps of 1/4, one texel to each side. With lg = log2(height) + radius - 8, there are
    N = clamp(trunc(lg), 1, 16) levels, and the taps of the tent are 0.5 + lg - trunc(lg) texels
    apart. up_k = down_k + tent(up_k+1) and ``bloom`` = tent(up_0): the sum of the levels, not
    their mean. In "rgba8unorm" the images up_k hold means, and the bloom is N times as coarse.

    Source: keijiro/KinoBloom @ 0a04c43fa47d (2017), Assets/Kino/Bloom/Bloom.cs, Bloom.cginc.
    """

    method: ClassVar[str] = "kino"
    _knobs: ClassVar[tuple[str, ...]] = ("threshold", "radius")
    _pass_sentences: ClassVar[Mapping[str, str]] = MappingProxyType(
        {"down": "halves the size by the mean of four taps"}
    )
    _threshold_fields: ClassVar[tuple[str, ...]] = ("threshold", "knee")

    threshold: float | None = ((0.8 + 0.055) / 1.055) ** 2.4  # 0.8 in sRGB
    knee: float = number_field(fixed="", default=0.5)
    intensity: float = number_field(default=0.8)
    radius: float = number_field(default=2.5, range=(1, 7))
    anti_flicker: bool = flag_field()
