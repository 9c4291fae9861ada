"""What `apply` makes of extreme values, against `vkbloom.reference`: curves, exposures, thresholds.

Formats, presets and last passes are cases of the self-test (tests/device/test_self_test.py).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.exhaustive import EXHAUSTIVE, by_turns, some
from tests.images import DTYPES, hdr_picture
from tests.methods.cases import COMPOSITES, ENCODINGS, METHODS, TONEMAPS
from tests.tolerance import assert_close, assert_matches_reference, real, tolerance
from vkbloom import Renderer, Separable, Settings, presets, reference

Image = NDArray[Any]


def flat(value: Any, dtype: str, size: tuple[int, int] = (37, 22)) -> Image:
    width, height = size
    return np.full((height, width, 3), value, dtype)


def test_reference_of_a_large_image(renderer: Renderer) -> None:
    size = (1920, 1080) if EXHAUSTIVE else (640, 360)
    image = hdr_picture(*size, 3, "float16")
    settings = METHODS["pyramid-firefly"].replace(bloom_scale=0.5)
    assert_matches_reference(renderer.apply(image, settings), image, settings)


def test_no_settings_are_bevys(renderer: Renderer) -> None:
    image = hdr_picture(40, 20, 3, "uint8")
    assert renderer.apply(image).settings == presets["bevy_natural"]
    image = hdr_picture(300, 20, 3, "uint8")
    # An image keeps its own size where a forward scene would have 256 x 256.
    frames = renderer.apply(image, Separable())
    assert frames["blur_vertical"].shape == (20, 300, 4)
    assert_matches_reference(frames, image, Separable())


# --- Composite, exposure, tone map, encoding ---


# Away from black, where the encodings are so steep that half a level of bloom, which may or may
# not be rounded before the composite, is several levels of final.
def bright(dtype: str) -> Image:
    values = 0.1 + 0.8 * np.random.default_rng(3).random((14, 19, 4))
    return np.rint(255 * values).astype(np.uint8) if dtype == "uint8" else values.astype(dtype)


@pytest.mark.parametrize(
    ("tonemap", "exposure", "dtype"),
    by_turns(TONEMAPS, [-32.0, -3.5, 0.0, 1.0, 8.0, 32.0], turns=DTYPES),
)
def test_exposure(renderer: Renderer, dtype: str, tonemap: Any, exposure: float) -> None:
    """Compare final with what the reference makes of the renderer's own bloom."""
    settings, image = Separable(tonemap=tonemap, exposure=exposure, intensity=0.5), bright(dtype)
    frames = renderer.apply(image, settings, framebuffers=("bloom", "final"))
    expected = reference.composite(image, frames["bloom"], settings)
    assert_close("final", frames["final"], expected, tolerance(image.dtype, expected))


@pytest.mark.parametrize(
    ("tonemap", "encoding", "dtype"), by_turns(TONEMAPS, ENCODINGS, turns=["float16", "float32"])
)
def test_negative_colours(renderer: Renderer, dtype: str, tonemap: Any, encoding: Any) -> None:
    # Not around -1, where Reinhard's curve has its pole.
    values = np.concatenate([np.linspace(-3, -1.3, 40), np.linspace(-0.7, 0.7, 40)])
    image = np.random.default_rng(5).permuted(np.tile(values, (3, 3, 1)), axis=-1)
    image = image.swapaxes(0, 2).astype(dtype)
    settings = Separable(bloom=False, tonemap=tonemap, encoding=encoding)
    assert_composite_without_bloom(renderer, image, settings)


def colours(value: float, dtype: str) -> Image:
    """Bright grey, primaries and mixed colours."""
    rows = [(1, 1, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0.5, 0.25), (0.1, 1, 0.01)]
    return (value * np.array([rows], np.float64)).astype(dtype)


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("tonemap", TONEMAPS)
def test_huge_colours(renderer: Renderer, tonemap: Any, encoding: Any) -> None:
    settings = Separable(bloom=False, tonemap=tonemap, encoding=encoding)
    for value in (1000.0, 65504.0):
        assert_composite_without_bloom(renderer, colours(value, "float16"), settings)
    for value in (1000.0, 65504.0, 1e12, 1e25, float(np.finfo(np.float32).max)):
        for sign in (1, -1):
            assert_composite_without_bloom(renderer, colours(sign * value, "float32"), settings)
    for dtype in ("float16", "float32") if encoding == "none" else ():
        image = colours(float(np.finfo(dtype).max), dtype)
        assert_composite_without_bloom(renderer, image, settings.replace(exposure=32.0))


