"""The point spread of a blur or bloom, and its veiling glare."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from vkbloom._argument_types import check_arguments
from vkbloom._numbers import check_number, check_size
from vkbloom._public import public
from vkbloom.testing._deviations import fail
from vkbloom.testing._probe import DEFAULT, Bloom, Error, Image, Probe

__tracebackhide__ = True

# Allowed share of a point's light in the outermost pixels. Clamping to the edge at most doubles
# that light, which moves a centroid by a thousandth of half the image.
_AT_THE_BORDER: Final = 1e-3


@public("vkbloom.testing")
@check_arguments
def point_spread(
    bloom: Bloom, probe: Probe = DEFAULT, *, at: tuple[int, int] | None = None
) -> Image:
    """Return the point-spread function of a bloom.

    h(x, y) = (B(v d) - B(0)) / v, where d is an image with one pixel of 1 and v the probe's value.
    A linear, shift-invariant blur is the convolution with h (Goodman, "Introduction to Fourier
    Optics", chapter 2).

    Parameters
    ----------
    bloom : callable
        Takes an image and returns one of the same height and width.
    probe : Probe
    at : (int, int), optional
        x and y of the pixel. Default: the middle of the image.

    Returns
    -------
    ndarray of float64, shape (H, W, C)
        h around the pixel `at`; it is not shifted to the middle.

    Examples
    --------
    >>> from vkbloom import reference, testing
    >>> settings = vkbloom.Separable(weights=(0.5, 0.25), blur_strength=1.0)
    >>> probe = testing.Probe(size=(9, 9))
    >>> spread = testing.point_spread(lambda image: reference.blur(image, settings), probe)
    >>> spread[3:6, 3:6, 0]
    array([[0.0625, 0.125 , 0.0625],
           [0.125 , 0.25  , 0.125 ],
           [0.0625, 0.125 , 0.0625]])
    """
    return measure_spread(bloom, probe, at)[0]


@public("vkbloom.testing")
@check_arguments
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


def measure_spread(
    bloom: Bloom,
    probe: Probe,
    at: tuple[int, int] | None = None,
    dark: tuple[Image, Error] | None = None,
    *,
    side: int = 1,
) -> tuple[Image, Error]:
    """Return the point spread and the error of its values; `dark` are those of a black image.

    With an odd `side`, that of a square around the pixel.
    """
    position = at or probe.centre
    if not all(0 <= number < side for number, side in zip(position, probe.size, strict=True)):
        raise ValueError(f"at: {at!r} is not inside an image of {probe.size}")
    first = (position[0] - side // 2, position[1] - side // 2)
    image = probe.quantize(probe.point(first, probe.value, (side, side)))
    lit, lit_error = probe.apply(bloom, image)
    black, dark_error = dark or probe.apply(bloom, probe.flat(0.0))
    value = float(image.max())
    return (lit - black) / value, (lit_error + dark_error) / value


def check_lit(spread: Image, errors: Error) -> None:
    """Raise AssertionError if the point spread is black."""
    error = float(np.min(errors))
    for channel in range(spread.shape[2]):
        largest = float(np.abs(spread[:, :, channel]).max())
        if largest <= error or not spread[:, :, channel].sum() > 0:
            text = f"the largest value in channel {channel} is {largest:.3g}; more than "
            fail("the bloom of a lit pixel is not black", f"{text}{error:.3g} is needed")


def check_inside(share: float, size: tuple[int, int], allowed: float = _AT_THE_BORDER) -> None:
    """Raise ValueError if too large a share of the light reaches the border of the image."""
    if share > allowed:
        raise ValueError(
            f"probe: of the light, {100 * share:.3g} % lies in the outermost pixels of an image of "
            f"{size[0]} x {size[1]}; a larger size is needed"
        )


def border_share(plane: Image) -> float:
    """Return the share of the light in the outermost pixels."""
    total = float(np.abs(plane).sum())
    inside = float(np.abs(plane[1:-1, 1:-1]).sum())
    return (total - inside) / total if total else 0.0


def sum_error(plane: Image, errors: Error) -> tuple[float, float]:
    """Return the errors of the sum of a plane: of its lit pixels, and of what is rounded to black.

    A rounding is half a level. Pixels of one value are rounded alike, so that errors add up.
    """
    half = np.broadcast_to(errors, plane.shape) / 2
    lit = np.abs(plane) > half / 2
    planes = plane.shape[2] if plane.ndim > 2 else 1
    return float(half[lit].sum()) / planes, float(half[~lit].sum()) / planes
