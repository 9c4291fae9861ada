"""The light of the deferred system, from its G-buffer."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vkbloom._array_api import run_in_other_libraries
from vkbloom._public import public

from ._image import as_float, storage
from ._sampling import Array

# Values of the forward system's Phong pass. The light has a fixed position in view space.
_LIGHT = np.array([-5.0, -5.0, 0.0])
_LAMP = 0.9
_AMBIENT = 0.25
_SPECULAR = 0.75
_SHININESS = 8


@public("vkbloom.reference")
@run_in_other_libraries("albedo", "normal", "position", "brightness")
def shade(
    albedo: NDArray[Any],
    normal: NDArray[Any],
    position: NDArray[Any],
    brightness: NDArray[Any],
) -> Array:
    """Return the deferred system's "scene": the reflected light plus the emission.

    With the albedo c, the normal N, the position P, the direction L from P to the light at (-5, -5,
    0), the direction V from P to the camera at the origin, and R = 2 (N.L) N - L, all directions of
    length 1:

        c / 4 where any channel of c is 0.9 or more (a lamp's ambient light), else 0
        + max(N.L, 0) c + 0.75 max(R.V, 0)^8 + brightness

    A normal of (0, 0, 0) means no surface; then the result is c + brightness. The formula is that
    of the forward system's Phong pass. Its 0.9 is rounded to the albedo's dtype.

    Parameters
    ----------
    albedo, normal, position, brightness : ndarray, shape (H, W, 3) or (H, W, 4)
        Framebuffers of a deferred frame, or similar arrays: float16, float32 or float64, finite.
        Normal and position are in view space, the position in scene units. The normal may have any
        length. A fourth channel is not read.

    Returns
    -------
    ndarray of float64, shape (H, W, 4)
        Clamped to +-65504, the range of "rgba16float", but not rounded. Alpha is 1.

    Raises
    ------
    ValueError
        An array has another shape, or the shapes differ.
    """
    given = {
        "albedo": albedo,
        "normal": normal,
        "position": position,
        "brightness": brightness,
    }
    colour, normals, positions, emitted = (
        as_float(array, name, (3, 4))[..., :3] for name, array in given.items()
    )
    for name, array in given.items():
        if array.shape[:2] != colour.shape[:2]:
            raise ValueError(
                f"{name}: height and width {array.shape[:2]} are not the albedo's "
                f"{colour.shape[:2]}"
            )
    is_surface = normals.any(axis=-1, keepdims=True)
    n, to_light, to_camera = _unit(normals), _unit(_LIGHT - positions), _unit(-positions)
    facing = _dot(n, to_light)
    reflected = 2 * facing * n - to_light
    # Rounded to the albedo's dtype, so that a half float of 0.9 is still a lamp.
    lamp = float(albedo.dtype.type(_LAMP))
    ambient = np.where((colour >= lamp).any(axis=-1, keepdims=True), _AMBIENT * colour, 0.0)
    specular = _SPECULAR * np.maximum(_dot(reflected, to_camera), 0) ** _SHININESS
    lit = np.where(is_surface, ambient + np.maximum(facing, 0) * colour + specular, colour)
    rgb = storage("rgba16float")(lit + emitted)
    return np.concatenate([rgb, np.ones((*rgb.shape[:2], 1))], axis=-1)


def _dot(a: Array, b: Array) -> Array:
    product: Array = (a * b).sum(axis=-1, keepdims=True)
    return product


def _unit(vectors: Array) -> Array:
    """Return the vectors with length 1. Vectors of length 0 stay as they are."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(length > 0, length, 1.0)
