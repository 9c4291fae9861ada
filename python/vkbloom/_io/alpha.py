"""Colours and alpha of pictures: multiply, divide, and find the light where alpha is 0."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._arrays import saturate
from vkbloom._io.narrowing import narrow
from vkbloom._io.picture import Picture

# Hidden light of less than this share of the visible light does not show.
_TRIFLE: Final = 0.05


def multiply(values: NDArray[Any]) -> NDArray[Any]:
    """Return colours multiplied by alpha, in the same dtype."""
    return _with_alpha(values, values[:, :, -1:])


def divide(values: NDArray[Any]) -> NDArray[Any]:
    """Return colours divided by alpha, in the same dtype; unchanged where alpha is 0."""
    alpha = values[:, :, -1:].astype(np.float32)
    unit = np.float32(1 if values.dtype.kind == "f" else np.iinfo(values.dtype).max)
    return _with_alpha(
        values, np.where(alpha == 0, unit, unit * unit / np.where(alpha, alpha, unit))
    )


def _with_alpha(values: NDArray[Any], factor: NDArray[Any]) -> NDArray[Any]:
    """Return values with colours times a factor; for integers, times factor / largest value."""
    made = values.astype(np.float32)
    with np.errstate(over="ignore", invalid="ignore"):
        made[:, :, :-1] *= factor
    if values.dtype.kind == "u":
        largest = np.iinfo(values.dtype).max
        made[:, :, :-1] = np.rint(np.minimum(made[:, :, :-1] / largest, largest))
        return made.astype(values.dtype)
    # Colours divided by a small alpha may be beyond the range of their type.
    return narrow(saturate(made, np.isfinite(values)), values.dtype)


def hidden_notes(picture: Picture) -> tuple[str, ...]:
    """Return a note about light where a decoded picture's alpha is 0, if it is no trifle."""
    if not picture.has_straight:
        return ()
    pixels = picture.pixels
    hidden, total = (_sum_of(some) for some in (pixels[pixels[:, :, 3] == 0], pixels))
    if hidden <= _TRIFLE * (total - hidden):
        return ()
    share = 100 * hidden / total
    return (
        f"{share:.0f} % of its light lie where alpha is 0, and bloom like the visible ones; "
        'premultiplied colours with alpha "blur" (--alpha blur) leave them out',
    )


def _sum_of(pixels: NDArray[Any]) -> float:
    colours = pixels[..., :3]
    is_light = (colours > 0) & (colours < np.inf)
    return float(np.sum(colours, where=is_light, dtype=np.float64))
