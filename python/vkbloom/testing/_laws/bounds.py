"""Laws of the range of values: what a bloom adds at most, and what at least."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from vkbloom.testing._deviations import compare_with_law
from vkbloom.testing._laws.law import Figure, Law, Limits
from vkbloom.testing._subject import Subject

__tracebackhide__ = True

# Values of a bright pixel, and the period of its positions along each axis: the result of a chain
# of halved images depends on the position.
_BRIGHTNESS: Final = (10.0, 1e3, 6e4)
_PERIOD: Final = 2


def _test_no_ringing(subject: Subject, limits: Limits) -> None:
    """Look for dark and bright lines beside a step from black to bright, along x and along y.

    There are none if no weight of the kernel is negative (Mitchell and Netravali, "Reconstruction
    Filters in Computer Graphics", SIGGRAPH 1988, on ringing).
    """
    bloom, probe, limit = subject.bloom, subject.probe, limits["off"]
    dark, dark_error = subject.dark
    bright, bright_error = probe.apply(bloom, probe.flat(probe.value))
    x, y = probe.centre
    for axis, across, first in ((1, "x", (x, 0)), (0, "y", (0, y))):
        step = probe.point(first, probe.value, probe.size)
        result, error = probe.apply(bloom, step)
        law = f"a step along {across} stays between the bloom of black and of the flat image"
        errors = error + np.maximum(dark_error, bright_error)
        compare_with_law(probe, law, result, np.clip(result, dark, bright), errors, limit=limit)
        # The running maximum. No later value may be lower.
        law = f"along {across}, values only rise across a step from black to bright"
        highest = np.maximum.accumulate(result, axis=axis)
        compare_with_law(probe, law, result, highest, 2 * error, limit=limit)


NO_RINGING: Final = Law(
    name="no_ringing",
    test=_test_no_ringing,
    formula="across a step from black to bright, values rise, and stay between those of the flat "
    "images",
    figures={"off": Figure("largest difference of a value", 0.0)},
    why="Negative weights ring, as in a sharpening filter. A method that reads black outside the "
    "image darkens the border.",
)


def _test_fireflies(subject: Subject, limits: Limits) -> None:
    """Look for pixels that a very bright one on a dark image brightens.

    Methods limit it by a clamp, or by an average weighted by 1 / (1 + luminance) (Karis, "Tone
    Mapping", 2013).
    """
    probe, limit = subject.probe, limits["off"]
    if probe.levels is not None:
        raise ValueError(f"cannot be tested in {probe.levels.reason}: no value is above 1")
    if probe.dtype.kind == "u":
        raise ValueError(f"probe: {probe.dtype} has no values above 1")
    period = min(_PERIOD, *probe.size)
    left, top = (max(0, side // 2 - period // 2) for side in probe.size)
    dark, dark_error = subject.dark
    for light in _BRIGHTNESS:
        for position in ((left + x, top + y) for y in range(period) for x in range(period)):
            image = probe.point(position, light)
            result, error = probe.apply(subject.bloom, image, exempt=position)
            place = f"a pixel of {light:g} at x {position[0]}, y {position[1]}"
            law = f"{place} brightens others by {limit:g} at most"
            errors = error + dark_error
            compare_with_law(probe, law, result, np.minimum(result, dark), errors, limit=limit)


BOUNDED_FIREFLIES: Final = Law(
    name="bounded_fireflies",
    test=_test_fireflies,
    formula="a bright pixel brightens others by the limit at most",
    figures={"off": Figure("largest increase of another pixel", 1.0)},
    why="A linear bloom spreads a share of any brightness. Only a clamp, or an average weighted by "
    "1 / (1 + luminance), limits it.",
)


def _test_additive(subject: Subject, limits: Limits) -> None:
    """Compare the picture with its bloom with the image plus the bloom, for an image of noise.

    Glare in a camera or an eye adds light (Spencer et al., "Physically-Based Glare Effects for
    Digital Images", SIGGRAPH 1995).
    """
    limit = limits["off"]
    if subject.picture is not None and subject.intensity is not None:
        probe, intensity = subject.probe, subject.intensity
        image = probe.noise(0, probe.value)
        picture, error = probe.apply(subject.picture, image)
        light, light_error = probe.apply(subject.bloom, image)
        law = f"F(a) = a + {intensity:g} G(a)"
        errors = error + intensity * light_error
        compare_with_law(probe, law, picture, image + intensity * light, errors, limit=limit)
        return
    probe = subject.picture_probe
    image = probe.noise(0, probe.value)
    picture, error = probe.apply(subject.picture or subject.bloom, image)
    law = "F(a) >= a: light is added, and none is removed"
    compare_with_law(probe, law, picture, np.maximum(picture, image), error, limit=limit)


ADDITIVE: Final = Law(
    name="additive",
    test=_test_additive,
    formula="F(a) = a + intensity G(a); where the bloom G is not known apart, F(a) >= a",
    figures={"off": Figure("largest difference of a value", 0.0)},
    why="The bloom alone lacks the image. The composite mix takes light from bright pixels, and "
    "screen and a tone curve compress it.",
)


def _test_unclamped(subject: Subject, limits: Limits) -> None:
    """One-sided, so that a threshold holds the law: it only takes light from dark pixels."""
    bloom, probe = subject.bloom, subject.probe
    if probe.levels is not None:
        raise ValueError(f"cannot be tested in {probe.levels.reason}: files of integers end at 1")
    highest = min(subject.highest, 1.0 if probe.dtype.kind == "u" else math.inf)
    factor = 2.0 ** round(math.log2(highest / probe.value))
    if not factor > 1:
        raise ValueError(f"probe: values above {probe.value:g} cannot be given to this bloom")
    image = probe.noise(0, probe.value)
    small, small_error = probe.apply(bloom, image)
    large, large_error = probe.apply(bloom, factor * image)
    law = f"B({factor:g} a) >= {factor:g} B(a): bright pixels are not clamped"
    errors = large_error + factor * small_error
    expected = np.maximum(large, factor * small)
    compare_with_law(probe, law, large, expected, errors, limit=limits["off"])


UNCLAMPED: Final = Law(
    name="unclamped",
    test=_test_unclamped,
    formula="B(k a) >= k B(a), for k a of values up to 1024",
    figures={"off": Figure("largest light that a value lacks", 0.0)},
    why="A clamp, a tone curve and a firefly filter limit bright pixels on purpose, and files and "
    "buffers of 8 bits end at 1.",
)
