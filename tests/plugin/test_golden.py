"""The built-in saucer and a picture against references that were checked by eye.

They are small, and find unintended changes. The laws and the NumPy reference test correctness.
"""

from __future__ import annotations

import numpy as np
import pytest

from vkbloom import DualKawase, Pyramid, Renderer, Scene, Separable, presets
from vkbloom.testing import FrameRegression

# 16:9, as the source's frame, and so small that all references together are 1 MB at most.
SIZE = (96, 54)


@pytest.fixture(autouse=True)
def drawn_by_lavapipe(renderer: Renderer) -> None:
    if "llvmpipe" not in renderer.info.name:
        pytest.skip("lavapipe drew the references: edges and depths of another device differ")


@pytest.mark.parametrize("preset", ["tutorial", "outline"])
def test_forward(
    renderer: Renderer, scene: Scene, frame_regression: FrameRegression, preset: str
) -> None:
    settings = presets[preset].replace(bloom_size=(64, 64))
    frame_regression.check(renderer.render(scene, settings, SIZE))


def test_deferred(renderer: Renderer, scene: Scene, frame_regression: FrameRegression) -> None:
    settings = presets["deferred"].replace(bloom_scale=0.5, tonemap="aces", encoding="gamma22")
    frame_regression.check(renderer.render(scene, settings, SIZE, shading="deferred"))


METHODS = {
    "separable": Separable(threshold=0.4, knee=0.5),
    "pyramid": Pyramid(levels=3, threshold=0.5, firefly_filter=True),
    "dual_kawase": DualKawase(levels=3, composite="screen"),
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("dtype", ["uint8", "float16"])
def test_of_an_image(
    renderer: Renderer,
    scene: Scene,
    frame_regression: FrameRegression,
    method: str,
    dtype: str,
) -> None:
    # Only the scene, since variants of a bloom may round differently.
    picture = renderer.render(scene, size=SIZE, framebuffers=("scene",))["scene"]
    if dtype == "float16":
        # Brighter than 1, as a picture before its tone map is.
        picture = (4 * (picture / np.float32(255)) ** 2).astype(np.float16)
        picture[..., 3] = 1
    frame_regression.check(renderer.apply(picture, METHODS[method]), f"{method}-{dtype}")
