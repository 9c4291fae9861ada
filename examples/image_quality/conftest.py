"""What all tests of the suite share: the renderer and the picture."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom


@pytest.fixture(scope="session")
def bloom_renderer() -> Iterator[vkbloom.Renderer]:
    """Run on the software driver, which gives the same golden frames on every machine.

    Wrong use of Vulkan fails a test, where the Khronos validation layer is installed.
    """
    try:
        renderer = vkbloom.Renderer("software", validation=True)
    except vkbloom.Error as error:
        if isinstance(error, vkbloom.ValidationError) or "validation" not in str(error):
            raise
        renderer = vkbloom.Renderer("software")
    with renderer:
        yield renderer


@pytest.fixture(scope="session")
def picture(bloom_renderer: vkbloom.Renderer) -> NDArray[np.float32]:
    """Render the built-in scene without bloom: (54, 96, 3), its lights 6 times as bright as white.

    Replace it by a picture of your own: ``vkbloom.read("before_bloom.exr")``.
    """
    scene = dataclasses.replace(vkbloom.Scene.ufo(), glow_intensity=6.0)
    frames = bloom_renderer.render(scene, size=(96, 54), shading="deferred", framebuffers=["scene"])
    return frames["scene"][..., :3].astype(np.float32)
