"""Chains of levels: the pyramid, whose levels are added, and dual Kawase."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from vkbloom._numbers import check_floats
from vkbloom._public import public
from vkbloom._settings.fields import flag_field, number_field
from vkbloom._settings.pass_sentences import DOUBLED_BY_8, HALVED_BY_5, HALVED_BY_13
from vkbloom._settings.settings import Settings


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class Pyramid(Settings):
    """A mip chain: 13 taps down, a 3 x 3 tent up, the levels added on the way.

    Parameters
    ----------
    levels : int
        Number of levels, 1 to 16. ``down_0`` has half of the bloom size, each next level half of
        the previous one, floored and at least 1. The chain ends before a level of 1 x 1, unless
        that is the first.
    radius : float
        Distance of the tent's taps in texels of the smaller level, 0 to 16.
    firefly_filter : bool
        In the first downsample the five 2 x 2 groups are weighted by 1 / (1 + luminance of the
        group's mean) and renormalized.
    level_weights : sequence of float or None
        As many finite numbers w_0, w_1, ... as `levels`; they may be negative. If the chain ends
        early, only the first ones are used. None: the mean of the levels.
    scale_x, scale_y : float
        Factors of the distances of all taps, 0 to 16. scale_x=4 stretches the bloom along x, as an
        anamorphic lens does.
    **settings
        The fields of `Settings`.

    Notes
    -----
    Weights of the downsample: centre 0.125; four diagonals 1 texel away 0.125 each; four axials
    2 texels away 0.0625 each; four diagonals 2 texels away 0.03125 each. Upsample: (1 2 1)^2 / 16,
    up_k = down_k + tent(up_k+1). ``bloom`` is tent(up_0) at every pixel of ``final``, divided by
    the number of levels, so that a flat image keeps its value. In "rgba8unorm", whose largest value
    is 1, the images up_k hold the mean of their levels instead of the sum; the bloom is the same.

    With weights up_k = w_k down_k + tent(up_k+1), where the smallest level is w_N-1 down_N-1, and
    ``bloom`` = tent(up_0) is not divided: a flat image becomes the sum of the weights. In
    "rgba8unorm" up_k is divided by the sum of the weights' sizes, ``|w_k|`` + ... + ``|w_N-1|``.

    The taps are whole texels apart. If a side of the bloom buffers is odd, they skip texels in the
    middle of ``down_0``: a pixel of light there loses nearly all of its bloom, and a small moving
    light flickers. An even `bloom_size`, such as the next larger one, avoids this.

    Source: Jimenez, "Next Generation Post Processing in Call of Duty: Advanced Warfare",
    SIGGRAPH 2014.
    """

    method: ClassVar[str] = "pyramid"
    _knobs: ClassVar[tuple[str, ...]] = ("levels", "radius")
    _pass_sentences: ClassVar[Mapping[str, str]] = MappingProxyType({"down": HALVED_BY_13})

    levels: int = number_field(slider=(1, 10))
    radius: float = number_field(unit="texel", slider=(0, 4))
    firefly_filter: bool = flag_field()
    level_weights: tuple[float, ...] | None = None
    scale_x: float = number_field(slider=(0, 8), everyday=0)
    scale_y: float = number_field(slider=(0, 8), everyday=0)

    def _check_together(self) -> None:
        if self.level_weights is not None:
            weights, count = check_floats("level_weights", self.level_weights), self.levels
            if len(weights) != count:
                raise ValueError(
                    f"level_weights: {len(weights)} weights are out of range, {count}, one for "
                    "each level"
                )
            object.__setattr__(self, "level_weights", weights)


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class DualKawase(Settings):
    """A chain of halved images: downsampled with 5 taps, upsampled with 8, nothing added.

    Parameters
    ----------
    levels : int
        Number of levels, 1 to 16; their sizes are those of `Pyramid`.
    offset : float
        Factor of the distances of all taps, 0 to 16.
    **settings
        The fields of `Settings`.

    Notes
    -----
    Downsample: (4 c + the four diagonals at half a texel of the source) / 8. Upsample: (the four
    axials at one texel of the smaller level + 2 times the four diagonals at half a texel of it)
    / 12.

    The diagonals of `offset` 1 cover all texels only if each side of the image is twice that of the
    level. Otherwise they skip some, and a small moving light flickers. A `bloom_size` whose sides
    are multiples of 2^levels avoids this.

    Source: Bjorge, "Bandwidth-Efficient Rendering", SIGGRAPH 2015.
    """

    method: ClassVar[str] = "dual_kawase"
    _knobs: ClassVar[tuple[str, ...]] = ("levels", "offset")
    _pass_sentences: ClassVar[Mapping[str, str]] = MappingProxyType(
        {"down": HALVED_BY_5, "up": DOUBLED_BY_8}
    )

    levels: int = number_field(default=4, slider=(1, 10))
    offset: float = number_field(slider=(0, 8))
