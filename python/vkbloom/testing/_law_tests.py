"""The tests of the laws: each takes a subject and its limit.

A test raises AssertionError if the law does not hold, and ValueError if it cannot be tested. To add
a law, write its test here and its row in `_law_table`.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Final

import numpy as np

from vkbloom.testing import _laws as laws
from vkbloom.testing import _moving_light as moving_light
from vkbloom.testing import _point_spread as point_spread
from vkbloom.testing import _scaled_scene as scaled_scene
from vkbloom.testing import _shape as shape
from vkbloom.testing._deviations import compare_with_law, figure, judge
from vkbloom.testing._probe import Bloom, Probe, call
from vkbloom.testing._subject import TEXEL, Subject

# A mean shift that is named, in pixels.
_SHIFT: Final = 0.05
_COLOUR: Final = (1.0, 0.5, 0.25)
# Gains that are 1 but for roundings; the values whose mean gain is measured; and its limit.
# Truncated half floats have a mean error of -0.035 %, rounded ones of 0.
_NEARLY: Final = 5e-3
_VALUES: Final = 16
_BIAS: Final = 2e-4


def gain(subject: Subject, limit: float) -> None:
    figure("gain", subject.measured_gain)
    promised = subject.measured_gain if subject.gain is None else subject.gain
    accuracy = subject.gain_error if subject.gain is None else 0.0
    laws.check_gain(subject.bloom, promised, subject.probe, accuracy)
    if subject.gain is not None or abs(promised - 1) < _NEARLY:
        _unbiased(subject, 1.0 if subject.gain is None else promised)


def _unbiased(subject: Subject, promised: float) -> None:
    """Compare the mean gain of many values, since truncated half floats lose light in each pass."""
    probe = subject.probe
    flat = probe.given(probe.flat(probe.value))
    if not promised or np.asarray(call(subject.bloom, flat)).dtype != np.float16:
        return
    shares = np.random.default_rng(probe.seed).uniform(0.5, 1.0, _VALUES)
    gains = []
    x, y = probe.centre
    for value in shares * probe.value:
        given = probe.given(probe.flat(value))
        result, _ = probe.values(call(subject.bloom, given), given)
        gains.append(float(result[y, x].mean()) / float(probe.values_of(given)[y, x].mean()))
    off = float(np.mean(gains)) / promised - 1
    text = f"the mean gain of {_VALUES} values is off by {100 * off:+.3g} %: {100 * _BIAS:.2g} % "
    law = "half floats are rounded, not truncated"
    judge(law, ("bias", abs(off), _BIAS, f"{text}allowed"))


def centroid_kept(subject: Subject, limit: float) -> None:
    _lit(subject)
    point_spread.assert_centroid_kept(subject.bloom, subject.probe, within=limit)


def separable(subject: Subject, limit: float) -> None:
    _lit(subject)
    point_spread.assert_separable(subject.bloom, subject.probe)


def _lit(subject: Subject) -> None:
    spread, error = subject.light
    if not spread.max(axis=(0, 1)).min() > np.min(error):
        raise ValueError("the bloom of a pixel is black, as after a median or a threshold")


def bounded_fireflies(subject: Subject, limit: float) -> None:
    if subject.probe.dtype.kind == "u":
        raise ValueError(f"probe: {subject.probe.dtype} has no values above 1")
    laws.assert_bounded_fireflies(subject.bloom, limit, subject.probe)


def additive(subject: Subject, limit: float) -> None:
    if subject.picture is not None and subject.intensity is not None:
        laws.assert_additive(subject.picture, subject.bloom, subject.intensity, subject.probe)
    else:
        laws.assert_additive(subject.picture or subject.bloom, probe=subject.picture_probe)


def unclamped(subject: Subject, limit: float) -> None:
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
    allowed = large_error + factor * small_error
    compare_with_law(probe, law, large, np.maximum(large, factor * small), allowed)


def energy(subject: Subject, limit: float) -> None:
    if subject.measured_gain > 0:
        _lit(subject)
    probe = subject.probe
    point_spread.check_inside(point_spread.border_share(subject.light[0]), probe.size)
    energy, (error, rounded_to_black) = subject.energy
    figure("energy", energy)
    promised = 1.0 if subject.gain is None else subject.gain
    off, allowed = abs(energy - promised), limit * max(promised, energy)
    # Light that is missing may lie below the first level.
    if energy < promised and off > allowed - error:
        error += rounded_to_black
    law = f"the bloom of a lit pixel has {promised:.4g} times the light of the pixel"
    text = f"{energy:.4g} instead of {promised:.4g}: off by {off:.3g}, {allowed:.3g} allowed"
    judge(law, ("off", off, allowed, text, error), probe=probe)


def _coloured(probe: Probe) -> None:
    if probe.colours < len(_COLOUR):
        raise ValueError(f"probe: {probe.colours} channel has no colour; 3 channels are needed")


def colour(subject: Subject, limit: float) -> None:
    _coloured(subject.probe)
    probe = subject.probe
    image = probe.stored(probe.flat(probe.value) * np.array(_COLOUR))
    result, error = probe.apply(subject.bloom, image)
    expected = image * (result.mean() / image.mean())
    # The mean has an error of its own, where values have few levels.
    allowed = error if probe.levels is None else error + image / image.mean() * np.mean(error)
    law = "all channels of a flat coloured image get the same gain"
    compare_with_law(probe, law, result, expected, allowed)


def grey(subject: Subject, limit: float) -> None:
    _coloured(subject.probe)
    probe = subject.probe
    image = probe.noise(0, probe.value)[..., :1].repeat(3, axis=2)
    result, error = probe.apply(subject.bloom, image)
    expected = np.broadcast_to(result.mean(axis=2, keepdims=True), result.shape)
    law = "the bloom of a grey image is grey: all channels spread alike"
    compare_with_law(probe, law, result, expected, 2 * error)


def channels(subject: Subject, limit: float) -> None:
    probe = subject.probe
    _coloured(probe)
    dark, dark_error = probe.apply(subject.bloom, probe.flat(0.0))
    for channel in range(3):
        image = probe.noise(0, probe.value) * (np.arange(3) == channel)
        result, error = probe.apply(subject.bloom, image)
        expected = np.where(np.arange(3) == channel, result, dark)
        law = f"the bloom of light in channel {channel} is in channel {channel}"
        compare_with_law(probe, law, result, expected, error + dark_error)


def stability(subject: Subject, limit: Mapping[str, float]) -> None:
    subject.probe.check_fine("the bloom of a light smaller than a pixel has a few levels")
    result = subject.stability
    if not result.energy.max() > 0:
        raise ValueError("the bloom of a small light is black")
    # Without a figure, such as the radius of a negative variance, there is nothing to judge.
    known = {name: item for name, item in limit.items() if math.isfinite(getattr(result, name))}
    try:
        moving_light.check_stable(result, known, subject.lamp)
    except ValueError:
        # At each pixel of the path, no more light leaves the image than lies in its outermost
        # pixels. So energy and peak may still be wrong by more than that; place and width may not.
        lost = TEXEL * result.at_border
        judged = ("ripple", "shimmer")
        loose = {name: known[name] + lost for name in known if name in judged}
        whole = dataclasses.replace(result, at_border=0.0)
        moving_light.check_stable(whole, loose, subject.lamp)
        raise


def resolution(subject: Subject, limit: Mapping[str, float]) -> None:
    result = subject.resolution
    if not all(values.mean() > 0 for values in (result.r50, result.r90, result.peak)):
        raise ValueError("the bloom of a light is black at some size")
    scaled_scene.check_independent(result, limit["radius"], limit["peak"], subject.probe)


def round_contours(subject: Subject, limit: float) -> None:
    subject.probe.check_fine("a hundredth of the peak of the bloom of a pixel is below a level")
    shape.check_round(subject.spread, limit)


def finite(subject: Subject, limit: float) -> None:
    probe = subject.probe
    if probe.dtype.kind == "u" or probe.levels is not None:
        where = str(probe.dtype) if probe.levels is None else probe.levels.reason
        raise ValueError(f"cannot be tested in {where}: integers are neither NaN nor infinity")
    law = "NaN and infinity of a pixel do not reach others"
    x, y = probe.centre
    blooms: dict[str, Bloom] = {"bloom": subject.bloom}
    if subject.picture is not None:
        blooms["picture"] = subject.picture
    for value in (math.nan, math.inf, -math.inf):
        image = probe.noise(0, probe.value)
        image[y, x] = value
        for name, bloom in blooms.items():
            result = np.asarray(call(bloom, probe.given(image)))
            reached = ~np.isfinite(result.reshape(*result.shape[:2], -1)).all(axis=2)
            reached[y, x] = False
            count = int(reached.sum())
            text = f"{value} at x {x}, y {y} reaches {count} other pixels of the {name}: "
            judge(law, (name, count, limit, f"{text}{limit:g} allowed"))


def reference(subject: Subject, limit: float) -> None:
    if subject.differences is None:
        raise ValueError("the bloom has no reference")
    law = "each framebuffer is that of the reference"
    end = f"of its largest value, {limit:g} allowed"
    result = subject.reference.items()
    judge(law, *((name, off, limit, f"{name} is off by {off:.3g} {end}") for name, off in result))


def shift_explained(subject: Subject, why: str) -> str:
    """Return how far all light is shifted on average over all positions; `why` if it is not."""
    bloom, probe = subject.bloom, subject.probe
    # All positions of a period at once: a square whose side is a multiple of it.
    side = 2 ** int(math.log2(max(1, min(probe.size) // 4)))
    left, top = ((length - side) // 2 for length in probe.size)
    square = probe.point((left, top), probe.value, (side, side))
    lit = probe.apply(bloom, square)[0] - probe.apply(bloom, probe.flat(0.0))[0]
    to, start = (moving_light.moments(light.mean(axis=2))[1] for light in (lit, square))
    mean = np.subtract(to, start)
    parts = []
    for axis, shift in zip("xy", mean, strict=True):
        figure(f"shift_{axis}", float(shift))
        if abs(shift) > _SHIFT:
            parts.append(f"{shift:+.3g} pixels along {axis}")
    if not parts:
        return why
    return (
        f"All light is shifted by {' and '.join(parts)}, on average over all positions. A chain of "
        "halved images moves light by nothing on average: a shift of half a texel comes from a "
        "pass that reads the corner of a pixel in place of its middle."
    )
