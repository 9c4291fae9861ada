"""Faults of blooms that people have reported, each with a correct twin and the law it breaks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Image = NDArray[Any]
Bloom = Callable[..., Image]


class Fault(NamedTuple):
    """Functions that make the bloom: some keep a state."""

    fault: Callable[[], Bloom]
    twin: Callable[[], Bloom]
    law: str
    words: str


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


def stretched(image: Image) -> Image:
    """Blur in a buffer whose sides are multiples of 16, with steps of the image's texels."""
    height, width, _ = image.shape
    rows, columns = -(-height // 16) * 16 / height, -(-width // 16) * 16 / width
    return np.asarray(ndimage.gaussian_filter(image, (3 * rows, 3 * columns, 0), mode="nearest"))


def off_at_odd_sizes(image: Image) -> Image:
    shift = (0.5 * (image.shape[0] % 2), 0.5 * (image.shape[1] % 2), 0)
    return np.asarray(ndimage.shift(gaussian(image), shift, order=1, mode="nearest"))


def halved(image: Image) -> Image:
    height, width, channels = image.shape
    even = np.pad(image, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
    boxes = even.reshape((height + 1) // 2, 2, (width + 1) // 2, 2, channels)
    return np.asarray(boxes.mean((1, 3)))


def doubled(image: Image, shape: tuple[int, ...]) -> Image:
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


def truncated(image: Image) -> Image:
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
    small = halved(image if pads else image[: height // 2 * 2, : width // 2 * 2])
    large = doubled(gaussian(small), image.shape)
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


_keeps = picture(lambda alpha, _: alpha, of_colours)

FAULTS: dict[str, Fault] = {
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
        lambda: stretched, lambda: lambda a: gaussian(a, 3.0), "sizes", "the width differs by"
    ),
    "half a texel off at odd sizes": Fault(
        lambda: off_at_odd_sizes, lambda: gaussian, "sizes", "the centroid differs by 0.707 pixels"
    ),
    "threshold after the reduction": Fault(
        lambda: lambda a: gaussian(doubled(above_one(halved(a)), a.shape)),
        lambda: lambda a: gaussian(doubled(halved(above_one(a)), a.shape)),
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
        lambda: halves(truncated),
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
    "a frame late": Fault(a_frame_late, lambda: at_present, "history", "and 1 frames are above"),
}
