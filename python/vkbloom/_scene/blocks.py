"""A scene and its frames as the core takes them: blocks of bytes, and arrays."""

from __future__ import annotations

import math
import struct
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom import _core
from vkbloom._formats import FORMATS_BY_DTYPE
from vkbloom._scene.mesh import Mesh
from vkbloom._scene.scene import Scene
from vkbloom._scene.textures import Texture
from vkbloom._scene.view import ALONE, Step, matrices

#: As Vulkan numbers them.
_ADDRESS_MODES: Final = ("repeat", "mirror-repeat", "clamp-to-edge")
_FILTERS: Final = ("nearest", "linear")


def scene_source(
    scene: Scene, size: tuple[int, int], shading: str, turns: float, step: Step = ALONE
) -> _core.Source:
    """Return the core's Source of a scene's frame, from checked values."""
    contents = scene._contents
    if contents.core is None:
        contents.core = _core.scene_contents(*contents_arguments(scene))
    return _core.scene_source(contents.core, frame_block(scene, size, shading, turns, step))


def contents_arguments(scene: Scene) -> tuple[bytes, bytes, tuple[NDArray[Any], ...]]:
    """Return a block, one of each picture, and arrays: what all frames of a scene have."""
    # Textures by identity, not by content: each is uploaded once.
    numbers: dict[Texture, int] = {}
    body, body_counts = _mesh(scene.body, numbers)
    glow, glow_counts = ([], (0, 0, 0)) if scene.glow is None else _mesh(scene.glow, numbers)
    sky = () if scene.skybox is None else scene.skybox.levels
    block = struct.pack(
        "=Q8I",
        scene.contents_serial,
        *body_counts,
        *glow_counts,
        scene.body.emission is not None,
        len(numbers),
    )
    pictures = [_picture(sky), *map(_texture, numbers)]
    levels = [level for texture in numbers for level in texture.levels]
    return block, b"".join(pictures), (*body, *glow, *sky, *levels)


def frame_block(
    scene: Scene, size: tuple[int, int], shading: str, turns: float, step: Step = ALONE
) -> bytes:
    """Return the block of a frame of a scene."""
    return struct.pack(
        "=d176s2I32s",
        scene.glow_intensity,
        # `turns` has period 1. It is reduced first, so that large times keep their precision.
        matrices(scene.camera, math.fmod(turns, 1.0), size[0] / size[1], step).tobytes(),
        *size,
        shading.encode(),
    )


def _mesh(
    mesh: Mesh, numbers: dict[Texture, int]
) -> tuple[list[NDArray[Any]], tuple[int, int, int]]:
    """Return a mesh's arrays and their lengths; textures get the next numbers."""
    arrays = [mesh.packed, np.ascontiguousarray(mesh.indices, np.uint32)]
    surfaces = [
        (
            part.index_count,
            *(numbers.setdefault(texture, len(numbers)) for texture in part.textures),
        )
        for part in mesh.surfaces
    ]
    if surfaces:
        assert mesh.texcoords is not None
        arrays += [np.ascontiguousarray(mesh.texcoords, np.float32), np.array(surfaces, np.uint32)]
    return arrays, (len(mesh.vertices), len(mesh.indices), len(surfaces))


def _picture(levels: tuple[NDArray[Any], ...], *sampler: int) -> bytes:
    """Return the block of a picture; the last three axes of its levels are those of a face."""
    if not levels:
        return bytes(4 * 9)
    height, width, _ = levels[0].shape[-3:]
    number = _core.FORMATS.index(FORMATS_BY_DTYPE[levels[0].dtype.name])
    return struct.pack("=9I", number, width, height, len(levels), *(sampler or (0,) * 5))


def _texture(texture: Texture) -> bytes:
    filters = (texture.mag_filter, texture.min_filter, texture.mipmap_filter)
    return _picture(
        texture.levels,
        *map(_ADDRESS_MODES.index, texture.address_mode),
        *map(_FILTERS.index, filters),
    )
