"""The built-in saucer against references that were checked by eye.

They are small, and find unintended changes. The NumPy reference tests what a bloom makes of images.
"""

from __future__ import annotations

import pytest

from vkbloom import Renderer, Scene, presets
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
