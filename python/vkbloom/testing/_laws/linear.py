"""Laws of a linear filter: mixtures, flat images and mirrored images."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from vkbloom.testing._deviations import compare_with_law, figure, judge, raise_coarse
from vkbloom.testing._laws.law import Figure, Law, Limits
from vkbloom.testing._probe import Error, Image, Probe, call
from vkbloom.testing._subject import Subject

__tracebackhide__ = True

# A wrong gain that must be seen where the law counts as held.
_SEEN_GAIN: Final = 0.025
# Gains that are 1 but for roundings; and the values whose mean gain is measured.
_NEARLY: Final = 5e-3
_VALUES: Final = 16
_SWAPPED: Final = {"x": "left and right", "y": "top and bottom", "xy": "rows and columns"}
_OFF: Final = "largest difference of a value"


def _test_superposition(subject: Subject, limits: Limits) -> None:
    """Compare the bloom of a mixture of two images of noise with the mixture of their blooms."""
    probe, bloom = subject.probe, subject.bloom
    a, b, (half, quarter) = _mixture(probe)
    whole, whole_error = probe.apply(bloom, half * a + quarter * b)
    of_a, error_a = probe.apply(bloom, a)
    of_b, error_b = probe.apply(bloom, b)
    law = "B(a / 2 + b / 4) = B(a) / 2 + B(b) / 4"
    error = whole_error + half * error_a + quarter * error_b
    expected = half * of_a + quarter * of_b
    compare_with_law(probe, law, whole, expected, error, limit=limits["off"])


def _mixture(probe: Probe) -> tuple[Image, Image, tuple[float, float]]:
    """Return two images and their shares in a mixture, all of which the bloom can be given."""
    if probe.is_coarse:
        # Where one is lit, the other is black, so that the mixture has no values but these.
        lit, value = (
            probe.noise(0, probe.value),
            float(probe.quantize(probe.flat(probe.value)).max()),
        )
        shares = [float(probe.quantize(probe.flat(value * x)).max()) / value for x in (0.5, 0.25)]
        return lit, value - lit, (shares[0], shares[1])
    # Otherwise the dtype would round halves and quarters of the values in the test images.
    a, b = (_divisible_by_four(probe, probe.noise(index, probe.value)) for index in (0, 1))
    return a, b, (0.5, 0.25)


def _divisible_by_four(probe: Probe, image: Image) -> Image:
    """Round values so that the sum of half of one and a quarter of another is exact.

    Integers are rounded to multiples of four levels, floats to 256 levels; float16 represents an
    eighth of such a level exactly.
    """
    levels = np.iinfo(probe.dtype).max / 4 if probe.dtype.kind == "u" else 256 / probe.value
    whole: Image = np.floor(image * levels + 1e-9) / levels
    return whole


#: Additivity and homogeneity (Oppenheim and Willsky, "Signals and Systems", chapter 1).
SUPERPOSITION: Final = Law(
    name="superposition",
    test=_test_superposition,
    formula="B(a / 2 + b / 4) = B(a) / 2 + B(b) / 4",
    figures={"off": Figure(_OFF, 0.0)},
    why="A threshold, a clamp, a firefly filter and a median are not linear. They break this law "
    "on purpose.",
)


def _test_gain(subject: Subject, limits: Limits) -> None:
    """Compare flat images of the probe's value, half and a quarter of it with the gain.

    Where values have few levels, those of the darker images are the coarser ones: the brightest one
    decides what is seen.
    """
    figure("gain", subject.measured_gain)
    gain = subject.measured_gain if subject.gain is None else subject.gain
    accuracy = subject.gain_error if subject.gain is None else 0.0
    probe = subject.probe
    for part, seen in ((1.0, _SEEN_GAIN), (0.5, math.inf), (0.25, math.inf)):
        image = probe.quantize(_divisible_by_four(probe, probe.flat(probe.value)) * part)
        result, error = probe.apply(subject.bloom, image)
        law = f"B(v) = {gain:.6g} v, for a flat image of v = {image.flat[0]:.6g}"
        error = error + accuracy * image
        compare_with_law(probe, law, result, gain * image, error, limit=limits["off"], seen=seen)
    if subject.gain is not None or abs(gain - 1) < _NEARLY:
        _compare_mean_gain(subject, 1.0 if subject.gain is None else gain, limits["bias"])


def _compare_mean_gain(subject: Subject, promised: float, limit: float) -> None:
    """Compare the mean gain of many values, since truncated half floats lose light in each pass."""
    probe = subject.probe
    flat = probe.as_input(probe.flat(probe.value))
    if not promised or np.asarray(call(subject.bloom, flat)).dtype != np.float16:
        return
    shares = np.random.default_rng(probe.seed).uniform(0.5, 1.0, _VALUES)
    gains = []
    x, y = probe.centre
    for value in shares * probe.value:
        given = probe.as_input(probe.flat(value))
        result, _ = probe.values(call(subject.bloom, given), given)
        gains.append(float(result[y, x].mean()) / float(probe.values_of(given)[y, x].mean()))
    off = float(np.mean(gains)) / promised - 1
    text = f"the mean gain of {_VALUES} values is off by {100 * off:+.3g} %: {100 * limit:.2g} % "
    law = "half floats are rounded, not truncated"
    judge(law, ("bias", abs(off), limit, f"{text}allowed"))


GAIN: Final = Law(
    name="gain",
    test=_test_gain,
    formula="B(v) = gain v at every pixel of a flat image, with the gain that is promised, or with "
    "that of its middle",
    figures={
        "gain": Figure("gain of a flat image, in its middle"),
        "off": Figure(_OFF, 0.0),
        # Truncated half floats have a mean error of -0.035 %, rounded ones of 0.
        "bias": Figure("of half floats, the error of the mean gain of many values", 2e-4),
    },
    why="With a threshold, the gain depends on the value. A method that reads black outside the "
    "image loses light at the border. A bloom of another strength promises another gain.",
)


def _test_mirrored(subject: Subject, axes: Sequence[str], limits: Limits) -> None:
    """Compare the bloom of a mirrored image of noise with the mirrored bloom.

    A kernel that is not symmetric breaks the law, and so does a shift by a part of a pixel, such as
    a missing half texel. `axes` are those of `limits`, in the same order.
    """
    bloom, probe = subject.bloom, subject.probe
    image = probe.noise(0, probe.value)
    result, error = probe.apply(bloom, image)
    for axis, (name, limit) in zip(axes, limits.items(), strict=True):
        if math.isinf(limit):
            continue
        mirrored, mirrored_error = probe.apply(bloom, _mirror(image, axis))
        law = f"{_SWAPPED[axis]} swapped before or after the bloom are the same"
        errors = error + _mirror(mirrored_error, axis)
        back = _mirror(mirrored, axis)
        compare_with_law(probe, law, back, result, errors, limit=limit, name=name)
        if probe.is_coarse and axis != "xy":
            _check_shift_seen(probe, result, errors, 1 if axis == "x" else 0)


def _check_shift_seen(probe: Probe, result: Image, allowed: Error, axis: int) -> None:
    """Raise ValueError if half a texel, a pixel from one side to the other, is not seen."""
    change = np.abs(np.diff(result, axis=axis))
    errors = np.take(np.broadcast_to(allowed, result.shape), range(1, result.shape[axis]), axis)
    if not (change > errors).any():
        text = f"half a texel would change values by {change.max():.3g}, within their errors"
        raise_coarse(probe, text)


def _mirror(image: Error, axis: str) -> Image:
    """Return an image, or the errors of its values, with two sides swapped."""
    image = np.asarray(image)
    if not image.ndim:
        return image
    if axis == "xy":
        return image.swapaxes(0, 1)
    return np.flip(image, 1 if axis == "x" else 0)


SYMMETRIC: Final = Law(
    name="symmetric",
    test=lambda subject, limits: _test_mirrored(subject, ("x", "y"), limits),
    formula="B(M a) = M B(a), where M swaps left and right, or top and bottom",
    figures={
        "x": Figure("largest difference of a value, left and right swapped", 0.0),
        "y": Figure("the same, top and bottom swapped", 0.0),
    },
    why="An even number of taps, a missing half texel and boxes of an odd number of pixels are not "
    "the same from both sides.",
)

TRANSPOSED: Final = Law(
    name="transposed",
    test=lambda subject, limits: _test_mirrored(subject, ("xy",), limits),
    formula="B(M a) = M B(a), where M swaps rows and columns",
    figures={"off": Figure(_OFF, 0.0)},
    why="Blades, streaks and passes of different widths along x and y treat rows and columns "
    "differently.",
)
