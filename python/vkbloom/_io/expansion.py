"""Expand the highlights of an image of integers, whose values end at 1, so that they can glow.

A file of integers gets them compressed again by the inverse.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._io.icc import Profile
from vkbloom._io.picture import Highlights, Picture
from vkbloom._numbers import check_number

#: Values up to this one stay as they are: 0.91 of an 8-bit file in sRGB, the level 231.
KNEE: Final = 0.8
#: What photographs are expanded to for the preset "photo".
PHOTO_EXPANSION: Final = 4.0
_MAX_EXPANSION: Final = 1024.0


def check_expansion(expand: float | None) -> float:
    """Return the value that 1 becomes; None is 1."""
    return 1.0 if expand is None else check_number("expand", expand, 1, _MAX_EXPANSION)


def expand_highlights(
    image: NDArray[Any], expand: float | None, profile: Profile | None = None
) -> NDArray[Any]:
    """Return an image whose highlights reach up to `expand`, with the hue of each pixel.

    `profile`: The components r, g, b are those of its primaries, in place of Rec. 709. With
    m = max(r, g, b), limited to 1, the knee a and the expansion E:

        m' = a + (m - a) / (1 - k (m - a)) for m > a, with k = 1 / (1 - a) - 1 / (E - a)

    and the colour is multiplied by m' / m. It is the inverse of

        m = a + (m' - a) / (1 + k (m' - a)),

    which compresses a..E to a..1: Reinhard et al., "Photographic Tone Reproduction for Digital
    Images", SIGGRAPH 2002, above a knee, where both have the slope 1.
    """
    limit = check_expansion(expand)
    if limit == 1:
        return image
    colours = image[:, :, :3]
    if profile is not None:
        colours = profile.from_rec_709(colours)
    # (As colours.max(axis=2), in a fifth of the time.)
    red, green, blue = np.moveaxis(colours, 2, 0)
    peak = np.clip(np.maximum(np.maximum(red, green), blue)[..., None], KNEE, 1)
    over = peak - image.dtype.type(KNEE)
    factor = (KNEE + over / (1 - _steepness(limit) * over)) / peak
    result = image.copy()
    result[:, :, :3] *= factor.astype(image.dtype)
    return result


def compress_peaks(peaks: NDArray[Any], expand: float) -> NDArray[Any]:
    """Return the largest components of colours as they are before `expand_highlights`.

    Values up to the knee, and all with an expansion of 1, stay as they are. Values above the
    expansion, which light adds, come out above 1.
    """
    if expand == 1:
        return peaks
    over = np.maximum(peaks - peaks.dtype.type(KNEE), 0)
    return np.where(over > 0, KNEE + over / (1 + _steepness(expand) * over), peaks)


def _steepness(limit: float) -> float:
    return 1 / (1 - KNEE) - 1 / (limit - KNEE)


def expand_photograph(picture: Picture, expand: float | None) -> Picture:
    """Return a decoded picture with its highlights expanded, if the file has clipped ones."""
    if picture.highlights is not Highlights.CLIPPED:
        return picture
    pixels = expand_highlights(picture.pixels, expand, picture.profile)
    return replace(picture, pixels=pixels, expand=check_expansion(expand))
