"""Golden frames: what was looked at and found right stays as it is.

``pytest --bloom-update`` writes them into ``bloom_references``; look at them and commit them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom

if TYPE_CHECKING:
    from vkbloom.testing import FrameRegression


def test_forward_scene(bloom_renderer: vkbloom.Renderer, frame_regression: FrameRegression) -> None:
    """Compare every framebuffer, from the glow to the final picture."""
    settings = vkbloom.presets["tutorial"].replace(bloom_size=(64, 64))
    frame_regression.check(bloom_renderer.render(vkbloom.Scene.ufo(), settings, (96, 54)))


@pytest.mark.parametrize("name", ["bevy_natural", "kino"])
def test_preset(
    bloom_renderer: vkbloom.Renderer,
    frame_regression: FrameRegression,
    picture: NDArray[np.float32],
    name: str,
) -> None:
    """Compare the picture with bloom, as half floats."""
    frames = bloom_renderer.apply(
        picture.astype(np.float16), vkbloom.presets[name], framebuffers=["final"]
    )
    frame_regression.check(frames)
