"""The bloom of pygfx."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from vkbloom._public import public
from vkbloom._settings.fields import choice_field, flag_field, number_field, value_field
from vkbloom._settings.pass_sentences import HALVED_BY_13
from vkbloom._settings.settings import Composite, PublishedSettings


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class PygfxBloom(PublishedSettings):
    """The PhysicalBasedBloomPass of pygfx.

    Parameters
    ----------
    levels : int
        Number of levels, 1 to 16; at most floor(log2(longer side of down_0)) + 1.
    filter_radius : float
        Distance of the tent's taps as a share of the width, 0 to 1.
    karis_average : bool
        Whether ``down_0`` is the mean of the five groups, weighted by 1 / (1 + luminance) only. A
        luminance may be negative; a mean that is not finite is 0.
    threshold : None
        pygfx has none.
    composite : {"mix"}
    intensity : float
        The strength of pygfx, 0 to 1.
    **settings
        The other fields of `Settings`; there is no knee.

    Notes
    -----
    ``down_0`` has half the size of the frame, each next level half of the one before, floored, by
    the 13 taps of `Pyramid`. Negative values become 0. up_k = down_k + tent(up_k+1). The taps of
    the tent are `filter_radius` of the smaller level's width apart along both axes. ``bloom`` is
    one bilinear sample of up_0, the sum of the levels.

    The stock renderer's buffers have the format "rgba8unorm-srgb"; ``glow`` is then its frame.

    Source: pygfx/pygfx, pygfx/renderers/wgpu/engine/bloom.py @ f5f8f72c, confirmed by pygfx 0.17.0
    (``docs/evidence/engines.md``).
    """

    method: ClassVar[str] = "pygfx"
    _knobs: ClassVar[tuple[str, ...]] = ("levels", "filter_radius")
    _pass_sentences: ClassVar[Mapping[str, str]] = MappingProxyType({"down": HALVED_BY_13})

    threshold: float | None = value_field(None, fixed="pygfx has no threshold")
    composite: Composite = choice_field(("mix",))
    intensity: float = number_field(default=0.04, range=(0, 1))
    levels: int = number_field(slider=(1, 10))
    filter_radius: float = number_field(slider=(0, 0.05))
    karis_average: bool = flag_field()
