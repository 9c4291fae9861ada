"""Laws of a complete blur or bloom, for any callable that maps an image to an image.

The message of a failed assertion has the law, the largest deviation with its position, and the
expected value there. The allowed deviation is the sum of the errors of all values that a law uses;
`vkbloom.testing.Probe` defines the error of a single value.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, Literal

import numpy as np

from vkbloom._argument_types import checked
from vkbloom._numbers import check_number
from vkbloom._public import public
from vkbloom.testing._deviations import compare_with_law, raise_coarse
from vkbloom.testing._probe import DEFAULT, Bloom, Error, Image, Probe

__tracebackhide__ = True

# A wrong gain that must be seen where the law counts as held.
_SEEN_GAIN: Final = 0.025
_SWAPPED: Final = {"x": "left and right", "y": "top and bottom", "xy": "rows and columns"}


@public("vkbloom.testing")
@checked
def assert_superposition(bloom: Bloom, probe: Probe = DEFAULT) -> None:
    """Assert that the bloom of a mixture of two images is the mixture of their blooms.

    The law: B(a / 2 + b / 4) = B(a) / 2 + B(b) / 4, for two images of noise. This is linearity:
    additivity and homogeneity (Oppenheim and Willsky, "Signals and Systems", chapter 1). A method
    with a threshold, a clamp or a firefly filter is not linear.
    """
    a, b, (half, quarter) = _mixture(probe)
    whole, whole_error = probe.apply(bloom, half * a + quarter * b)
    of_a, error_a = probe.apply(bloom, a)
    of_b, error_b = probe.apply(bloom, b)
    law = "B(a / 2 + b / 4) = B(a) / 2 + B(b) / 4"
    allowed = whole_error + half * error_a + quarter * error_b
    compare_with_law(probe, law, whole, half * of_a + quarter * of_b, allowed)


def _mixture(probe: Probe) -> tuple[Image, Image, tuple[float, float]]:
    """Return two images and their shares in a mixture, all of which the bloom can be given."""
    if probe.is_coarse:
        # Where one is lit, the other is black, so that the mixture has no values but these.
        lit, value = probe.noise(0, probe.value), float(probe.stored(probe.flat(probe.value)).max())
        shares = [float(probe.stored(probe.flat(value * x)).max()) / value for x in (0.5, 0.25)]
        return lit, value - lit, (shares[0], shares[1])
    # Otherwise the dtype would round halves and quarters of the values in the test images.
    a, b = (_divisible_by_four(probe, probe.noise(index, probe.value)) for index in (0, 1))
    return a, b, (0.5, 0.25)


@public("vkbloom.testing")
@checked
def assert_additive(
    bloom: Bloom,
    glow: Bloom | None = None,
    intensity: float = 1.0,
    probe: Probe = DEFAULT,
) -> None:
    """Assert that an image with bloom is the image plus the bloom.

    The law: F(a) = a + intensity * G(a), for an image of noise, where F is the image with bloom
    and G the bloom alone. This is additive blending, as glare in a camera or an eye adds light
    (Spencer et al., "Physically-Based Glare Effects for Digital Images", SIGGRAPH 1995). Without G
    the law is F(a) >= a: light is added and none is removed. The composite "mix" removes light from
    bright pixels, so it does not obey this law.

    Parameters
    ----------
    bloom : callable
        Maps an image to the image with bloom.
    glow : callable, optional
        Maps an image to the bloom alone.
    intensity : float
        Factor of the bloom, 0 or more.
    probe : Probe
        With integers, `value` must be low enough that image plus bloom is not clamped.
    """
    check_number("intensity", intensity, 0.0, math.inf)
    image = probe.noise(0, probe.value)
    picture, error = probe.apply(bloom, image)
    if glow is None:
        law = "F(a) >= a: light is added, and none is removed"
        compare_with_law(probe, law, picture, np.maximum(picture, image), error)
        return
    light, light_error = probe.apply(glow, image)
    law = f"F(a) = a + {intensity:g} G(a)"
    allowed = error + intensity * light_error
    compare_with_law(probe, law, picture, image + intensity * light, allowed)


@public("vkbloom.testing")
@checked
def assert_gain(bloom: Bloom, gain: float, probe: Probe = DEFAULT) -> None:
    """Assert the gain of flat images.

    The law: B(v) = gain * v at every pixel, for flat images of v = `probe.value`, half and a
    quarter of it. The gain is the sum of the kernel's weights. At the border it is the same if the
    method clamps to the edge. A gain of 1 keeps the energy.

    Parameters
    ----------
    bloom : callable
        Takes an image and returns one of the same height and width.
    gain : float
        The expected gain; `vkbloom.reference.gain` computes it for vkbloom's custom methods.
    probe : Probe
        With integers, `value` times `gain` must be at most 1.
    """
    check_number("gain", gain, 0.0, math.inf)
    check_gain(bloom, gain, probe)


def check_gain(bloom: Bloom, gain: float, probe: Probe, accuracy: float = 0.0) -> None:
    """Raise AssertionError if flat images have another gain; `accuracy` is that of a measured one.

    Where values have few levels, those of the darker images are the coarser ones: the brightest one
    decides what is seen.
    """
    for part, seen in ((1.0, _SEEN_GAIN), (0.5, math.inf), (0.25, math.inf)):
        image = probe.stored(_divisible_by_four(probe, probe.flat(probe.value)) * part)
        result, error = probe.apply(bloom, image)
        law = f"B(v) = {gain:.6g} v, for a flat image of v = {image.flat[0]:.6g}"
        allowed = error + accuracy * image
        compare_with_law(probe, law, result, gain * image, allowed, seen=seen)


@public("vkbloom.testing")
@checked
def assert_symmetric(
    bloom: Bloom,
    probe: Probe = DEFAULT,
    *,
    axes: Sequence[Literal["x", "y", "xy"]] = ("x", "y"),
) -> None:
    """Assert that the bloom of a mirrored image is the mirrored bloom.

    The law: B(M a) = M B(a), for an image of noise and each reflection M. A kernel that is not
    symmetric does not obey it, nor does a shift by a part of a pixel, such as a missing half texel.

    Parameters
    ----------
    bloom : callable
        Takes an image and returns one of the same height and width.
    probe : Probe
    axes : sequence of {"x", "y", "xy"}
        "x" swaps left and right, "y" top and bottom, "xy" rows and columns.
    """
    image = probe.noise(0, probe.value)
    result, error = probe.apply(bloom, image)
    for axis in axes:
        if axis not in _SWAPPED:
            raise ValueError(f"axes: {axis!r} is not one of {', '.join(_SWAPPED)}")
        mirrored, mirrored_error = probe.apply(bloom, _mirrored(image, axis))
        law = f"{_SWAPPED[axis]} swapped before or after the bloom are the same"
        allowed = error + _mirrored(mirrored_error, axis)
        compare_with_law(probe, law, _mirrored(mirrored, axis), result, allowed)
        if probe.is_coarse and axis != "xy":
            _check_shift_seen(probe, result, allowed, 1 if axis == "x" else 0)


def _check_shift_seen(probe: Probe, result: Image, allowed: Error, axis: int) -> None:
    """Raise ValueError if half a texel, a pixel from one side to the other, is not seen."""
    change = np.abs(np.diff(result, axis=axis))
    errors = np.take(np.broadcast_to(allowed, result.shape), range(1, result.shape[axis]), axis)
    if not (change > errors).any():
        text = f"half a texel would change values by {change.max():.3g}, within their errors"
        raise_coarse(probe, text)


@public("vkbloom.testing")
@checked
def assert_no_ringing(bloom: Bloom, probe: Probe = DEFAULT) -> None:
    """Assert that the bloom of an edge has no dark or bright line beside the edge.

    The law: across a step from black to `probe.value`, along x and along y, values do not decrease.
    They stay between the values of the black image and of the flat bright image. The law holds if
    no weight of the kernel is negative (Mitchell and Netravali, "Reconstruction Filters in Computer
    Graphics", SIGGRAPH 1988, on ringing).

    Parameters
    ----------
    bloom : callable
        Takes an image and returns one of the same height and width.
    probe : Probe
    """
    dark, dark_error = probe.apply(bloom, probe.flat(0.0))
    bright, bright_error = probe.apply(bloom, probe.flat(probe.value))
    x, y = probe.centre
    for axis, across, first in ((1, "x", (x, 0)), (0, "y", (0, y))):
        step = probe.point(first, probe.value, probe.size)
        result, error = probe.apply(bloom, step)
        law = f"a step along {across} stays between the bloom of black and of the flat image"
        allowed = error + np.maximum(dark_error, bright_error)
        compare_with_law(probe, law, result, np.clip(result, dark, bright), allowed)
        # The running maximum. No later value may be lower.
        law = f"along {across}, values only rise across a step from black to bright"
        highest = np.maximum.accumulate(result, axis=axis)
        compare_with_law(probe, law, result, highest, 2 * error)


@public("vkbloom.testing")
@checked
def assert_bounded_fireflies(
    bloom: Bloom,
    limit: float = 1.0,
    probe: Probe = DEFAULT,
    *,
    brightness: Sequence[float] = (10.0, 1e3, 6e4),
    period: int = 2,
) -> None:
    """Assert that one very bright pixel brightens other pixels by a limited amount.

    The law: with a pixel of brightness L on a dark image, no other pixel becomes brighter by more
    than `limit`, for each L and each position of the pixel. A linear bloom has no such limit,
    because it spreads a share of L. In an animation, such a pixel flickers. Methods limit the
    effect by a clamp, or by an average weighted by 1 / (1 + luminance) (Karis, "Tone Mapping",
    2013).

    Parameters
    ----------
    bloom : callable
        Takes an image and returns one of the same height and width.
    limit : float
        The largest allowed increase of another pixel, in real units.
    probe : Probe
        A probe of floats; `value` is not used.
    brightness : sequence of float
        The values of L. Infinity is allowed: it must not spread either.
    period : int
        The law is tested at period x period positions of the pixel, because the result of a chain
        of halved images depends on the position. Use 2 for one halving and 4 for two.
    """
    if probe.levels is not None:
        raise ValueError(f"cannot be tested in {probe.levels.reason}: no value is above 1")
    if probe.dtype.kind == "u":
        raise TypeError(f"probe: {probe.dtype} has no values above 1; use a float dtype")
    check_number("limit", limit, 0.0, math.inf)
    if not 1 <= period <= min(probe.size):
        raise ValueError(f"period: {period!r} is out of range, 1 to {min(probe.size)}")
    left, top = (max(0, side // 2 - period // 2) for side in probe.size)
    dark, dark_error = probe.apply(bloom, probe.flat(0.0))
    for light in brightness:
        for position in ((left + x, top + y) for y in range(period) for x in range(period)):
            image = probe.point(position, light)
            result, error = probe.apply(bloom, image, exempt=position)
            place = f"a pixel of {light:g} at x {position[0]}, y {position[1]}"
            law = f"{place} brightens others by {limit:g} at most"
            allowed = error + dark_error
            compare_with_law(probe, law, result, np.minimum(result, dark + limit), allowed)


def _divisible_by_four(probe: Probe, image: Image) -> Image:
    """Round values so that the sum of half of one and a quarter of another is exact.

    Integers are rounded to multiples of four levels, floats to 256 levels; float16 represents an
    eighth of such a level exactly.
    """
    levels = np.iinfo(probe.dtype).max / 4 if probe.dtype.kind == "u" else 256 / probe.value
    whole: Image = np.floor(image * levels + 1e-9) / levels
    return whole


def _mirrored(image: Error, axis: str) -> Image:
    """Return an image, or the errors of its values, with two sides swapped."""
    image = np.asarray(image)
    if not image.ndim:
        return image
    if axis == "xy":
        return image.swapaxes(0, 1)
    return np.flip(image, 1 if axis == "x" else 0)
