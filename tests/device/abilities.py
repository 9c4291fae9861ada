"""What the adapter of a renderer can do, for tests that depend on it."""

from __future__ import annotations

import re

import numpy as np
import pytest

from vkbloom import Renderer, Separable


def has_linear_texels(renderer: Renderer) -> bool:
    """Whether passes access images as buffers, for which llvmpipe has all (csrc/vulkan/device.c).

    SwiftShader has neither linear storage images nor 64-bit integers.
    """
    plan = renderer.plan(np.zeros((8, 8, 3), np.float32), Separable())
    found = any("linear" in one.shader for one in plan.passes)
    assert found or "llvmpipe" not in renderer.info.name
    return found


def max_side(renderer: Renderer) -> int:
    """Return the largest side of an image in pixels; SwiftShader's is 8192."""
    with pytest.raises(ValueError, match="adapter's range") as caught:
        renderer.plan(np.broadcast_to(np.uint8(0), (1, 1 << 20, 3)))
    side = int(re.findall(r"1 to (\d+) a side", str(caught.value))[0])
    assert side >= 16384 or "llvmpipe" not in renderer.info.name
    return side


def infinities(renderer: Renderer, dtype: str) -> tuple[float, float]:
    """Return what images of a dtype hold of positive and negative infinity.

    SwiftShader's half floats hold NaN.
    """
    image = np.full((1, 1, 3), np.inf, np.float16)
    held = renderer.apply(image, Separable(bloom=False))["final"][0, 0, 0]
    assert held == np.inf or (np.isnan(held) and "SwiftShader" in renderer.info.name)
    is_held = dtype != "float16" or held == np.inf
    return (np.inf, -np.inf) if is_held else (np.nan, np.nan)
