"""An engine's own bloom against vkbloom's, buffer by buffer."""

from __future__ import annotations

from typing import TYPE_CHECKING

import engine
import numpy as np
from numpy.typing import NDArray

import vkbloom

if TYPE_CHECKING:
    from vkbloom.testing import FrameRegression

# What the engine's bloom is meant to be, in vkbloom's words.
SETTINGS = vkbloom.Separable(
    threshold=1.0,
    weights=(0.227027, 0.1945946, 0.1216216, 0.054054, 0.016216),
    blur_strength=1.0,
    intensity=0.6,
)


def test_every_buffer(
    bloom_renderer: vkbloom.Renderer,
    frame_regression: FrameRegression,
    picture: NDArray[np.float32],
) -> None:
    """On failure, the first line names the first buffer that differs: look at its pass."""
    ours = bloom_renderer.apply(picture, SETTINGS)
    frame_regression.compare(
        engine.frames(picture),
        {name: image[..., :3] for name, image in ours.items()},
        info={"adapter": "the engine"},
        expected_info=ours.info,
    )


def test_the_engine_extracts_something(picture: NDArray[np.float32]) -> None:
    """Two black buffers are equal, too."""
    share = (engine.frames(picture)["glow"].max(axis=2) > 0).mean()
    assert 0.01 < share < 0.5
