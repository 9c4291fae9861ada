"""The laws of a bloom: one table, for `report`, for `vkbloom check` and for the docs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

from vkbloom._spelling import did_you_mean
from vkbloom.testing import _border as border
from vkbloom.testing import _law_tests as tests
from vkbloom.testing import _laws as laws
from vkbloom.testing import _moving_light as moving_light
from vkbloom.testing import _shape as shape
from vkbloom.testing import _time as in_time
from vkbloom.testing import _transparency as transparency
from vkbloom.testing._subject import Subject


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
            tests.gain,
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
            tests.centroid_kept,
            "the centroid of the light of a pixel is that pixel",
            "A chain of halved images averages boxes of 2 x 2 pixels. The light of a pixel moves "
            "to the centre of its box, and back on average over all positions.",
            limit=0.01,
            explain=tests.shift_explained,
        ),
        Law(
            "separable",
            tests.separable,
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
            tests.bounded_fireflies,
            "a bright pixel brightens others by the limit at most",
            "A linear bloom spreads a share of any brightness. Only a clamp, or an average "
            "weighted by 1 / (1 + luminance), limits it.",
            limit=1.0,
        ),
        Law(
            "additive",
            tests.additive,
            "F(a) = a + intensity G(a); where the bloom G is not known apart, F(a) >= a",
            "The bloom alone lacks the image. The composite mix takes light from bright pixels, "
            "and screen and a tone curve compress it.",
        ),
        Law(
            "unclamped",
            tests.unclamped,
            "B(k a) >= k B(a), for k a of values up to 1024",
            "A clamp, a tone curve and a firefly filter limit bright pixels on purpose, and files "
            "and buffers of 8 bits end at 1.",
        ),
        Law(
            "energy",
            tests.energy,
            "the bloom of a lit pixel has the light of the pixel, times the gain that is promised; "
            "1 if none is",
            "Light is lost where taps skip pixels, weights do not add up to 1, or the border reads "
            "black; with a threshold, a small light is another share of what is above it. A bloom "
            "of another strength promises another gain.",
            limit=0.02,
        ),
        Law(
            "colour",
            tests.colour,
            "all channels of a flat coloured image get the same gain",
            "A threshold or a clamp of each channel alone changes the hue. A tint or a coloured "
            "kernel does so on purpose.",
        ),
        Law(
            "grey",
            tests.grey,
            "the bloom of a grey image is grey",
            "A coloured kernel, a tint and chromatic dispersion spread each channel differently on "
            "purpose.",
        ),
        Law(
            "channels",
            tests.channels,
            "the bloom of light in one channel is in that channel",
            "A tint by a luminance, or a change of colour space, mixes channels on purpose.",
        ),
        Law(
            "stability",
            tests.stability,
            "while a light smaller than a pixel moves over 8 pixels, its bloom keeps energy, "
            "radius, the centroid of the image and the peak that a convolution has",
            "A chain of halved images whose filter skips pixels gives a small light another "
            "brightness at each position: it shimmers.",
            limit=moving_light.LIMITS,
        ),
        Law(
            "resolution",
            tests.resolution,
            "radii and peak are the same share of the picture at four sizes",
            "A width in pixels, or a fixed number of levels, is another share of the picture at "
            "each size.",
            limit={"radius": 0.1, "peak": 0.2},
        ),
        Law(
            "border",
            lambda subject, limit: border.check_border(
                subject.bloom, subject.lamp, subject.dark[0], limit, subject.last_pixel
            ),
            "a light at the border has the bloom of a light far from it, cut off by the frame, and "
            "no pixel of it is lost, also where sizes are odd",
            "Where the outermost pixels are repeated, a light in them counts for what is beyond "
            "them, too: in the smallest level of a chain that is most of the picture.",
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
            lambda subject, limit: shape.check_sizes(
                subject.bloom,
                subject.probe,
                float(subject.dark[0].mean()),
                limit,
                subject.last_pixel,
            ),
            "width, centroid and energy of the bloom of a square are the same in images whose "
            "sizes are 1 to 3 pixels beside a multiple of 16, and their last pixel is not lost",
            "A chain of halved images rounds each size: the levels cover a little more or less "
            "than the image, and a small image may have one level more.",
            limit=shape.SIZE_LIMITS,
        ),
        Law(
            "round",
            tests.round_contours,
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
            tests.finite,
            "NaN and infinity of a pixel do not reach others",
            "NaN and infinity spread through every average; a pass that reads them must replace "
            "them first.",
        ),
        Law(
            "reference",
            tests.reference,
            "each framebuffer is that of the reference, as a share of its largest value",
            "The reference computes something else, rounds differently, or reads other pixels at "
            "the border.",
            limit=1e-3,
            applies=lambda subject: subject.differences is not None,
        ),
    )
}
