"""Filament's bloom."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from vkbloom._public import public
from vkbloom._settings.fields import number_field
from vkbloom._settings.settings import PublishedSettings


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class FilamentBloom(PublishedSettings):
    """Filament's bloom at its low quality, the default one.

    Parameters
    ----------
    resolution : int
        Height of ``down_0`` before it is floored to a multiple of 16, 16 to 2048.
    levels : int
        Number of levels, 1 to 12; at most floor(log2(resolution)) + 1.
    highlight : float
        Brightness towards which bright colours are compressed, 10 to 65504. Used only with a
        threshold.
    threshold : float or None
        Filament's is 1 or off. With a threshold, fireflies are filtered, too.
    composite : {"add"}
    intensity : float
        Filament's strength, 0 to 1.
    **settings
        The other fields of `Settings`; there is no knee.

    Notes
    -----
    The width of ``down_0`` follows from the aspect of the frame, floored to a multiple of 16, at
    most 16384 or the adapter's limit. While ``down_0`` is less than half of the frame in width or
    height, the frame is halved first. All
    these steps are a bilinear sample of the image convolved with (1 2 1)^2 / 16. The first one
    includes the threshold: its four bilinear taps are weighted by 1 / (1 + brightest channel);
    then c = max(0, c - threshold); then c / (1 + brightest channel of c / highlight). Each further
    level has half the size, floored, by 3 x 3 taps 1.761629 texels apart, the outer ones with a
    weight of 7.46602 / 32 along an axis. If a side of the level above is odd, it is reduced by the
    13 taps of `Pyramid`. up_k = down_k + tent(up_k+1) with a tent of one pixel of the larger level;
    ``bloom`` is one bilinear sample of up_0, divided by the number of levels.

    Source: google/filament: bloomDownsample2x.mat @ 9f62dc2f2f53, bloomDownsample9.mat and
    bloomDownsample.mat @ 523a261b1052, bloomUpsample.mat @ 9f62dc2f2f53,
    filament/src/PostProcessManager.cpp @ 003e5005713c, include/filament/Options.h @ 2fac13e154fb.
    """

    method: ClassVar[str] = "filament"
    _level_height: ClassVar[str] = "resolution"
    _knobs: ClassVar[tuple[str, ...]] = ("levels", "resolution")
    _pass_sentences: ClassVar[Mapping[str, str]] = MappingProxyType(
        {"down": "halves the size with 9 taps, or 13 of an odd size: small lights do not flicker"}
    )
    _threshold_fields: ClassVar[tuple[str, ...]] = ("threshold", "highlight")

    threshold: float | None = 1.0
    intensity: float = number_field(default=0.1, range=(0, 1))
    levels: int = number_field(range=(1, 12))
    resolution: int = number_field(unit="pixel", slider=(16, 1024))
    highlight: float = number_field(slider=(10, 5000))
