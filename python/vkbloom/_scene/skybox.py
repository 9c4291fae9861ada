"""Cubemaps for the sky: from KTX 1, six face images, one equirectangular image, or an array.

Face images and KTX faces are used without colour decoding and without a flip. The sky is sampled in
the direction of the object-space position on a cube. The renderer negates its y, as that of every
mesh, and the projection has no y flip. So the -y face appears at the top of the frame.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from vkbloom._arrays import plain_array
from vkbloom._formats import IMAGE_DTYPES
from vkbloom._io.image_file import read_stored
from vkbloom._scene import ktx
from vkbloom._scene.arrays import MAX_SIDE, Constructed, check_levels
from vkbloom._scene.textures import finite_floats, mip_levels, round_to

FACES: Final = ("+x", "-x", "+y", "-y", "+z", "-z")


@dataclass(frozen=True, eq=False, repr=False)
class Cubemap(Constructed):
    """A cube texture with its mip levels.

    Parameters
    ----------
    levels
        Arrays ``(6, n, n, 4)`` of one dtype (uint8, float16 or float32): faces in the order +x, -x,
        +y, -y, +z, -z, top row first, RGBA. n is halved and rounded down from level to level, but
        at least 1. The chain may end before 1. Arrays are copied unless they are read-only and own
        their memory.
    """

    levels: tuple[NDArray[Any], ...]

    def __post_init__(self) -> None:
        levels = check_levels(self.levels, IMAGE_DTYPES, "(6, n, n, 4)")
        object.__setattr__(self, "levels", levels)

    def __repr__(self) -> str:
        return f"Cubemap({self.size} x {self.size} {self.dtype}, levels: {len(self.levels)})"

    @property
    def size(self) -> int:
        """Side of a face of the largest level, in pixels."""
        return int(self.levels[0].shape[1])

    @property
    def dtype(self) -> np.dtype[Any]:
        """Dtype of all levels."""
        return self.levels[0].dtype


SkyboxSource: TypeAlias = (
    str | os.PathLike[str] | Sequence[str | os.PathLike[str]] | NDArray[Any] | Cubemap
)


def load(source: SkyboxSource) -> Cubemap:
    """Make a cubemap from any type of skybox argument."""
    if isinstance(source, Cubemap):
        return source
    if isinstance(source, np.ndarray):
        return from_array(source)
    if isinstance(source, (str, os.PathLike)):
        path = Path(source)
        with path.open("rb") as file:
            start = file.read(4)
        if start == ktx.IDENTIFIER[:4] or path.suffix.lower() == ".ktx":
            return from_ktx(path)
        return from_equirectangular(path)
    if isinstance(source, Sequence):
        return from_faces(source)
    raise TypeError(
        "skybox must be a path, six paths, an array (6, N, N, C) or a Cubemap, "
        f"not {type(source).__name__}"
    )


def from_array(faces: NDArray[Any]) -> Cubemap:
    """Make a cubemap with all mip levels from an array."""
    faces = plain_array(faces, "skybox")
    if faces.dtype.newbyteorder("=") not in IMAGE_DTYPES:
        raise TypeError(f"skybox: {faces.dtype} is not uint8, float16 or float32")
    shape = faces.shape
    is_cube = faces.ndim == 4 and shape[0] == 6 and shape[1] == shape[2] and shape[3] in (3, 4)
    if not is_cube or not 1 <= shape[1] <= MAX_SIDE:
        raise ValueError(
            f"skybox: shape {shape} is not (6, N, N, 3) or (6, N, N, 4) with N of 1 to {MAX_SIDE}"
        )
    return _with_levels(_with_alpha(faces.astype(faces.dtype.newbyteorder("="))))


def from_ktx(path: str | os.PathLike[str]) -> Cubemap:
    """Make a cubemap from a KTX 1 file."""
    levels = ktx.read(path)
    if len(levels) == 1:
        return _with_levels(_with_alpha(levels[0]))
    return Cubemap(tuple(_with_alpha(level) for level in levels))


def from_faces(paths: Sequence[str | os.PathLike[str]]) -> Cubemap:
    """Make a cubemap with all mip levels from six face images."""
    if isinstance(paths, (str, bytes)) or not all(isinstance(p, (str, os.PathLike)) for p in paths):
        raise TypeError("skybox must be six paths of face images")
    if len(paths) != 6:
        raise ValueError(f"skybox has {len(paths)} face images; six are needed: {', '.join(FACES)}")
    faces: list[NDArray[Any]] = []
    for name, path in zip(FACES, paths, strict=True):
        face = _with_alpha(_read_image(path))
        height, width = face.shape[:2]
        if width != height or width > MAX_SIDE:
            raise ValueError(
                f"{os.fspath(path)}: the {name} face is {width} x {height}; "
                f"a square of 1..{MAX_SIDE} is needed"
            )
        if faces and (face.shape != faces[0].shape or face.dtype != faces[0].dtype):
            raise ValueError(
                f"{os.fspath(path)}: the {name} face is {width} x {height} {face.dtype}; the +x "
                f"face is {faces[0].shape[1]} x {faces[0].shape[0]} {faces[0].dtype}"
            )
        faces.append(face)
    return _with_levels(np.stack(faces))


def from_equirectangular(path: str | os.PathLike[str]) -> Cubemap:
    """Make a cubemap with all mip levels from an equirectangular panorama.

    Returns: its faces have a side of round(width / 4) pixels. `project_equirectangular` states the
    directions.
    """
    panorama = _with_alpha(_read_image(path))
    height, width = panorama.shape[:2]
    if width != 2 * height or width > 4 * MAX_SIDE:
        raise ValueError(
            f"{os.fspath(path)}: {width} x {height}; an equirectangular image is twice as wide as "
            f"high, at most {4 * MAX_SIDE} wide"
        )
    return _with_levels(project_equirectangular(panorama, max(1, round(width / 4))))


def project_equirectangular(panorama: NDArray[Any], side: int) -> NDArray[Any]:
    """Resample an equirectangular panorama to the faces of a cube.

    In the renderer's world -y is up: the y of meshes is negated, and the projection has no y flip.
    So the panorama's top row is the direction -y. Its centre column is -z, straight ahead of a
    camera without rotation. Columns to the right of the centre are towards +x, which this camera
    sees on its right. The picture appears upright and not mirrored.

    Longitude u = 1/2 + atan2(x, -z) / 2 pi and latitude v = 1/2 + asin(y) / pi of the unit
    direction. The direction of a face's pixel inverts the table "Cube map face and coordinate
    selection" of the Vulkan specification.
    """
    height, width = panorama.shape[:2]
    centres = (2.0 * np.arange(side) + 1.0) / side - 1.0
    t, s = np.meshgrid(centres, centres, indexing="ij")
    unit = np.ones_like(s)
    directions = (
        (unit, -t, -s),
        (-unit, -t, s),
        (s, unit, t),
        (s, -unit, -t),
        (s, -t, unit),
        (-s, -t, -unit),
    )
    source = finite_floats(panorama)
    faces = np.empty((6, side, side, panorama.shape[2]), panorama.dtype)
    for face, (x, y, z) in zip(faces, directions, strict=True):
        u = 0.5 + np.arctan2(x, -z) / (2.0 * np.pi)
        v = 0.5 + np.arcsin(y / np.sqrt(x * x + y * y + z * z)) / np.pi
        column, across = _split(u * width - 0.5)
        row, down = _split(v * height - 0.5)
        left, right = column % width, (column + 1) % width
        top, bottom = np.clip(row, 0, height - 1), np.clip(row + 1, 0, height - 1)
        above = source[top, left] * (1.0 - across) + source[top, right] * across
        below = source[bottom, left] * (1.0 - across) + source[bottom, right] * across
        face[...] = round_to(above * (1.0 - down) + below * down, panorama.dtype)
    return faces


def _with_levels(faces: NDArray[Any]) -> Cubemap:
    """Return a cubemap with all mip levels of `faces`, which nobody else may change.

    NaN and infinity count as 0 in the smaller ones.
    """
    # Face by face, since what a face needs stays in the CPU's cache.
    levels = [faces, *map(np.stack, zip(*(mip_levels(face)[1:] for face in faces), strict=True))]
    for level in levels:
        # So that the cubemap takes the level itself.
        level.flags.writeable = False
    return Cubemap(tuple(levels))


def _with_alpha(image: NDArray[Any]) -> NDArray[Any]:
    """Return `image` with a fourth channel of 1 (255) if it has three."""
    if image.shape[-1] == 4:
        return image
    full = np.empty((*image.shape[:-1], 4), image.dtype)
    full[..., :3] = image
    full[..., 3] = 255 if image.dtype == np.uint8 else 1
    return full


def _split(coordinate: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.float32]]:
    """Split texel coordinates into integer texels and fractions (with a new last axis)."""
    whole = np.floor(coordinate)
    return whole.astype(np.intp), (coordinate - whole).astype(np.float32)[..., np.newaxis]


def _read_image(path: str | os.PathLike[str]) -> NDArray[Any]:
    """Read an RGB or RGBA image file as ``(H, W, C)``, with its stored values."""
    pixels = read_stored(path).pixels
    if pixels.shape[2] not in (3, 4):
        raise ValueError(
            f"{os.fspath(path)}: has {pixels.shape[2]} channels; flat RGB or RGBA is needed"
        )
    return pixels / np.float32(65535) if pixels.dtype == np.uint16 else pixels
