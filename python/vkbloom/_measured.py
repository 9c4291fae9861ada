"""The point-spread function of settings."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, cast

import numpy as np

from vkbloom._array_cache import keep
from vkbloom._psf.base import Array
from vkbloom._psf.sampled import SampledPSF
from vkbloom._public import public
from vkbloom._settings.fields import value_field
from vkbloom._settings.registry import METHODS
from vkbloom._settings.settings import Settings, resolve_settings


def _read_settings(settings: Any) -> Settings:
    if isinstance(settings, Mapping):
        settings = Settings.from_dict(settings)
    given = resolve_settings(settings)
    if given.threshold is not None:
        raise ValueError(
            f"threshold: {given.threshold!r} is not None; a bloom with a threshold is not "
            "linear and has no point spread"
        )
    return given


@public("vkbloom.psf")
@dataclasses.dataclass(frozen=True)
class measured(SampledPSF):
    """The bloom of one pixel of 1, computed by `vkbloom.reference`, defined in pixels.

    That of a method without a reference, such as a loaded one, is rendered.

    Parameters
    ----------
    settings : Settings or str
        Settings, or the name of a preset, without a threshold, which would not be linear. If the
        spread depends on the position, it is that of the pixel in the middle.
    size : (int, int)
        Width and height of the image. The pixel is at (width // 2, height // 2).

    Raises
    ------
    ValueError
        The settings have a threshold, or `size` is not a pair of integers of at least 1.
    """

    settings: Settings | str = value_field(read=_read_settings)
    size: tuple[int, int] = (256, 256)

    def native_array(self) -> Array:
        return _spread(self)


@keep
def _spread(psf: measured) -> Array:
    from vkbloom import reference  # noqa: PLC0415  costs start-up time

    width, height = psf.size
    # Values of doubles are not clamped.
    point = np.zeros((height, width, 3))
    point[height // 2, width // 2] = 1
    settings = cast("Settings", psf.settings)
    if METHODS.is_added(settings.method):
        spread = _render(point, settings)
    else:
        spread = reference.blur(point, settings, format="rgba32float")
    spread.flags.writeable = False
    return spread


def _render(point: Array, settings: Settings) -> Array:
    """Return the bloom of a custom method."""
    from vkbloom._renderer.default import apply  # noqa: PLC0415  above this floor

    exact = settings.replace(format="rgba32float")
    frames = apply(point.astype(np.float32), exact, framebuffers="bloom")
    return frames["bloom"][..., :3].astype(np.float64)
