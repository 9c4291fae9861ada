"""Plans of the core without a renderer."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from vkbloom import _core

VERTICES = np.zeros((3, 9), np.float32)
INDICES = np.arange(3, dtype=np.uint32)
MESH = (VERTICES, INDICES, None, None, ())
SKY = (np.zeros((6, 1, 1, 4), np.uint8),)
CAMERA = ((0.0, 0.0, -10.0), (0.0, 0.0, 0.0), 45.0, 0.1, 256.0)


def scene_source(
    size: Any = (1280, 720), *, has_sky: bool = True, shading: str = "forward", serial: int = 1
) -> _core.Source:
    """Return a frame of a triangle."""
    sky = SKY if has_sky else ()
    return _core.scene_source((serial, MESH, MESH, sky, ()), CAMERA, size, shading, 0.0, 1.0)


def scene_plan(
    settings: object, size: Any = (1280, 720), has_sky: bool = True, shading: str = "forward"
) -> _core.Plan:
    """Return the plan of all framebuffers of a frame, in the fragment variant."""
    source = scene_source(size, has_sky=has_sky, shading=shading)
    return _core.plan(source, settings, None)


class Row(NamedTuple):
    """A pass as the core describes it."""

    name: str
    shader: str
    reads: tuple[str, ...]
    writes: tuple[str, ...]
    variant: str
    render_pass: int


def rows(plan: _core.Plan) -> list[Row]:
    """Return the passes of a plan."""
    return [Row(*row) for row in plan.passes]
