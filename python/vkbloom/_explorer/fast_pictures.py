"""Framebuffers as PNG, optimized for speed: the sRGB curve is a table."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._io.displayed import scale_to_1
from vkbloom._views import pictures

if TYPE_CHECKING:
    from vkbloom._settings.settings import Encoding

# Compression level of zlib. The pictures go to a browser on this machine or through a notebook
# server, where compressing takes longer than sending a larger file.
_LEVEL: Final = 1


def picture_of(
    array: NDArray[Any], name: str, *, encoding: Encoding, stops: float, expand: float = 1.0
) -> bytes:
    """Return a framebuffer as PNG, shown as in `pictures.picture`, without alpha.

    - `encoding`: That of `final` in the settings.
    - `expand`: What `final` is compressed from. Brightened or darkened, it is shown as light.
    """
    levels = picture_levels(array, name, encoding=encoding, stops=stops, expand=expand)
    return pictures.png(levels, _LEVEL)


def picture_levels(
    array: NDArray[Any], name: str, *, encoding: Encoding, stops: float, expand: float = 1.0
) -> NDArray[np.uint8]:
    """Return the 8-bit levels of `picture_of`."""
    if array.dtype == np.uint8:
        picture: NDArray[np.uint8] = array[:, :, :3]
    elif array.ndim == 3 and name not in ("normal", "position"):
        encoding = encoding if name == "final" else "none"
        colours = array[:, :, :3]
        if encoding == "none":
            is_final = name == "final" and stops == 0
            colours = scale_to_1(colours, 2.0**-stops, expand=expand if is_final else 1.0)
        with np.errstate(over="ignore"):
            halves = np.ascontiguousarray(colours).astype(np.float16, copy=False)
        picture = _levels(stops, encoding)[halves.view(np.uint16)]
    else:
        picture = pictures.picture(array, name)[:, :, :3]
    return picture


@functools.lru_cache(maxsize=16)
def _levels(stops: float, encoding: Encoding) -> NDArray[np.uint8]:
    """Return the 8-bit level of every half float, by its bits."""
    halves = np.arange(1 << 16, dtype=np.uint16).view(np.float16).reshape(1, -1, 1)
    with np.errstate(all="ignore"):
        colours = halves.repeat(3, axis=2)
        shown = pictures.picture(colours, encoding=encoding, stops=stops)
    return shown[0, :, 0]
