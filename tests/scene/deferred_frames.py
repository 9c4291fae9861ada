"""Frames of deferred shading, and the names of their framebuffers."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vkbloom import Frames, Renderer, Scene, Settings

SIZE = (320, 180)
GBUFFER = ["albedo", "normal", "position", "brightness", "depth"]
BLURRED = ["blur_vertical", "bloom"]
LIT = ["scene", "final"]


def deferred(
    renderer: Renderer,
    scene: Scene,
    settings: Settings | None = None,
    size: tuple[int, int] = SIZE,
    **more: Any,
) -> Frames:
    return renderer.render(scene, settings, size, shading="deferred", **more)


def rgb(image: NDArray[Any]) -> NDArray[np.float64]:
    return image[..., :3].astype(np.float64)
