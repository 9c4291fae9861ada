"""The matrices of a scene's frame, for shaders."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from vkbloom._scene.scene import Camera

#: Column by column.
Matrix = list[list[float]]
_DEGREE: Final = math.pi / 180.0
_TURN: Final = 2.0 * math.pi


def _identity() -> Matrix:
    return [[float(row == column) for row in range(4)] for column in range(4)]


def _translate(matrix: Matrix, offset: Sequence[float]) -> None:
    """Multiply a matrix by a translation."""
    x, y, z = offset
    for row in range(4):
        matrix[3][row] += matrix[0][row] * x + matrix[1][row] * y + matrix[2][row] * z


def _rotate(matrix: Matrix, axis: int, angle: float) -> None:
    """Multiply a matrix by a rotation by an angle in radians around an axis."""
    a, b = matrix[(axis + 1) % 3], matrix[(axis + 2) % 3]
    cosine, sine = math.cos(angle), math.sin(angle)
    for row in range(4):
        a[row], b[row] = cosine * a[row] + sine * b[row], cosine * b[row] - sine * a[row]


def matrices(camera: Camera, turns: float, aspect: float) -> NDArray[np.float32]:
    """Return 7 rows of 4 numbers: projection, three of model and view, three of the sky.

    - `turns`: The time, whose period is 1: the body turns once.
    - `aspect`: Width by height of the frame.

    The projection has the scales of x, y and z, and the offset of z; y points down, and depth is 0
    to 1. The sky has the direction of the picture's centre, and its changes from there to the right
    and to the lower edge.
    """
    tangent = math.tan(camera.fov * _DEGREE / 2.0)
    focal = 1.0 / tangent if tangent else math.inf
    depth = camera.near - camera.far
    rows = [[focal / aspect, focal, camera.far / depth, camera.near * camera.far / depth]]

    view = _identity()
    _translate(view, camera.position)
    for axis, angle in enumerate(camera.rotation):
        _rotate(view, axis, angle * _DEGREE)
    model = _identity()
    angle = _TURN * turns
    _translate(model, (0.25 * math.sin(angle), -1.0, 0.25 * math.cos(angle)))
    _rotate(model, 0, -0.15 * math.sin(angle))
    _rotate(model, 1, angle)
    for row in range(3):
        x, y, z, w = (column[row] for column in view)
        rows.append([x * m[0] + y * m[1] + z * m[2] + w * m[3] for m in model])
    # The inverse of a rotation is its transpose.
    rows.append([*(-view[axis][2] for axis in range(3)), 0.0])
    rows.append([*(view[axis][0] * aspect / focal for axis in range(3)), 0.0])
    rows.append([*(view[axis][1] / focal for axis in range(3)), 0.0])
    # What single floats cannot hold is infinite.
    with np.errstate(over="ignore"):
        return np.array(rows).astype(np.float32)
