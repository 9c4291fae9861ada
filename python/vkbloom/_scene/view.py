"""The matrices of a scene's frame, for shaders."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from vkbloom._scene.scene import Camera

_DEGREE: Final = math.pi / 180.0
_TURN: Final = 2.0 * math.pi


def _translation(offset: Sequence[float]) -> NDArray[np.float64]:
    """Return the matrix of a translation."""
    matrix = np.eye(4)
    matrix[:3, 3] = offset
    return matrix


def _rotation(axis: int, angle: float) -> NDArray[np.float64]:
    """Return the matrix of a rotation by an angle in radians around an axis."""
    a, b = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(4)
    matrix[a, a] = matrix[b, b] = math.cos(angle)
    matrix[b, a], matrix[a, b] = math.sin(angle), -math.sin(angle)
    return matrix


class Step(NamedTuple):
    """A frame of an animation, for temporal anti-aliasing.

    - `before`: The time of the frame before in turns; None: this frame's.
    - `offset`: By how much the picture is moved to the right and down, in units of which it has two
      along each side.
    """

    before: float | None = None
    offset: tuple[float, float] = (0.0, 0.0)


#: A frame alone.
ALONE: Final = Step()


@functools.lru_cache(maxsize=8)
def _view(camera: Camera) -> NDArray[np.float64]:
    """Return the matrix of a camera, which is the same in all frames; read-only."""
    view = _translation(camera.position)
    for axis, angle in enumerate(camera.rotation):
        view = view @ _rotation(axis, angle * _DEGREE)
    view.flags.writeable = False
    return view


def _model(turns: float) -> NDArray[np.float64]:
    """Return the matrix of the body at a time."""
    angle = _TURN * turns
    place = (0.25 * math.sin(angle), -1.0, 0.25 * math.cos(angle))
    return _translation(place) @ _rotation(0, -0.15 * math.sin(angle)) @ _rotation(1, angle)


def matrices(
    camera: Camera, turns: float, aspect: float, step: Step = ALONE
) -> NDArray[np.float32]:
    """Return 11 rows of 4 numbers.

    They are: projection, three of model and view, three of the sky, three that take a place of the
    body in the view to where it was in the frame before, and the offset of the picture.

    - `turns`: The time, whose period is 1: the body turns once.
    - `aspect`: Width by height of the frame.

    The projection has the scales of x, y and z, and the offset of z; y points down, and depth is 0
    to 1. The sky has the direction of the picture's centre, and its changes from there to the right
    and to the lower edge.
    """
    tangent = math.tan(camera.fov * _DEGREE / 2.0)
    focal = 1.0 / tangent if tangent else math.inf
    depth = camera.near - camera.far
    view, model = _view(camera), _model(turns)
    rows = np.zeros((11, 4))
    rows[0] = focal / aspect, focal, camera.far / depth, camera.near * camera.far / depth
    rows[1:4] = (view @ model)[:3]
    # The inverse of a rotation is its transpose.
    rows[4, :3], rows[5, :3], rows[6, :3] = -view[2, :3], view[0, :3], view[1, :3]
    rows[5] *= aspect / focal
    rows[6] /= focal
    if step.before is not None:
        # Both are rotations and translations.
        rows[7:10] = (view @ _model(step.before) @ np.linalg.inv(view @ model))[:3]
    rows[10, :2] = step.offset
    # What single floats cannot hold is infinite.
    with np.errstate(over="ignore"):
        return rows.astype(np.float32)
