"""A test render with known framebuffers, against which the result is checked.

The scene is two rectangles built in code, so it needs no file and no optional package.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from vkbloom import reference
from vkbloom.frames import Frames
from vkbloom.methods.separable import Separable
from vkbloom.renderer import Renderer
from vkbloom.scene import Camera, Mesh, Scene

SIZE: Final = (64, 48)
SETTINGS: Final = Separable(bloom_size=(32, 24))

_GLOW: Final = (1.0, 0.5, 0.25)
_BODY: Final = (0.5, 0.25, 0.125)
_CAMERA: Final = Camera(
    position=(0.0, 0.0, -10.0), rotation=(0.0, 0.0, 0.0), fov=90.0, near=1.0, far=100.0
)
# At time 0 the animation translates a model by (0, -1, 0.25) and does not rotate it. These offsets
# put a rectangle at z = 0 with one side at y = 0.
_LIFT, _BACK = 1.0, -0.25
# Far outside the picture: its half height at the rectangles' distance is 10.
_BEYOND = 100.0
# Perspective depth 0..1 of the distance d = 10: far / (far - near) * (1 - near / d).
_DEPTH: Final = 100 / 99 * (1 - 1 / 10)

# In levels of 255: half a level from rounding blur_vertical, times the gain 1.39 of the next pass;
# half a level from rounding its result; and one level at an edge from black to white, because the
# weights of a device's bilinear filter are accurate to 1/256.
_BLUR_TOLERANCE: Final = 3.0
_GLOW_TOLERANCE: Final = 1.0
# Accuracy of a rasterizer's depth interpolation; lavapipe's error is below 4e-7.
_DEPTH_TOLERANCE: Final = 1e-4


def _rectangle(
    x: tuple[float, float], y: tuple[float, float], colour: tuple[float, float, float]
) -> Mesh:
    corners = [(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])]
    vertices = [(a, b, _BACK, 0.0, 0.0, 1.0, *colour) for a, b in corners]
    # Both windings, so that one of them is front-facing.
    indices = [0, 1, 2, 0, 2, 3, 0, 2, 1, 0, 3, 2]
    return Mesh(np.array(vertices, np.float32), np.array(indices, np.uint32))


def render(renderer: Renderer) -> Frames:
    """Render the test scene: a body in the upper half, a glow in the left half.

    Returns: `SIZE` pixels with the bloom of `SETTINGS`.
    """
    scene = Scene(
        body=_rectangle((-_BEYOND, _BEYOND), (-_BEYOND, _LIFT), _BODY),
        glow=_rectangle((-_BEYOND, 0.0), (-_BEYOND, _BEYOND), _GLOW),
        camera=_CAMERA,
    )
    return renderer.render(scene, SETTINGS, SIZE)


def differences(frames: Frames) -> list[str]:
    """Compare the framebuffers of `render` with their expected values.

    The expected values of `glow` and `depth` follow from the geometry, those of `blur_vertical`,
    `bloom` and `final` come from `vkbloom.reference`.
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
        f"{name} differs by up to {difference:.3g}; {tolerance:g} is allowed"
        for name, difference, tolerance in rows
        # Written this way, NaN counts as a difference.
        if not difference <= tolerance
    ]


def _largest(found: NDArray[np.generic], expected: NDArray[np.generic]) -> float:
    return float(np.abs(found.astype(np.float64) - expected.astype(np.float64)).max())
