"""The laws of a bloom: one table, for `report`, for `vkbloom check` and for the docs."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._suggestions import did_you_mean
from vkbloom.testing import _border as border
from vkbloom.testing import _laws as laws
from vkbloom.testing import _moving_light as moving_light
from vkbloom.testing import _point_spread as point_spread
from vkbloom.testing import _scaled_scene as scaled_scene
from vkbloom.testing import _shape as shape
from vkbloom.testing import _time as in_time
from vkbloom.testing import _transparency as transparency
from vkbloom.testing._deviations import compare_with_law, fail, figure, is_within
from vkbloom.testing._probe import Bloom, Image, Probe
from vkbloom.testing._subject import TEXEL, Subject

__all__ = ["LAWS", "Law", "law_name"]

# Positions along the diagonal: a period of a chain of four halvings.
_PERIOD: Final = 16
# A mean shift that is told, in pixels, and how near its texel is to a whole number of pixels.
_SHIFT: Final = 0.05
_COLOUR: Final = (1.0, 0.5, 0.25)
# Gains that are 1 but for roundings; the values whose mean gain is measured; and its limit.
# Truncated half floats have a mean error of -0.035 %, rounded ones of 0.
_NEARLY: Final = 5e-3
_VALUES: Final = 16
_BIAS: Final = 2e-4


@dataclass(frozen=True)
class Law:
    """A law of a bloom.

    - `test`: Takes the subject and the limit. Raises AssertionError if the law does not hold, and
      ValueError or TypeError if it cannot be tested.
    - `formula`: The law in words or as a formula.
    - `why`: Why a bloom that is no fault may break the law.
    - `limit`: What the test allows beyond the errors of values; by figure if there are several.
    - `explain`: Measures which it is, and returns words in place of `why`.
    - `applies`: Whether the law is tested where no laws are named.
    """

    name: str
    test: Callable[[Subject, Any], None]
    formula: str
    why: str
    limit: Any = 0.0
    explain: Callable[[Subject, str], str] | None = None
    applies: Callable[[Subject], bool] = lambda _: True


def law_name(name: str, known: Mapping[str, object] | None = None) -> str:
    """Return the name of a law, which may be given as that of an assertion."""
    plain = name.strip().replace("-", "_").removeprefix("assert_")
    plain = {"stable": "stability", "resolution_independent": "resolution"}.get(plain, plain)
    names = LAWS if known is None else known
    if plain not in names:
        raise ValueError(f"{name!r} is not one of {', '.join(names)}{did_you_mean(plain, names)}")
    return plain


def _gain(subject: Subject, limit: float) -> None:
    figure("gain", subject.measured_gain)
    promised = subject.measured_gain if subject.gain is None else subject.gain
    laws.assert_gain(subject.bloom, promised, subject.probe)
    if subject.gain is not None or abs(promised - 1) < _NEARLY:
        _unbiased(subject, 1.0 if subject.gain is None else promised)


def _unbiased(subject: Subject, promised: float) -> None:
    """Compare the mean gain of many values, since truncated half floats lose light in each pass."""
    probe = subject.probe
    flat = probe.given(probe.flat(probe.value))
    if not promised or np.asarray(subject.bloom(flat)).dtype != np.float16:
        return
    shares = np.random.default_rng(probe.seed).uniform(0.5, 1.0, _VALUES)
    gains = []
    for value in shares * probe.value:
        given = probe.given(probe.flat(value))
        result, _ = probe.values(subject.bloom(given), given)
        x, y = probe.centre
        gains.append(float(result[y, x].mean()) / float(probe.values(given, given)[0][y, x].mean()))
    off, law = float(np.mean(gains)) / promised - 1, "half floats are rounded, not truncated"
    if not is_within(law, abs(off), _BIAS, "bias"):
        fail(
            "assert_gain",
            law,
            f"the mean gain of {_VALUES} values is off by {100 * off:+.3g} %: {100 * _BIAS:.2g} % "
            "allowed",
        )


def _centroid_kept(subject: Subject, limit: float) -> None:
    _lit(subject)
    point_spread.assert_centroid_kept(subject.bloom, subject.probe, within=limit)


def _separable(subject: Subject, limit: float) -> None:
    _lit(subject)
    point_spread.assert_separable(subject.bloom, subject.probe)


def _lit(subject: Subject) -> None:
    spread, error = subject.pixel
    if not spread.max(axis=(0, 1)).min() > error:
        raise ValueError("the bloom of a pixel is black, as after a median or a threshold")


def _bounded_fireflies(subject: Subject, limit: float) -> None:
    laws.assert_bounded_fireflies(subject.bloom, limit, subject.probe)


def _additive(subject: Subject, limit: float) -> None:
    if subject.picture is not None and subject.intensity is not None:
        laws.assert_additive(subject.picture, subject.bloom, subject.intensity, subject.probe)
    else:
        laws.assert_additive(subject.picture or subject.bloom, probe=subject.probe)


def _unclamped(subject: Subject, limit: float) -> None:
    """One-sided, so that a threshold holds the law: it only takes light from dark pixels."""
    bloom, probe = subject.bloom, subject.probe
    highest = min(subject.highest, 1.0 if probe.dtype.kind == "u" else math.inf)
    factor = 2.0 ** round(math.log2(highest / probe.value))
    if not factor > 1:
        raise ValueError(f"probe: values above {probe.value:g} cannot be given to this bloom")
    image = probe.noise(0, probe.value)
    small, small_error = probe.apply(bloom, image)
    large, large_error = probe.apply(bloom, factor * image)
    compare_with_law(
        "assert_unclamped",
        f"B({factor:g} a) >= {factor:g} B(a): bright pixels are not clamped",
        large,
        np.maximum(large, factor * small),
        large_error + factor * small_error,
    )


def _energy(subject: Subject, limit: float) -> None:
    if subject.measured_gain > 0:
        _lit(subject)
    spread = subject.pixel[0]
    point_spread.check_inside(point_spread.border_share(spread), subject.probe.size)
    energy = float(spread.sum(axis=(0, 1)).mean())
    figure("energy", energy)
    promised = 1.0 if subject.gain is None else subject.gain
    off, allowed = abs(energy - promised), limit * max(promised, energy)
    law = f"the bloom of a lit pixel has {promised:.4g} times the light of the pixel"
    if not is_within(law, off, allowed):
        fail(
            "assert_energy",
            law,
            f"{energy:.4g} instead of {promised:.4g}: off by {off:.3g}, {allowed:.3g} allowed",
        )


def _coloured(probe: Probe) -> None:
    if probe.colours < len(_COLOUR):
        raise ValueError(f"probe: {probe.colours} channel has no colour; 3 channels are needed")


def _colour(subject: Subject, limit: float) -> None:
    _coloured(subject.probe)
    image = subject.probe.flat(subject.probe.value) * np.array(_COLOUR)
    result, error = subject.probe.apply(subject.bloom, image)
    expected = image * (result.mean() / image.mean())
    law = "all channels of a flat coloured image get the same gain"
    compare_with_law("assert_colour", law, result, expected, error)


def _grey(subject: Subject, limit: float) -> None:
    _coloured(subject.probe)
    image = subject.probe.noise(0, subject.probe.value)[..., :1].repeat(3, axis=2)
    result, error = subject.probe.apply(subject.bloom, image)
    expected = np.broadcast_to(result.mean(axis=2, keepdims=True), result.shape)
    law = "the bloom of a grey image is grey: all channels spread alike"
    compare_with_law("assert_grey", law, result, expected, 2 * error)


def _channels(subject: Subject, limit: float) -> None:
    probe = subject.probe
    _coloured(probe)
    dark, dark_error = probe.apply(subject.bloom, probe.flat(0.0))
    for channel in range(3):
        image = probe.noise(0, probe.value) * (np.arange(3) == channel)
        result, error = probe.apply(subject.bloom, image)
        expected = np.where(np.arange(3) == channel, result, dark)
        law = f"the bloom of light in channel {channel} is in channel {channel}"
        compare_with_law("assert_channels", law, result, expected, error + dark_error)


def _stability(subject: Subject, limit: Mapping[str, float]) -> None:
    found = subject.stability
    if not found.energy.max() > 0:
        raise ValueError("the bloom of a small light is black")
    # Without a figure, such as the radius of a negative variance, there is nothing to judge.
    known = {name: one for name, one in limit.items() if math.isfinite(getattr(found, name))}
    try:
        moving_light.check_stable(found, known, subject.lamp)
    except ValueError:
        # At each pixel of the path, no more light leaves the image than lies in its outermost
        # pixels. So energy and peak may still be wrong by more than that; place and width may not.
        lost = TEXEL * found.at_border
        judged = ("ripple", "shimmer")
        loose = {name: known[name] + lost for name in known if name in judged}
        whole = dataclasses.replace(found, at_border=0.0)
        moving_light.check_stable(whole, loose, subject.lamp)
        raise


def _resolution(subject: Subject, limit: Mapping[str, float]) -> None:
    found = subject.resolution
    if not all(values.mean() > 0 for values in (found.r50, found.r90, found.peak)):
        raise ValueError("the bloom of a light is black at some size")
    scaled_scene.check_independent(found, limit["radius"], limit["peak"])


def _finite(subject: Subject, limit: float) -> None:
    probe = subject.probe
    if probe.dtype.kind == "u":
        raise ValueError(f"probe: {probe.dtype} has neither NaN nor infinity")
    law = "NaN and infinity of a pixel do not reach others"
    x, y = probe.centre
    blooms: dict[str, Bloom] = {"bloom": subject.bloom}
    if subject.picture is not None:
        blooms["picture"] = subject.picture
    for value in (math.nan, math.inf, -math.inf):
        image = probe.noise(0, probe.value)
        image[y, x] = value
        for name, bloom in blooms.items():
            reached = _not_finite(bloom(probe.given(image)))
            reached[y, x] = False
            count = int(reached.sum())
            if not is_within(law, count, limit, name):
                fail(
                    "assert_finite",
                    law,
                    f"{value} at x {x}, y {y} reaches {count} other pixels of the {name}: "
                    f"{limit:g} allowed",
                )


def _not_finite(result: Any) -> NDArray[np.bool_]:
    array = np.asarray(result)
    return np.asarray(~np.isfinite(array.reshape(*array.shape[:2], -1)).all(axis=2))


def _reference(subject: Subject, limit: float) -> None:
    if subject.differences is None:
        raise ValueError("the bloom has no reference")
    law = "each framebuffer is that of the reference"
    found = subject.reference
    over = [name for name, off in found.items() if not is_within(law, off, limit, name)]
    if over:
        told = ", ".join(f"{name} is off by {found[name]:.3g}" for name in over)
        fail("assert_reference", law, f"{told} of its largest value, {limit:g} allowed")


def _shift_explained(subject: Subject, why: str) -> str:
    """Return whether light is shifted at all positions, or only moves around its place."""
    bloom, probe = subject.bloom, subject.probe
    # All positions of a period at once: a square whose side is a multiple of it.
    side = 2 ** int(math.log2(max(1, min(probe.size) // 4)))
    left, top = ((length - side) // 2 for length in probe.size)
    square = probe.flat(0.0)
    square[top : top + side, left : left + side] = probe.value
    lit = probe.apply(bloom, square)[0] - probe.apply(bloom, probe.flat(0.0))[0]
    mean = np.subtract(_centroid(lit), _centroid(square))
    parts = [
        f"{size:+.3g} pixels along {axis}{_half_texels(2 * abs(size))}"
        for axis, size in zip("xy", mean, strict=True)
        if abs(size) > _SHIFT
    ]
    for axis, size in zip("xy", mean, strict=True):
        figure(f"shift_{axis}", float(size))
    x, y = (max(0, place - _PERIOD // 2) for place in probe.centre)
    places = [(x + i, y + i) for i in range(min(_PERIOD, probe.size[0] - x, probe.size[1] - y))]
    down = int(abs(mean[1]) > abs(mean[0]))
    shifts = np.array(
        [
            _centroid(point_spread.point_spread(bloom, probe, at=place))[down] - place[down]
            for place in places
        ]
    )
    shifts = shifts[np.isfinite(shifts)]
    if parts:
        why = f"All light is shifted by {' and '.join(parts)}, on average over all positions." + (
            " No chain of halved images does that: a pass reads the corner of a pixel in place of "
            "its middle."
            if "texel" in "".join(parts)
            else ""
        )
    if not shifts.size:
        return why
    alike = parts and np.ptp(shifts) < abs(shifts.mean()) / 4
    return (
        f"{why} Measured along {'xy'[down]} over {shifts.size} positions: {shifts.min():+.3g} to "
        f"{shifts.max():+.3g} pixels, {round(shifts.mean(), 6) + 0.0:+.3g} on average"
        + ("; all positions move alike, as with a missing half texel." if alike else ".")
    )


def _half_texels(texel: float) -> str:
    """Return the levels of halved images of which a shift is half a texel, as words."""
    whole = round(texel)
    if not whole or abs(texel - whole) > 2 * _SHIFT:
        return ""
    levels = [2**bit for bit in range(whole.bit_length()) if whole >> bit & 1]
    sizes = [f"1/{level} of the size" if level > 1 else "full size" for level in levels]
    each = "each of the levels" if len(levels) > 1 else "the level"
    return f" (half a texel of {each} at {' and '.join(sizes)})"


def _centroid(image: Image) -> tuple[float, float]:
    """Return x and y of the centroid; NaN without light."""
    plane = image.mean(axis=2)
    total = float(plane.sum())
    if not total > 0:
        return math.nan, math.nan
    x, y = (float(plane.sum(axis=a) @ np.arange(plane.shape[1 - a])) / total for a in (0, 1))
    return x, y


#: The laws by name, in the order of the report. The first nine have assertions of their names.
LAWS: Final[Mapping[str, Law]] = {
    law.name: law
    for law in (
        Law(
            "superposition",
            lambda subject, _: laws.assert_superposition(subject.bloom, subject.probe),
            "B(a / 2 + b / 4) = B(a) / 2 + B(b) / 4",
            "A threshold, a clamp, a firefly filter and a median are not linear. They break this "
            "law on purpose.",
        ),
        Law(
            "gain",
            _gain,
            "B(v) = gain v at every pixel of a flat image, with the gain that is promised, or with "
            "that of its middle",
            "With a threshold, the gain depends on the value. A method that reads black outside "
            "the image loses light at the border. A bloom of another strength promises another "
            "gain.",
        ),
        Law(
            "symmetric",
            lambda subject, _: laws.assert_symmetric(subject.bloom, subject.probe),
            "B(M a) = M B(a), where M swaps left and right, or top and bottom",
            "An even number of taps, a missing half texel and boxes of an odd number of pixels are "
            "not the same from both sides.",
        ),
        Law(
            "transposed",
            lambda subject, _: laws.assert_symmetric(subject.bloom, subject.probe, axes=("xy",)),
            "B(M a) = M B(a), where M swaps rows and columns",
            "Blades, streaks and passes of different widths along x and y treat rows and columns "
            "differently.",
        ),
        Law(
            "centroid_kept",
            _centroid_kept,
            "the centroid of the light of a pixel is that pixel",
            "A chain of halved images averages boxes of 2 x 2 pixels. The light of a pixel moves "
            "to the centre of its box, and back on average over all positions.",
            limit=0.01,
            explain=_shift_explained,
        ),
        Law(
            "separable",
            _separable,
            "h(x, y) h(x0, y0) = h(x, y0) h(x0, y)",
            "A sum of several widths, such as the levels of a pyramid, is not a row times a "
            "column, even where each level is.",
        ),
        Law(
            "no_ringing",
            lambda subject, _: laws.assert_no_ringing(subject.bloom, subject.probe),
            "across a step from black to bright, values rise, and stay between those of the flat "
            "images",
            "Negative weights ring, as in a sharpening filter. A method that reads black outside "
            "the image darkens the border.",
        ),
        Law(
            "bounded_fireflies",
            _bounded_fireflies,
            "a bright pixel brightens others by the limit at most",
            "A linear bloom spreads a share of any brightness. Only a clamp, or an average "
            "weighted by 1 / (1 + luminance), limits it.",
            limit=1.0,
        ),
        Law(
            "additive",
            _additive,
            "F(a) = a + intensity G(a); where the bloom G is not known apart, F(a) >= a",
            "The bloom alone lacks the image. The composite mix takes light from bright pixels, "
            "and screen and a tone curve compress it.",
        ),
        Law(
            "unclamped",
            _unclamped,
            "B(k a) >= k B(a), for k a of values up to 1024",
            "A clamp, a tone curve and a firefly filter limit bright pixels on purpose, and files "
            "and buffers of 8 bits end at 1.",
        ),
        Law(
            "energy",
            _energy,
            "the bloom of a lit pixel has the light of the pixel, times the gain that is promised; "
            "1 if none is",
            "Light is lost where taps skip pixels, weights do not add up to 1, or the border reads "
            "black; with a threshold, a small light is another share of what is above it. A bloom "
            "of another strength promises another gain.",
            limit=0.02,
        ),
        Law(
            "colour",
            _colour,
            "all channels of a flat coloured image get the same gain",
            "A threshold or a clamp of each channel alone changes the hue. A tint or a coloured "
            "kernel does so on purpose.",
        ),
        Law(
            "grey",
            _grey,
            "the bloom of a grey image is grey",
            "A coloured kernel, a tint and chromatic dispersion spread each channel differently on "
            "purpose.",
        ),
        Law(
            "channels",
            _channels,
            "the bloom of light in one channel is in that channel",
            "A tint by a luminance, or a change of colour space, mixes channels on purpose.",
        ),
        Law(
            "stability",
            _stability,
            "while a light smaller than a pixel moves over 8 pixels, its bloom keeps energy, "
            "radius, the centroid of the image and the peak that a convolution has",
            "A chain of halved images whose filter skips pixels gives a small light another "
            "brightness at each position: it shimmers.",
            limit=moving_light.LIMITS,
        ),
        Law(
            "resolution",
            _resolution,
            "radii and peak are the same share of the picture at four sizes",
            "A width in pixels, or a fixed number of levels, is another share of the picture at "
            "each size.",
            limit={"radius": 0.1, "peak": 0.2},
        ),
        Law(
            "border",
            lambda subject, limit: border.assert_border(subject.bloom, subject.lamp, limits=limit),
            "a light at the border has the bloom of a light far from it, cut off by the frame, and "
            "a flat image the same bloom in a corner as in the middle",
            "Where the outermost pixels are repeated, a light in them counts for what is beyond "
            "them, too: in the smallest level of a chain that is most of the picture. A method "
            "that reads black outside the image loses light there.",
            limit=border.BORDER_LIMITS,
        ),
        Law(
            "views",
            lambda subject, limit: border.assert_views(subject.bloom, subject.probe, limit=limit),
            "B(a, region=r) inside of r depends on the pixels inside of r alone",
            "A bloom of a picture with two views reads across their seam, unless each view is "
            "blurred by itself.",
            limit=1e-3,
        ),
        Law(
            "sizes",
            lambda subject, limit: shape.assert_sizes(subject.bloom, subject.probe, limits=limit),
            "width, centroid and energy of the bloom of a square are the same in images whose "
            "sizes are 1 to 3 pixels beside a multiple of 16",
            "A chain of halved images rounds each size: the levels cover a little more or less "
            "than the image, and a small image may have one level more.",
            limit=shape.SIZE_LIMITS,
        ),
        Law(
            "round",
            lambda subject, limit: shape.assert_round(subject.bloom, subject.lamp, limit=limit),
            "contours of the bloom of a pixel at 1/2, 1/10 and 1/100 of the peak are circles",
            "Boxes and tents are square, streaks and blades are stars. A wide pyramid shows the "
            "square texels of its small levels.",
            limit=1.35,
        ),
        Law(
            "alpha",
            lambda subject, limit: transparency.assert_alpha(
                subject.picture or subject.bloom, subject.probe, limit=limit
            ),
            "F(a) + (1 - A) b = F(a + (1 - alpha) b) - F((1 - alpha) b) + (1 - alpha) b, "
            "premultiplied, for backdrops b of 0 and 1/4",
            "A glow with an alpha of its own covers the backdrop instead of adding to it.",
            limit=0.01,
        ),
        Law(
            "jitter",
            lambda subject, limit: in_time.assert_jitter(subject.bloom, subject.lamp, limits=limit),
            "the bloom of thin lights has the same light in each frame of a camera that moves by "
            "parts of a pixel, and a lit pixel blooms from the same value on as a flat image",
            "A threshold after a reduction reads an average: thin lights fall below it. A "
            "reduction that skips pixels sees them now and then.",
            limit=in_time.JITTER_LIMITS,
        ),
        Law(
            "history",
            lambda subject, limit: in_time.assert_history(
                subject.bloom, subject.lamp, limits=limit
            ),
            "the bloom of an image does not depend on the images before, nor on the time",
            "A bloom that is smoothed in time keeps what has moved for some frames on purpose.",
            limit=in_time.HISTORY_LIMITS,
        ),
        Law(
            "finite",
            _finite,
            "NaN and infinity of a pixel do not reach others",
            "NaN and infinity spread through every average; a pass that reads them must replace "
            "them first.",
        ),
        Law(
            "reference",
            _reference,
            "each framebuffer is that of the reference, as a share of its largest value",
            "The reference computes something else, rounds differently, or reads other pixels at "
            "the border.",
            limit=1e-3,
            applies=lambda subject: bool(subject.reference),
        ),
    )
}
