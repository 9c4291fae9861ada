"""Plans of the core without a renderer, what the package hands to the core, and derivatives."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest

from tests.scene.parts import Cubemap, Mesh
from vkbloom import Scene, _core
from vkbloom._gradients.passes import DeviceGradients, Passes, in_floats
from vkbloom._gradients.pulling import pull_each
from vkbloom._gradients.sums import device_fields
from vkbloom._renderer.adapter import bundled_driver
from vkbloom._renderer.new_arrays import new_array, new_arrays
from vkbloom._renderer.sources import Inputs, image_source
from vkbloom._scene.blocks import contents_arguments, frame_block
from vkbloom._scene.blocks import scene_source as frame_of

__all__ = [
    "MESH",
    "SCENES",
    "SKY",
    "DeviceGradients",
    "Inputs",
    "Passes",
    "Row",
    "bundled_driver",
    "change",
    "contents_arguments",
    "device_fields",
    "frame_block",
    "frame_of",
    "image_source",
    "in_floats",
    "new_array",
    "new_arrays",
    "pull_each",
    "rows",
    "scene_plan",
    "scene_source",
    "watch_submissions",
]

MESH = Mesh(np.zeros((3, 9), np.float32), np.arange(3, dtype=np.uint32))
SKY = Cubemap((np.zeros((6, 1, 1, 4), np.uint8),))
SCENES = {has_sky: Scene(MESH, MESH, SKY if has_sky else None) for has_sky in (False, True)}


def watch_submissions(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return a list that gets the kind of each submission of passes of derivatives."""
    submitted: list[str] = []
    submit = Passes.submit

    def watched(passes: Passes, results: Any = "images", fields: Any = None) -> Any:
        submitted.append(results)
        return submit(passes, results, fields)

    monkeypatch.setattr(Passes, "submit", watched)
    return submitted


def change(block: bytes, **places: int) -> bytes:
    """Return a block of the core with other numbers of 32 bits at some places, `at12` and so on."""
    numbers = np.frombuffer(block, np.uint32).copy()
    for place, number in places.items():
        numbers[int(place.removeprefix("at"))] = number
    return numbers.tobytes()


def scene_source(
    size: Any = (1280, 720), *, has_sky: bool = True, shading: str = "forward"
) -> _core.Source:
    """Return a frame of a triangle."""
    return frame_of(SCENES[has_sky], size, shading, 0.0)


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
