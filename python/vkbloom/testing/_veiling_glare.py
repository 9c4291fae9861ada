"""Veiling glare: how much light a bloom scatters into a black patch of a bright field."""

from __future__ import annotations

import math

from vkbloom._argument_types import checked
from vkbloom._checks import check_number, check_size
from vkbloom.testing._probe import Bloom, Probe

__tracebackhide__ = True


@checked
def veiling_glare_index(
    bloom: Bloom,
    *,
    size: tuple[int, int] = (256, 256),
    patch: int | tuple[int, int] = 32,
    value: float = 1.0,
) -> float:
    """Return the veiling glare index of a bloom in percent.

    It is 100 times the mean of a black patch in the middle of a bright field, divided by the
    field's value, as lenses are measured (ISO 9358, with a square in place of a disc).

    Parameters
    ----------
    bloom : callable
        Takes an image and returns one of the same height and width: the bloom alone, or the
        picture with its bloom.
    size : (int, int)
        Width and height of the image in pixels.
    patch : int or (int, int)
        Side, or width and height, of the patch in pixels, less than the image's.
    value : float
        The field's value, above 0.

    Returns
    -------
    float
        0 without glare; the bloom's share of the light far from the patch is near 100 times its
        gain.
    """
    probe = Probe(size=size)
    width, height = check_size("patch", (patch, patch) if isinstance(patch, int) else patch)
    if width >= probe.size[0] or height >= probe.size[1]:
        raise ValueError(f"patch: {(width, height)} is not smaller than the size, {probe.size}")
    check_number("value", value, math.ulp(0.0), float("3e38"))
    left, top = (probe.size[0] - width) // 2, (probe.size[1] - height) // 2
    inside = (slice(top, top + height), slice(left, left + width))
    field = probe.flat(value)
    field[inside] = 0.0
    return 100 * float(probe.apply(bloom, field)[0][inside].mean()) / value
