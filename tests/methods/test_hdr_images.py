"""Bloom on real HDR images, without visible artefacts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from numpy.typing import NDArray

from vkbloom import DualKawase, Pyramid, Renderer, Separable, Settings

Image = NDArray[Any]
Array = NDArray[np.float64]

# Width, height and channels of the files.
PICTURES = {"Desk": (644, 874, 4), "BrightRings": (800, 800, 3)}
METHODS: dict[str, Settings] = {
    "separable": Separable(threshold=1.0),
    "loops": Separable(threshold=1.0, blur_scale=1.5, blur_strength=1.0, loops=3),
    "direct": Separable(threshold=1.0, direct=True),
    # At the default strength the taps beside the centre weigh more than it does: at half size the
    # cross-correlation then has a peak to each side.
    "half-size": Separable(threshold=1.0, bloom_scale=0.5, blur_strength=1.0),
    "pyramid": Pyramid(threshold=1.0),
    "firefly": Pyramid(threshold=1.0, firefly_filter=True),
    "dual-kawase": DualKawase(threshold=1.0),
}


@pytest.fixture(scope="module", params=PICTURES)
def photo(request: pytest.FixtureRequest, shared_data: Path) -> Image:
    """One of the images as float32; they are stored as half, so that float16 loses nothing."""
    path = shared_data / "hdr" / f"{request.param}.exr"
    buffer = oiio.ImageBuf(str(path))
    image: Image = np.asarray(buffer.get_pixels(oiio.FLOAT))
    assert not buffer.has_error, buffer.geterror()
    width, height, channels = PICTURES[request.param]
    assert image.shape == (height, width, channels)
    return image


def crop(image: Image, part: int) -> Image:
    """Return a part of the height and width, with the brightest pixel in it."""
    height, width, _ = image.shape
    y, x = np.unravel_index(int(image[..., :3].sum(axis=-1).argmax()), (height, width))
    top = min(max(int(y) - height // part // 2, 0), height - height // part)
    left = min(max(int(x) - width // part // 2, 0), width - width // part)
    return np.ascontiguousarray(image[top : top + height // part, left : left + width // part])


def apply(renderer: Renderer, image: Image, settings: Settings) -> dict[str, Array]:
    """Return the colours of all framebuffers as float64."""
    frames = renderer.apply(image, settings)
    return {name: array[..., :3].astype(np.float64) for name, array in frames.items()}


# Of a chain's small level, the texels beyond the edge are the edge's, and so a mirror of them.
@pytest.mark.parametrize(
    ("method", "beyond"),
    [
        ("separable", "edge"),
        ("direct", "edge"),
        ("pyramid", "symmetric"),
        ("firefly", "symmetric"),
        ("dual-kawase", "symmetric"),
    ],
)
def test_no_dark_border(renderer: Renderer, photo: Image, method: str, beyond: Any) -> None:
    """At the edges the bloom is what it would be if the picture went on beyond them.

    Black beyond the edges would leave 0.6 of a chain's bloom there.
    """
    # A whole number of all levels' texels, so that they keep their places.
    pad = 64
    part = crop(photo, 2)
    height, width = (side // pad * pad for side in part.shape[:2])
    image = np.maximum(part[:height, :width, :3], 0)
    larger = np.pad(image, ((pad, pad), (pad, pad), (0, 0)), mode=beyond)
    frames = apply(renderer, image, METHODS[method])
    whole = apply(renderer, larger, METHODS[method])["bloom"][pad:-pad, pad:-pad]
    ring = np.ones((height, width), bool)
    ring[4:-4, 4:-4] = False
    assert frames["final"][ring].mean() >= (1 - 1e-6) * image[ring].mean(dtype=np.float64)
    if beyond == "edge":
        np.testing.assert_allclose(frames["bloom"], whole, rtol=0, atol=1e-5 * whole.max())
    else:
        assert frames["bloom"][ring].mean() >= 0.9 * whole[ring].mean()


def far_from(lit: NDArray[np.bool_], distance: int) -> NDArray[np.bool_]:
    """Return the pixels with nothing lit in the square of that half-width around them."""
    count = np.pad(lit.astype(np.int64), distance).cumsum(0).cumsum(1)
    count = np.pad(count, ((1, 0), (1, 0)))
    side = 2 * distance + 1
    sums = count[side:, side:] - count[:-side, side:] - count[side:, :-side]
    far: NDArray[np.bool_] = sums + count[:-side, :-side] == 0
    return far


@pytest.mark.parametrize("levels", [4, 6])
@pytest.mark.parametrize("method", [Pyramid, DualKawase])
def test_no_blocks(renderer: Renderer, photo: Image, method: Any, levels: int) -> None:
    """Away from what glows, the bloom comes from the small levels alone, and must be smooth.

    Along a row, d1 is the difference of neighbours and d2 that of neighbouring d1. Flat blocks
    have a step at each of their edges, and so two d2 as large as the one d1: the sum of |d2| is
    twice that of |d1|. Straight lines between the texels of a level have d2 where they meet
    alone, and a smooth hill of a width of n pixels has a ratio of about 4 / n.
    """
    image = np.maximum(photo, 0)
    frames = apply(renderer, image, method(threshold=8.0, levels=levels))
    bloom = frames["bloom"].sum(axis=-1)
    far = far_from((frames["glow"] > 0).max(axis=-1), 2**levels // 2)
    for axis in (0, 1):
        first, second = np.abs(np.diff(bloom, axis=axis)), np.abs(np.diff(bloom, 2, axis=axis))
        keep = np.moveaxis(far, axis, 0)
        slopes = np.moveaxis(first, axis, 0)[keep[1:]].sum()
        bends = np.moveaxis(second, axis, 0)[keep[1:-1]].sum()
        assert slopes > 0
        assert bends / slopes < 0.25
