"""A test render whose right result is known: four framebuffers checked against figures.

The scene is made of two rectangles in code, so no file and no optional package is needed.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from vkbloom import reference
from vkbloom.frames import Frames
from vkbloom.renderer import Renderer
from vkbloom.scene import Camera, Mesh, Scene
from vkbloom.settings import Separable

SIZE: Final = (64, 48)
SETTINGS: Final = Separable(bloom_size=(32, 24))

_GLOW: Final = (1.0, 0.5, 0.25)
_BODY: Final = (0.5, 0.25, 0.125)
_CAMERA: Final = Camera(
    position=(0.0, 0.0, -10.0), rotation=(0.0, 0.0, 0.0), fov=90.0, near=1.0, far=100.0
)
# At time 0 the animation moves a model by (0, -1, 0.25) and does not turn it; so these give a
# rectangle at z = 0, whose side lies at y = 0.
_LIFT, _BACK = 1.0, -0.25
# Far outside of the picture, whose half height is 10 where the rectangles are.
_BEYOND = 100.0
# Perspective depth 0..1 of the distance d = 10: far / (far - near) * (1 - near / d).
_DEPTH: Final = 100 / 99 * (1 - 1 / 10)

# Levels of 255. Half a level from rounding blur_vertical, times the gain 1.39 of the next pass,
# half a level from rounding that, and 1/256 in the weights of a device's bilinear filter, which
# is another level where black meets white.
_BLUR_TOLERANCE: Final = 3.0
_GLOW_TOLERANCE: Final = 1.0
# A rasterizer's interpolation of depth; lavapipe is within 4e-7.
_DEPTH_TOLERANCE: Final = 1e-4


def _rectangle(
    x: tuple[float, float], y: tuple[float, float], colour: tuple[float, float, float]
) -> Mesh:
    corners = [(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])]
    vertices = [(a, b, _BACK, 0.0, 0.0, 1.0, *colour) for a, b in corners]
    # Both windings: one of them is the front.
    indices = [0, 1, 2, 0, 2, 3, 0, 2, 1, 0, 3, 2]
    return Mesh(np.array(vertices, np.float32), np.array(indices, np.uint32))


def render(renderer: Renderer) -> Frames:
    """Render the test scene: a body on the upper half, a glow on the left one.

    Parameters
    ----------
    renderer : Renderer

    Returns
    -------
    Frames
        `SIZE` pixels with the bloom of `SETTINGS`.
    """
    scene = Scene(
        body=_rectangle((-_BEYOND, _BEYOND), (-_BEYOND, _LIFT), _BODY),
        glow=_rectangle((-_BEYOND, 0.0), (-_BEYOND, _BEYOND), _GLOW),
        camera=_CAMERA,
    )
    return renderer.render(scene, SETTINGS, SIZE)


def differences(frames: Frames) -> list[str]:
    """Compare the framebuffers of `render` with what they must hold.

    `glow` and `depth` are compared with figures that follow from the geometry, `blur_vertical`,
    `bloom` and `final` with `vkbloom.reference`.

    Parameters
    ----------
    frames : Frames

    Returns
    -------
    list of str
        A sentence for each framebuffer that is wrong; empty where all are right.
    """
    glow = np.zeros_like(frames["glow"])
    glow[:, : glow.shape[1] // 2, :3] = np.round(255 * np.array(_GLOW))
    glow[:, :, 3] = 255
    depth = np.ones_like(frames["depth"])
    depth[: depth.shape[0] // 2] = _DEPTH
    expected = reference.passes(frames["glow"], SETTINGS, SIZE)
    expected["final"] = reference.composite(
        frames["scene"], expected["bloom"], SETTINGS, frames["final"].dtype
    )
    blurred = ("blur_vertical", "bloom", "final")
    rows = [
        ("glow", _largest(frames["glow"], glow), _GLOW_TOLERANCE),
        ("depth", _largest(frames["depth"], depth), _DEPTH_TOLERANCE),
        *(
            (name, _largest(frames[name], 255 * expected[name]), _BLUR_TOLERANCE)
            for name in blurred
        ),
    ]
    return [
        f"{name} is up to {difference:.3g} off, {tolerance:g} is allowed"
        for name, difference, tolerance in rows
        # So written, NaN is off as well.
        if not difference <= tolerance
    ]


def _largest(found: NDArray[np.generic], expected: NDArray[np.generic]) -> float:
    return float(np.abs(found.astype(np.float64) - expected.astype(np.float64)).max())
