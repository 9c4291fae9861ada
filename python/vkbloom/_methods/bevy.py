"""Bevy's bloom."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from vkbloom._public import public
from vkbloom._settings.fields import choice_field, number_field
from vkbloom._settings.pass_sentences import HALVED_BY_13
from vkbloom._settings.settings import Composite, PublishedSettings


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class BevyBloom(PublishedSettings):
    """Bevy's bloom, by default its ``Bloom::NATURAL``.

    Parameters
    ----------
    low_frequency_boost : float
        Additional share of the larger blurs beyond `intensity`, 0 to 1.
    low_frequency_boost_curvature : float
        Curvature of the boost over the levels, 0 to 0.99. With more, it rises at smaller blurs.
    high_pass_frequency : float
        Share of the levels, counted from the smallest blur, that are not attenuated, 0.001 to 1.
    max_mip_dimension : int
        Height of ``down_0`` in pixels, 4 to 4096.
    scale_x, scale_y : float
        Bevy's scale: factors of the distances of all taps, 0 to 16. Its ``Bloom::ANAMORPHIC`` is
        ``scale_x=4, max_mip_dimension=1024``.
    composite : {"mix", "add"}
        Bevy's "energy conserving" and "additive".
    intensity : float
        0 to 1. It also changes the shares of the levels.
    threshold, knee : float
        Bevy's threshold and threshold softness. The knee curve is used even with a knee of 0.
    **settings
        The other fields of `Settings`.

    Notes
    -----
    ``down_0`` is `max_mip_dimension` high; its width follows from the aspect of the frame
    (rounded, at most 16384 or the adapter's limit). It is the sum of the five groups of the 13
    taps of Jimenez, in texels of the frame. Each group p, multiplied by its share, is divided by
    1 + luminance(p) / 4. The sum is at least 0.0001; then the threshold is applied. There are
    N = floor(log2(max_mip_dimension)) - 1 levels. Each next level has half the size, floored, by
    the plain 13 taps. For level m, with x = m / (N - 1), f_m is

        (intensity + (1 - (1 - x)^(1 / (1 - curvature))) * boost * (1 - intensity))
        * (1 - clamp((x - high_pass) / high_pass, 0, 1)),

    without the factor 1 - intensity if the composite is "add". With "mix",
    up_k = (1 - f_k+1) down_k + f_k+1 tent(up_k+1); with "add", down_k + f_k+1 tent(up_k+1). The
    tent is that of `Pyramid` with a radius of 1. `scale_x` and `scale_y` multiply the distances of
    all these taps. Bevy's last step, lerp(scene, tent(up_0), f_0), is the composite, since f_0 is
    the intensity.

    Source: bevyengine/bevy, tag v0.19.1 (b56fc29d3016), crates/bevy_post_process/src/bloom.
    """

    method: ClassVar[str] = "bevy"
    _level_height: ClassVar[str] = "max_mip_dimension"
    _knobs: ClassVar[tuple[str, ...]] = ("low_frequency_boost", "max_mip_dimension")
    _pass_sentences: ClassVar[Mapping[str, str]] = MappingProxyType({"down": HALVED_BY_13})
    _threshold_fields: ClassVar[tuple[str, ...]] = ("threshold", "knee")

    knee: float = number_field(fixed="")
    composite: Composite = choice_field(("mix", "add"))
    intensity: float = number_field(default=0.15, range=(0, 1))
    low_frequency_boost: float = number_field()
    low_frequency_boost_curvature: float = number_field(everyday=0)
    high_pass_frequency: float = number_field()
    max_mip_dimension: int = number_field(unit="pixel", slider=(16, 1024), everyday=0)
    scale_x: float = number_field(slider=(0, 8), everyday=0)
    scale_y: float = number_field(slider=(0, 8), everyday=0)