@pytest.mark.parametrize(
    ("tonemap", "encoding", "composite"), by_turns(TONEMAPS, ENCODINGS, turns=COMPOSITES)
)
def test_dark_colours(renderer: Renderer, composite: Any, tonemap: Any, encoding: Any) -> None:
    # An encoding spreads the dark, and with it what a difference of two ones has lost there.
    values = np.geomspace(1e-9, 1e-3, 3 * 120).reshape(1, 120, 3)
    image = np.random.default_rng(3).permuted(values, axis=1).astype(np.float32)
    settings = Separable(
        intensity=0.5, composite=composite, tonemap=tonemap, encoding=encoding, blur_strength=0.3
    )
    assert_matches_reference(renderer.apply(image, settings), image, settings)


def assert_composite_without_bloom(renderer: Renderer, image: Image, settings: Settings) -> None:
    frames = renderer.apply(image, settings)
    largest = float(np.finfo(image.dtype).max)
    # The reference has no end in float32; the device's numbers do.
    expected = np.clip(reference.composite(image, None, settings), -largest, largest)
    limit = tolerance(image.dtype, expected)
    if settings.encoding in ("gamma22", "pq"):
        # Vulkan derives pow(x, y) from exp2(y log2(x)), whose logarithm of 0 need not be infinite:
        # of a black picture, SwiftShader makes 4e-18 and, with PQ, 2e-10 too much.
        limit = np.maximum(limit, 1e-9)
    assert_close("final", frames["final"], expected, limit)


@pytest.mark.parametrize(("method", "dtype"), by_turns(METHODS, turns=["float16", "float32"]))
def test_largest_numbers_do_not_overflow(renderer: Renderer, method: str, dtype: str) -> None:
    largest = np.finfo(dtype).max
    for sign in (1, -1):
        frames = renderer.apply(flat(sign * largest, dtype), METHODS[method])
        for name, array in frames.items():
            assert np.isfinite(array).all(), name
    if dtype == "float16":
        assert_matches_reference(
            renderer.apply(flat(largest, dtype), METHODS[method]),
            flat(largest, dtype),
            METHODS[method],
        )


def test_a_grey_level_that_is_the_threshold_stays_out(renderer: Renderer) -> None:
    levels = np.arange(256, dtype=np.uint8)
    ramp = np.repeat(levels[None, :, None], 3, axis=2)
    for level in some(range(256), 52):
        settings = Separable(threshold=level / 255)
        glow = renderer.apply(ramp, settings, framebuffers="glow")["glow"][0, :, 0]
        np.testing.assert_array_equal(glow, np.where(levels > level, levels, 0), str(level))


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("scale", [0.37, 0.5, 1.0, 2.5])
def test_a_flat_grey_that_is_the_threshold_stays_out_at_every_size(
    renderer: Renderer, scale: float, dtype: Any
) -> None:
    levels = (51, 102, 153, 204, 255) if dtype == "uint8" else (0.1, 0.3, 0.7, 1.0, 1.1, 3.0)
    for level in levels:
        image = flat(level, dtype, (41, 37))
        threshold = float(real(image)[0, 0, 0])
        settings = Separable(threshold=threshold, bloom_scale=scale)
        assert not renderer.apply(image, settings, framebuffers="glow")["glow"][..., :3].any()
        settings = settings.replace(threshold=threshold - 1 / 255)
        glow = renderer.apply(image, settings, framebuffers="glow")["glow"]
        if dtype == "uint8":
            np.testing.assert_array_equal(glow[..., :3], level)
        else:
            np.testing.assert_allclose(glow[..., :3], threshold, rtol=1e-3)
