"""Images that tests apply bloom to, or store."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vkbloom._formats import IMAGE_DTYPES

DTYPES = IMAGE_DTYPES


def picture(
    width: int,
    height: int,
    channels: int = 4,
    dtype: str = "float32",
    seed: int = 0,
    *,
    power: int = 1,
    highest: float = 1.0,
) -> NDArray[Any]:
    """Return random values of 0 to `highest`; integers reach their type's largest value.

    The higher `power` is, the fewer values are high.
    """
    values = np.random.default_rng(seed).random((height, width, channels), dtype=np.float32)
    values = values**power if power > 1 else values
    is_integer = np.dtype(dtype).kind == "u"
    scaled: Any = values * np.float32(np.iinfo(dtype).max if is_integer else highest)
    result: NDArray[Any] = (np.rint(scaled) if is_integer else scaled).astype(dtype)
    return result


def hdr_picture(width: int, height: int, channels: int, dtype: str, seed: int = 0) -> NDArray[Any]:
    """Return random values, few of them high; floats reach from -0.5 to 7.5.

    Most of what 8 bits hold of its bloom stays under 1.
    """
    values = np.random.default_rng(seed).random((height, width, channels)) ** 2
    if dtype == "uint8":
        return np.rint(255 * values).astype(np.uint8)
    # Beyond what 8 bits hold, and below 0.
    return (8 * values - 0.5).astype(dtype)


def make_cut_out(width: int, height: int, dtype: str, seed: int = 0) -> NDArray[Any]:
    """Return a picture whose alpha is 0 to 1, and whose right quarter is transparent black."""
    image = hdr_picture(width, height, 4, dtype, seed)
    if dtype != "uint8":
        image[..., 3] = np.clip(image[..., 3] / 8, 0, 1)
    image[:, width - width // 4 :] = 0
    return image


def choose_given(names: Iterable[str], image: NDArray[Any]) -> dict[str, Any]:
    """Return a mask and an emission for an image, those that are named."""
    mask = np.random.default_rng(3).random(image.shape[:2], np.float32)
    mask[:9, :9] = 0
    every = {"mask": mask, "emission": image[::-1].copy()}
    return {name: every[name] for name in names}


def lights(
    width: int,
    height: int,
    channels: int = 3,
    dtype: str = "float32",
    seed: int = 3,
    *,
    highest: float = 40.0,
) -> NDArray[Any]:
    """Return dim noise with a few bright points, up to 1 in uint8, up to `highest` in floats."""
    generator = np.random.default_rng(seed)
    image = 0.8 * generator.random((height, width, channels)) ** 2
    points = generator.random((height, width)) < 0.02
    points[height // 2, width // 3] = True
    brightest = 1.0 if dtype == "uint8" else highest
    image[points, :3] = generator.random((int(points.sum()), min(channels, 3))) * brightest
    return np.rint(image * 255).astype(np.uint8) if dtype == "uint8" else image.astype(dtype)


def noise(*shape: int, dtype: str, seed: int = 1, spread: float = 100.0) -> NDArray[Any]:
    """Return any integers of the type, or floats below and above 0."""
    generator = np.random.default_rng(seed)
    if np.dtype(dtype).kind == "u":
        return generator.integers(0, np.iinfo(dtype).max, shape, dtype, endpoint=True)
    return (generator.standard_normal(shape) * spread).astype(dtype)


def noise_image(*shape: int, dtype: str = "float32", seed: int = 5) -> NDArray[Any]:
    """Return noise of any shape and dtype in 0..1; integers are scaled."""
    values = np.random.default_rng(seed).random(shape)
    if np.dtype(dtype).kind == "u":
        return np.rint(values * np.iinfo(dtype).max).astype(dtype)
    return values.astype(dtype)


def random_image(height: int, width: int, channels: int = 3, seed: int = 1) -> NDArray[np.float64]:
    """Return doubles of 0 to 1."""
    return np.random.default_rng(seed).random((height, width, channels))


def change(a: NDArray[Any], place: tuple[int, int, int], value: float) -> NDArray[Any]:
    """Return a copy with one value changed."""
    b = a.copy()
    b[place] = value
    return b
