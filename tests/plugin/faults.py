"""Faults of blooms that people have reported, each with a correct bloom and the law it breaks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, signal

from vkbloom import psf

Image = NDArray[Any]
Bloom = Callable[..., Image]


class Fault(NamedTuple):
    """A bloom with a fault, and the law that names it, in words.

    - `fault`, `correct`: Make the blooms: some keep a state.
    - `others`: Other laws that the fault breaks and the correct does not; None: they are not told.
    - `field`: The kernels that the correct one promises.
    """

    fault: Callable[[], Bloom]
    correct: Callable[[], Bloom]
    law: str
    words: str
    others: frozenset[str] | None = None
    field: psf.Varying | None = None


def gaussian(image: Image, sigma: float = 2.0, mode: str = "nearest") -> Image:
    return np.asarray(ndimage.gaussian_filter(image, (sigma, sigma, 0), mode=mode))


def wide(image: Image) -> Image:
    return gaussian(image, 4.0)


def wider(image: Image) -> Image:
    return gaussian(image, 8.0)


def stale_margin() -> Bloom:
    """Blur in a buffer that is larger than the image, and keeps what it held."""
    buffer = np.zeros((0, 0, 3))

    def bloom(image: Image) -> Image:
        nonlocal buffer
        height, width, channels = image.shape
        rows, columns = max(height + 16, buffer.shape[0]), max(width + 16, buffer.shape[1])
        grown = np.zeros((rows, columns, channels))
        kept = min(channels, buffer.shape[2])
        grown[: buffer.shape[0], : buffer.shape[1], :kept] = buffer[..., :kept]
        grown[8 : height + 8, 8 : width + 8] = image
        buffer = grown
        return gaussian(buffer)[8 : height + 8, 8 : width + 8].astype(image.dtype)

    return bloom


def of_a_view(image: Image, *, region: tuple[int, int, int, int] | None = None) -> Image:
    x, y, width, height = region or (0, 0, *image.shape[1::-1])
    return gaussian(image[y : y + height, x : x + width])


def across_views(image: Image, *, region: tuple[int, int, int, int] | None = None) -> Image:
    x, y, width, height = region or (0, 0, *image.shape[1::-1])
    return gaussian(image)[y : y + height, x : x + width]


def stretch(image: Image) -> Image:
    """Blur in a buffer whose sides are multiples of 16, with steps of the image's texels."""
    height, width, _ = image.shape
    rows, columns = -(-height // 16) * 16 / height, -(-width // 16) * 16 / width
    return np.asarray(ndimage.gaussian_filter(image, (3 * rows, 3 * columns, 0), mode="nearest"))


def off_at_odd_sizes(image: Image) -> Image:
    shift = (0.5 * (image.shape[0] % 2), 0.5 * (image.shape[1] % 2), 0)
    return np.asarray(ndimage.shift(gaussian(image), shift, order=1, mode="nearest"))


def halve(image: Image) -> Image:
    height, width, channels = image.shape
    even = np.pad(image, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
    boxes = even.reshape((height + 1) // 2, 2, (width + 1) // 2, 2, channels)
    return np.asarray(boxes.mean((1, 3)))


def double(image: Image, shape: tuple[int, ...]) -> Image:
    large = ndimage.zoom(image, (2, 2, 1), order=1, grid_mode=True, mode="nearest")
    return np.asarray(large[: shape[0], : shape[1]])


def above_one(image: Image) -> Image:
    return np.asarray(image * (image.max(axis=2, keepdims=True) > 1))


def box(image: Image, side: int = 13) -> Image:
    return np.asarray(ndimage.uniform_filter(image, (side, side, 1), mode="nearest"))


def cross(image: Image) -> Image:
    lines = [ndimage.gaussian_filter1d(image, 8, axis=axis, mode="nearest") for axis in (0, 1)]
    return np.asarray((lines[0] + lines[1]) / 2)


def darker_at_the_edge(image: Image) -> Image:
    rows, columns = (np.minimum(np.arange(n), np.arange(n)[::-1]) for n in image.shape[:2])
    share = np.minimum(1, np.minimum.outer(rows, columns) / 8 + 0.2)
    return gaussian(image) * share[..., np.newaxis]


def picture(alpha: Callable[[Image, Image], Image], glow: Callable[[Image], Image]) -> Bloom:
    """Return the picture with its glow; `alpha` takes that of the image and the glow."""

    def bloom(image: Image) -> Image:
        light = glow(image)
        colours = image[..., :3] + light
        if image.shape[2] == 3:
            return colours
        return np.concatenate([colours, alpha(image[..., 3:], light)], axis=2)

    return bloom


def of_colours(image: Image) -> Image:
    return gaussian(image[..., :3])


def of_opaque(image: Image) -> Image:
    return of_colours(image) * (image[..., 3:] if image.shape[2] == 4 else 1)


def halves(store: Callable[[Image], Image]) -> Bloom:
    """Return a blur that stores half floats after each direction."""

    def bloom(image: Image) -> Image:
        for axis in (0, 1):
            blurred = ndimage.gaussian_filter1d(
                image.astype(np.float32), 2, axis=axis, mode="nearest"
            )
            image = store(blurred)
        return image.astype(np.float16)

    return bloom


def truncate(image: Image) -> Image:
    return (image.view(np.uint32) & np.uint32(0xFFFFE000)).view(np.float32)


def every_other_pixel(image: Image) -> Image:
    kept = np.zeros_like(image)
    kept[::2, ::2] = 4 * image[::2, ::2]
    return wide(kept)


def with_history() -> Bloom:
    last: Image | None = None

    def bloom(image: Image, *, time: float | None = None) -> Image:
        nonlocal last
        now = gaussian(image)
        last = now if last is None or last.shape != now.shape else 0.8 * last + 0.2 * now
        return last

    return bloom


def at_present(image: Image, *, time: float | None = None) -> Image:
    return gaussian(image)


def strobing(image: Image, *, time: float | None = None) -> Image:
    share = 1 + 0.5 * np.sign(np.sin(2 * np.pi * 10 * (time or 0) + 0.1))
    return np.asarray(gaussian(image) * share)


def drops_the_last_row(image: Image) -> Image:
    """Blur what has an even size, and leave the rest black."""
    even = np.s_[: image.shape[0] // 2 * 2, : image.shape[1] // 2 * 2]
    blurred = np.zeros_like(image)
    blurred[even] = gaussian(image[even])
    return blurred


def in_halves(image: Image, *, pads: bool = True) -> Image:
    """Blur an image of half the size; where a side is odd, its last line is repeated or dropped."""
    height, width, _ = image.shape
    small = halve(image if pads else image[: height // 2 * 2, : width // 2 * 2])
    large = double(gaussian(small), image.shape)
    missing = (height - large.shape[0], width - large.shape[1])
    return np.pad(large, ((0, missing[0]), (0, missing[1]), (0, 0)), mode="edge")


def drops_odd(image: Image) -> Image:
    return in_halves(image, pads=False)


def across_stacked_views(image: Image, *, region: tuple[int, int, int, int] | None = None) -> Image:
    x, y, width, height = region or (0, 0, *image.shape[1::-1])
    return gaussian(image[:, x : x + width])[y : y + height]


def without_the_outermost(image: Image) -> Image:
    return gaussian(np.pad(image[1:-1, 1:-1], ((1, 1), (1, 1), (0, 0)), mode="edge"))


def last_column_black(image: Image) -> Image:
    blurred = gaussian(image)
    blurred[:, -1] = 0
    return blurred


def stale_columns() -> Bloom:
    """Blur all but the last columns, which show the image before."""
    last: Image | None = None

    def bloom(image: Image) -> Image:
        nonlocal last
        blurred = gaussian(image)
        if last is not None and last.shape == image.shape:
            blurred[:, -4:] = gaussian(last)[:, -4:]
        last = image
        return blurred

    return bloom


def a_frame_late() -> Bloom:
    last: Image | None = None

    def bloom(image: Image, *, time: float | None = None) -> Image:
        nonlocal last
        shown = image if last is None or last.shape != image.shape else last
        last = image
        return gaussian(shown)

    return bloom


def growing(u: float, v: float) -> Image:
    """A round spot whose width grows to the corner."""
    square = np.add.outer(np.arange(-6, 7) ** 2, np.arange(-6, 7) ** 2)
    spot = np.exp(-square / (2 * (1 + u * u + v * v) ** 2))
    return np.asarray(spot / spot.sum())


LENS = psf.Varying(function=growing)


def varying(count: int | None = None, *, gathers: bool = False) -> Bloom:
    """Spread each pixel by the kernel of its place, by all components or so many."""

    def bloom(image: Image) -> Image:
        # A small picture has weights for each pixel.
        made, result = LENS.components(image.shape[1::-1]), np.zeros(image.shape)
        for kernel, own in zip(made.kernels[:count], made.weights, strict=False):
            weights = own[..., np.newaxis]
            given = image if gathers else weights * image
            spread = signal.fftconvolve(given, kernel[..., np.newaxis], "same", axes=(0, 1))
            result += weights * spread if gathers else spread
        return result

    return bloom


_keeps = picture(lambda alpha, _: alpha, of_colours)


def correlated(weights: list[list[float]]) -> Bloom:
    """Return the correlation of a Gaussian with a kernel."""
    taps = np.array(weights)[..., np.newaxis]
    return lambda image: np.asarray(ndimage.correlate(gaussian(image), taps, mode="nearest"))


def in_shares_of_the_height(image: Image) -> Image:
    """Blur by a sixteenth of the height, which is rounded to a multiple of 16."""
    return gaussian(image, float(round(image.shape[0] / 16)))


def at_finite(image: Image) -> Image:
    """Blur after NaN and infinity were replaced."""
    return gaussian(np.nan_to_num(image, posinf=0, neginf=0))


def thresholded(image: Image, above: float = 1.0) -> Image:
    return gaussian(image * (image.max(axis=2, keepdims=True) > above))


def with_wider_blue(image: Image) -> Image:
    return np.dstack([gaussian(image[..., :2]), gaussian(image[..., 2:], 2.4)])


def with_red_in_blue(image: Image) -> Image:
    return gaussian(image @ np.array([[0.75, 0, 0.25], [0, 1, 0], [0, 0, 1]], image.dtype))


def soft_light(image: Image, light: Image) -> Image:
    """Godot's up to 4.5: colours above 1 stay as they are."""
    full = np.where(image <= 0.25, ((16 * image - 12) * image + 4) * image, np.sqrt(image))
    return np.where(image > 1, image, image + np.clip(light, 0, 1) * (full - image))


def composed(compose: Callable[[Image, Image], Image]) -> Bloom:
    """Return the picture of an image and its glow."""

    def bloom(image: Image) -> Image:
        colours = compose(image[..., :3], of_colours(image))
        return np.dstack([colours, image[..., 3:]]).astype(image.dtype)

    return bloom


def of_composite(compose: Callable[[Image, Image], Image], words: str) -> Fault:
    return Fault(lambda: composed(compose), lambda: _keeps, "composite", words)


def of_linear(fault: Bloom, law: str, words: str, *others: str, correct: Bloom = gaussian) -> Fault:
    """Return a fault beside a Gaussian, with all laws that it breaks."""
    return Fault(lambda: fault, lambda: correct, law, words, frozenset(others))


#: Faults whose other broken laws are told, too.
_LINEAR: dict[str, Fault] = {
    "gain 0.97": of_linear(lambda a: 0.97 * gaussian(a), "energy", "0.97 instead of 1"),
    "gain 1.03": of_linear(lambda a: 1.03 * gaussian(a), "energy", "1.03 instead of 1"),
    "half of the light is lost": of_linear(lambda a: 0.5 * gaussian(a), "energy", "0.5 instead"),
    "channels are swapped": of_linear(
        lambda a: gaussian(a)[..., ::-1], "colour", "0.25 instead of 1", "channels"
    ),
    "channels are rotated": of_linear(
        lambda a: gaussian(a)[..., [1, 2, 0]], "channels", "instead of 0", "colour"
    ),
    "all is grey": of_linear(
        lambda a: gaussian(a).mean(axis=2, keepdims=True).repeat(3, axis=2),
        "colour",
        "instead of 1 ",
        "channels",
    ),
    "a fourth of red is in blue": of_linear(
        with_red_in_blue, "channels", "channel 2: off by", "grey", "colour", "gain"
    ),
    "the input is clamped at 1": of_linear(
        lambda a: gaussian(np.minimum(a, 1)), "unclamped", "1 instead of"
    ),
    "the output is clamped at 1": of_linear(
        lambda a: np.minimum(gaussian(a), 1), "unclamped", "1 instead of"
    ),
    "the output is clamped at 100": of_linear(
        lambda a: np.minimum(gaussian(a), 100), "unclamped", "100 instead of"
    ),
    "clamped above a threshold": of_linear(
        lambda a: np.minimum(thresholded(a), 30), "unclamped", "30 instead of", correct=thresholded
    ),
    "NaN reaches others": of_linear(gaussian, "finite", "nan at x 32", correct=at_finite),
    "infinity reaches others": of_linear(
        lambda a: gaussian(np.where(np.isnan(a), 0, a)), "finite", "inf at x 32", correct=at_finite
    ),
    "one channel is wider": of_linear(with_wider_blue, "grey", "instead of"),
    "reads every other pixel": of_linear(
        every_other_pixel,
        "stability",
        "the energy of the bloom changes by",
        *("symmetric", "gain", "no_ringing", "colour", "energy", "border", "sizes", "jitter"),
        correct=wide,
    ),
    "a curve before the blur": of_linear(
        lambda a: gaussian(np.maximum(a, 0) ** 1.1),
        "superposition",
        "B(a / 2 + b / 4)",
        *("gain", "colour", "stability", "jitter"),
    ),
    "one side is brighter": of_linear(
        correlated([[0.2, 0.5, 0.3]]),
        "symmetric",
        "left and right swapped",
        *("transposed", "centroid_kept", "stability"),
    ),
    "half a texel off": of_linear(
        correlated([[0.5, 0.5]]),
        "centroid_kept",
        "+0.5 pixels from x",
        *("symmetric", "transposed", "stability"),
    ),
    "wider along rows": of_linear(
        lambda a: ndimage.gaussian_filter(a, (2.0, 2.2, 0), mode="nearest"),
        "transposed",
        "rows and columns swapped",
    ),
    "a sum of two widths": of_linear(
        lambda a: gaussian(a, 1.0) / 2 + gaussian(a, 6.0) / 2, "separable", "a row times a column"
    ),
    "rings beside an edge": of_linear(
        lambda a: 2 * gaussian(a) - wide(a),
        "no_ringing",
        "a step along x",
        *("separable", "border", "sizes"),
    ),
    "a firefly is not limited": of_linear(
        gaussian,
        "bounded_fireflies",
        "brightens others by 1 at most",
        correct=lambda a: gaussian(np.minimum(a, 8)),
    ),
    "takes light from bright pixels": of_linear(
        lambda a: np.dstack([a[..., :3] / 2 + of_colours(a) / 2, a[..., 3:]]),
        "additive",
        "light is added, and none is removed",
        correct=_keeps,
    ),
    "a width in pixels": of_linear(
        gaussian, "resolution", "the radius of 50 %", correct=in_shares_of_the_height
    ),
}

#: Each law but `reference` has a fault that breaks it.
FAULTS: dict[str, Fault] = {
    **_LINEAR,
    "wraps around": Fault(
        lambda: lambda a: gaussian(a, mode="wrap"),
        lambda: gaussian,
        "border",
        "at the opposite side",
    ),
    "mirrors": Fault(
        lambda: lambda a: gaussian(a, 4.0, mode="reflect"),
        lambda: wide,
        "border",
        "where the middle has none",
    ),
    "stale margin": Fault(stale_margin, lambda: gaussian, "border", "after a bright, larger image"),
    "leaks between views": Fault(
        lambda: across_views, lambda: of_a_view, "views", "the other view changes the left one"
    ),
    "stretched to multiples of 16": Fault(
        lambda: stretch, lambda: lambda a: gaussian(a, 3.0), "sizes", "the width differs by"
    ),
    "half a texel off at odd sizes": Fault(
        lambda: off_at_odd_sizes, lambda: gaussian, "sizes", "the centroid differs by 0.707 pixels"
    ),
    "threshold after the reduction": Fault(
        lambda: lambda a: gaussian(double(above_one(halve(a)), a.shape)),
        lambda: lambda a: gaussian(double(halve(above_one(a)), a.shape)),
        "jitter",
        "a lit pixel blooms from 4",
    ),
    "square kernel": Fault(
        lambda: lambda a: box(a, 25), lambda: wider, "round", "times as far in one direction"
    ),
    "star-shaped kernel": Fault(lambda: cross, lambda: wider, "round", "at 0.01 of the peak"),
    "energy lost at the edge": Fault(
        lambda: darker_at_the_edge, lambda: gaussian, "border", "is in the frame"
    ),
    "black outside": Fault(
        lambda: lambda a: gaussian(a, mode="constant"),
        lambda: gaussian,
        "gain",
        "instead of 1 at x 0, y 0",
    ),
    "darkens transparent ground": Fault(
        lambda: picture(
            lambda alpha, glow: np.maximum(alpha, glow.max(axis=2, keepdims=True).clip(0, 1)),
            of_colours,
        ),
        lambda: _keeps,
        "alpha",
        "over a backdrop of 0.25",
    ),
    "glow cut off by alpha": Fault(
        lambda: picture(lambda alpha, _: alpha, of_opaque), lambda: _keeps, "alpha", "is too dark"
    ),
    "truncates half floats": Fault(
        lambda: halves(truncate),
        lambda: halves(lambda a: a.astype(np.float16).astype(np.float32)),
        "gain",
        "the mean gain of 16 values is off by -0.0",
    ),
    "flickers with jitter": Fault(lambda: every_other_pixel, lambda: wide, "jitter", "4 positions"),
    "keeps history": Fault(with_history, lambda: at_present, "history", "after a light has jumped"),
    "strobes": Fault(
        lambda: strobing, lambda: at_present, "history", "that stays the same changes by 1"
    ),
    "white outside": Fault(
        lambda: (
            lambda a: np.asarray(ndimage.gaussian_filter(a, (2, 2, 0), mode="constant", cval=1))
        ),
        lambda: gaussian,
        "border",
        "a black image has 0.",
    ),
    "the outermost pixels are not read": Fault(
        lambda: without_the_outermost, lambda: gaussian, "border", "a line in the outermost column"
    ),
    "the last column is black": Fault(
        lambda: last_column_black, lambda: gaussian, "gain", "0 instead of 1 at x 63, y 0"
    ),
    "stale columns": Fault(
        stale_columns, lambda: gaussian, "border", "after a bright image, a black one"
    ),
    "the last row is dropped at odd sizes": Fault(
        lambda: drops_the_last_row, lambda: gaussian, "sizes", "the border of a flat image differs"
    ),
    "a chain drops the last row at odd sizes": Fault(
        lambda: drops_odd, lambda: in_halves, "sizes", "the last pixel has 0 of the energy"
    ),
    "a chain drops the last column at the border": Fault(
        lambda: drops_odd, lambda: in_halves, "border", "at 49 x 49 the last pixel has 0 of"
    ),
    "leaks between stacked views": Fault(
        lambda: across_stacked_views, lambda: of_a_view, "views", "the upper one"
    ),
    "alpha is 1": Fault(
        lambda: picture(lambda alpha, _: np.ones_like(alpha), of_colours),
        lambda: _keeps,
        "alpha",
        "over a backdrop of 0.25",
    ),
    "alpha is multiplied twice": Fault(
        lambda: picture(lambda alpha, _: alpha**2, of_colours),
        lambda: _keeps,
        "alpha",
        "is too bright",
    ),
    "soft light": of_composite(soft_light, "on black, a light adds 0 of"),
    "light above 1 is lost": of_composite(
        lambda a, light: a + np.where(light > 1, 0, light), "a brighter light adds less"
    ),
    "light jumps at 1": of_composite(
        lambda a, light: a + light + 30 * (light > 0.5), "the bloom jumps by"
    ),
    "no light on colours above 1": of_composite(
        lambda a, light: a + light * (a <= 1), "on backdrops of 0.99 and 1.01"
    ),
    "too few components of a field": Fault(
        lambda: varying(2), varying, "field", "in place of its kernel's", field=LENS
    ),
    "each pixel collects by its own kernel": Fault(
        lambda: varying(gathers=True), varying, "field", "is off by", field=LENS
    ),
    "a frame late": Fault(a_frame_late, lambda: at_present, "history", "and 1 frames are above"),
}
