"""The textures and buffers of a custom method as objects of the core."""

from __future__ import annotations

import itertools
import math
from typing import Final

from vkbloom import _core
from vkbloom._custom.buffers import Buffer
from vkbloom._custom.file import CustomFile
from vkbloom._custom.textures import Texture

#: Kinds of the core's resources, and Vulkan's address modes.
TEXTURE, IMAGE, UNIFORM, STORAGE = range(4)
BORDERS: Final = {"REPEAT": 0, "MIRROR": 1, "CLAMP": 2}

#: Each resource has another serial, under which renderers keep it.
SERIALS: Final = itertools.count(1)

Resources = dict[str, _core.Resource]


def made_resources(file: CustomFile, *, storage: bool) -> Resources:
    """Return new resources by name: those that passes change, or the others."""
    return {
        name: texture_resource(block) if isinstance(block, Texture) else buffer_resource(block)
        for name, block in file.given.items()
        if block.storage == storage
    }


def texture_resource(texture: Texture) -> _core.Resource:
    """Return a texture as a resource."""
    width, height, depth = (*texture.sides, 1, 1)[:3]
    texel = len(texture.format.read(bytes(texture.format.file_bytes)).tobytes())
    return _core.resource(
        next(SERIALS),
        IMAGE if texture.storage else TEXTURE,
        texture.format.vulkan,
        (len(texture.sides), width, height, depth),
        texture.filter == "LINEAR",
        BORDERS[texture.border],
        texel * math.prod(texture.sides),
        texture.texels,
    )


def buffer_resource(buffer: Buffer) -> _core.Resource:
    """Return a buffer as a resource."""
    kind = STORAGE if buffer.storage else UNIFORM
    size = -(-buffer.size // 16) * 16
    data = None if buffer.data is None else buffer.data.ljust(size, b"\0")
    return _core.resource(next(SERIALS), kind, 0, (0, 0, 0, 0), False, 0, size, data)
