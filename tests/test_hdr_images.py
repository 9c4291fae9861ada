"""Bloom on real HDR images: equal to the reference, and none of what spoils a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from numpy.typing import NDArray
from tolerance import assert_matches_reference

from vkbloom import DualKawase, Pyramid, Renderer, Separable, Settings, reference

Image = NDArray[Any]
Array = NDArray[np.float64]

# Width, height and channels of the files.
PICTURES = {"Desk": (644, 874, 4), "BrightRings": (800, 800, 3)}
METHODS: dict[str, Settings] = {
    "separable": Separable(threshold=1.0),
    "loops": Separable(threshold=1.0, blur_scale=1.5, blur_strength=1.0, loops=3),
    "direct": Separable(threshold=1.0, direct=True),
    "half-size": Separable(threshold=1.0, bloom_scale=0.5),
    "pyramid": Pyramid(threshold=1.0),
    "firefly": Pyramid(threshold=1.0, firefly_filter=True),
    "dual-kawase": DualKawase(threshold=1.0),
}


@pytest.fixture(scope="module", params=PICTURES)
def picture(request: pytest.FixtureRequest, shared_data: Path) -> Image:
    """One of the images as float32; they are stored as half, so that float16 loses nothing."""
    path = shared_data / "hdr" / f"{request.param}.exr"
    buffer = oiio.ImageBuf(str(path))
    image: Image = np.asarray(buffer.get_pixels(oiio.FLOAT))
    assert not buffer.has_error, buffer.geterror()
    width, height, channels = PICTURES[request.param]
    assert image.shape == (height, width, channels)
    return image


@pytest.fixture(params=METHODS)
def settings(request: pytest.FixtureRequest) -> Settings:
    return METHODS[request.param]


def apply(renderer: Renderer, image: Image, settings: Settings) -> dict[str, Array]:
    """Return the colours of all framebuffers as float64."""
    frames = renderer.apply(image, settings)
    return {name: array[..., :3].astype(np.float64) for name, array in frames.items()}


@pytest.mark.parametrize("dtype", ["float16", "float32"])
def test_reference(renderer: Renderer, picture: Image, settings: Settings, dtype: str) -> None:
    image = picture.astype(dtype)
    frames = renderer.apply(image, settings)
    # The files hold neither NaN nor infinity, and none comes in.
    assert (frames.info["nan"], frames.info["inf"]) == (0, 0)
    assert_matches_reference(frames, image, settings)


@pytest.mark.parametrize("tonemap", ["reinhard", "aces", "khronos_neutral", "agx"])
def test_reference_tone_mapped(renderer: Renderer, picture: Image, tonemap: Any) -> None:
    settings = Pyramid(
        threshold=1.0, composite="mix", intensity=0.2, tonemap=tonemap, encoding="srgb"
    )
    assert_matches_reference(renderer.apply(picture, settings), picture, settings)


def displacement(image: Array, other: Array) -> tuple[float, float]:
    """Return (y, x) of the largest cross-correlation, to a part of a pixel."""
    sizes = [2 * side for side in image.shape]
    spectrum = np.conj(np.fft.rfft2(image, sizes)) * np.fft.rfft2(other, sizes)
    correlation = np.fft.irfft2(spectrum, sizes)
    peak = np.unravel_index(int(correlation.argmax()), correlation.shape)
    place = []
    for axis, at in enumerate(map(int, peak)):
        before, top, after = (
            float(np.roll(correlation, 1 - at, axis)[tuple(
                i if a == axis else int(p) for a, p in enumerate(peak)
            )])
            for i in range(3)
        )
        # The top of the parabola through the peak and its neighbours.
        part = (before - after) / (2 * (before - 2 * top + after))
        side = sizes[axis]
        place.append((at + side // 2) % side - side // 2 + part)
    return place[0], place[1]


def test_no_shift(renderer: Renderer, picture: Image, settings: Settings) -> None:
    frames = apply(renderer, np.maximum(picture, 0), settings)
    moved = displacement(frames["glow"].sum(axis=-1), frames["bloom"].sum(axis=-1))
    assert np.abs(moved).max() < 0.1


def test_no_ringing(renderer: Renderer, picture: Image, settings: Settings) -> None:
    """Nothing is darker for the bloom beside it, nor brighter than flat white would be."""
    image = np.maximum(picture, 0)
    frames = apply(renderer, image, settings)
    brightest = reference.gain(settings.replace(threshold=None)) * frames["glow"].max()
    for name, framebuffer in frames.items():
        assert framebuffer.min() >= 0, name
    assert frames["bloom"].max() <= brightest * (1 + 1e-5)
    assert (frames["final"] >= image[..., :3]).all()


def border(image: Array, width: int = 4) -> Array:
    """Return the pixels of a ring along the edges."""
    inner = np.ones(image.shape[:2], bool)
    inner[width:-width, width:-width] = False
    ring: Array = image[inner]
    return ring


def test_no_dark_border(renderer: Renderer, picture: Image, settings: Settings) -> None:
    """The bloom goes on beyond the edge as if the edge's pixels did."""
    # A multiple of all levels' texels, so that these keep their places.
    pad = 64
    height, width = (side // 64 * 64 for side in picture.shape[:2])
    image = np.maximum(picture[:height, :width, :3], 0)
    # The threshold comes before: what is bright at the edge is what goes on.
    padded = np.pad(image, ((pad, pad), (pad, pad), (0, 0)), mode="edge")
    frames = apply(renderer, image, settings)
    larger = apply(renderer, padded, settings)["bloom"][pad:-pad, pad:-pad]
    assert border(frames["final"]).mean() >= border(image).mean()
    # Not equal: the level's texels beyond the edge are the edge's one texel, not the picture's
    # edge seen from there.
    assert border(frames["bloom"]).mean() >= 0.9 * border(larger).mean()


def far_from(lit: NDArray[np.bool_], distance: int) -> NDArray[np.bool_]:
    """Return the pixels with nothing lit in the square of that half-width around them."""
    count = np.pad(lit.astype(np.int64), distance).cumsum(0).cumsum(1)
    count = np.pad(count, ((1, 0), (1, 0)))
    side = 2 * distance + 1
    sums = count[side:, side:] - count[:-side, side:] - count[side:, :-side]
    far: NDArray[np.bool_] = sums + count[:-side, :-side] == 0
    return far


# Where there is no bloom at all that far away, there is nothing to see.
@pytest.mark.parametrize("levels", [4, 5, 6])
@pytest.mark.parametrize("method", [Pyramid, DualKawase])
def test_no_blocks(renderer: Renderer, picture: Image, method: Any, levels: int) -> None:
    """Away from what glows, the bloom comes from the small levels alone, and must be smooth.

    Along a row, d1 is the difference of neighbours and d2 that of neighbouring d1. Flat blocks
    have a step at each of their edges, and so two d2 as large as the one d1: the sum of |d2| is
    twice that of |d1|. Straight lines between the texels of a level have d2 where they meet
    alone, and a smooth hill of a width of n pixels has a ratio of about 4 / n.
    """
    image = np.maximum(picture, 0)
    frames = apply(renderer, image, method(threshold=8.0, levels=levels))
    bloom = frames["bloom"].sum(axis=-1)
    far = far_from(frames["glow"].any(axis=-1), 2**levels // 2)
    for axis in (0, 1):
        first, second = np.abs(np.diff(bloom, axis=axis)), np.abs(np.diff(bloom, 2, axis=axis))
        keep = np.moveaxis(far, axis, 0)
        slopes = np.moveaxis(first, axis, 0)[keep[1:]].sum()
        bends = np.moveaxis(second, axis, 0)[keep[1:-1]].sum()
        assert slopes > 0
        assert bends / slopes < 0.25
