"""The presets: each against its own NumPy reference, and the reference against its formulas."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from vkbloom import Renderer, Settings, presets, reference

Array = NDArray[Any]

# (width, height): odd, even, tall, wide, smaller than the chains are long.
SIZES = [(1, 1), (7, 1), (5, 13), (64, 48), (101, 67), (333, 217)]
FORMATS = {"uint8": "rgba8unorm", "float16": "rgba16float", "float32": "rgba32float"}
PUBLISHED = sorted(set(presets) - {"tutorial", "outline"})


@pytest.fixture(scope="module")
def preset_renderer() -> Iterator[Renderer]:
    with Renderer("software", validation=True) as renderer:
        yield renderer


def lights(size: tuple[int, int], dtype: str, seed: int = 3) -> Array:
    """Make dim noise with a few bright points; in float formats they go up to 40."""
    width, height = size
    generator = np.random.default_rng(seed)
    image = 0.8 * generator.random((height, width, 3)) ** 2
    points = generator.random((height, width)) < 0.01
    points[height // 2, width // 3] = True
    image[points] = generator.random((int(points.sum()), 3)) * (1 if dtype == "uint8" else 40)
    return np.round(image * 255).astype(np.uint8) if dtype == "uint8" else image.astype(dtype)


def real(array: Array) -> NDArray[np.float64]:
    values = array.astype(np.float64)
    return values / 255 if array.dtype == np.uint8 else values


def tolerance(name: str, expected: Array, format: str) -> float:
    """Largest difference that the rounding of the buffers explains."""
    if format == "rgba8unorm":
        return 2 / 255  # a chain of 8-bit stages
    largest = max(1.0, float(np.abs(expected).max()))
    return (1e-4 if format == "rgba32float" else 2e-3) * largest


def check(renderer: Renderer, image: Array, settings: Settings) -> None:
    """All framebuffers of the image equal those of the reference."""
    frames = renderer.apply(image, settings)
    expected = reference.apply(image, settings)
    assert list(frames) == list(expected)
    format = settings.format or FORMATS[image.dtype.name]
    for name, values in expected.items():
        actual = real(frames[name])
        assert actual.shape == values.shape, name
        # What is right in the bloom buffers is rounded once more in an 8-bit picture.
        stored = "rgba8unorm" if name == "final" and image.dtype == np.uint8 else format
        assert_allclose(actual, values, rtol=0, atol=tolerance(name, values, stored), err_msg=name)


@pytest.mark.parametrize("dtype", FORMATS)
@pytest.mark.parametrize("size", SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
@pytest.mark.parametrize("name", PUBLISHED)
def test_a_preset_is_its_reference(
    preset_renderer: Renderer, name: str, size: tuple[int, int], dtype: Any
) -> None:
    format: Any = FORMATS[dtype]
    check(preset_renderer, lights(size, dtype), presets[name].replace(format=format))


@pytest.mark.parametrize("dtype", FORMATS)
@pytest.mark.parametrize("name", PUBLISHED)
def test_a_preset_as_it_is(preset_renderer: Renderer, name: str, dtype: str) -> None:
    check(preset_renderer, lights((97, 45), dtype), presets[name])


@pytest.mark.parametrize("name", PUBLISHED)
def test_a_flat_image_gets_the_gain(preset_renderer: Renderer, name: str) -> None:
    settings = presets[name].replace(format="rgba32float")
    bloom = preset_renderer.apply(np.ones((45, 71, 3), np.float32), settings)["bloom"]
    assert_allclose(bloom[..., :3], reference.gain(settings), rtol=1e-5)
    assert_allclose(
        reference.blur(np.ones((45, 71, 3)), settings), reference.gain(settings), rtol=1e-9
    )


@pytest.mark.parametrize("name", PUBLISHED)
def test_nan_and_infinity_are_not_spread(preset_renderer: Renderer, name: str) -> None:
    image = lights((33, 21), "float32")
    image[4, 5, 0], image[10, 20, 1], image[20, 0, 2] = np.nan, np.inf, -np.inf
    frames = preset_renderer.apply(image, presets[name])
    clean = np.where(np.isfinite(image), image, 0).astype(np.float32)
    expected = preset_renderer.apply(clean, presets[name])
    for framebuffer in set(frames) - {"final"}:
        assert np.array_equal(frames[framebuffer], expected[framebuffer]), framebuffer
    assert np.array_equal(np.isfinite(frames["final"]), np.isfinite(image))
