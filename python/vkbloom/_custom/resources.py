"""The textures and buffers of a custom method as rows of the core."""

from __future__ import annotations

import itertools
import math
import struct
from typing import Final

from vkbloom._custom.buffers import Buffer
from vkbloom._custom.file import CustomFile
from vkbloom._custom.rows import Resource
from vkbloom._custom.textures import Texture

#: Kinds of the core's resources, and Vulkan's address modes.
TEXTURE, IMAGE, UNIFORM, STORAGE = range(4)
BORDERS: Final = {"REPEAT": 0, "MIRROR": 1, "CLAMP": 2}

#: Each resource has another serial, under which renderers keep it.
SERIALS: Final = itertools.count(1)

Resources = dict[str, Resource]


def made_resources(file: CustomFile, *, storage: bool) -> Resources:
    """Return new resources by name: those that passes change, or the others."""
    return {
        name: texture_resource(block) if isinstance(block, Texture) else buffer_resource(block)
        for name, block in file.given.items()
        if block.storage == storage
    }


def texture_resource(texture: Texture) -> Resource:
    """Return a texture as a resource."""
    texel = len(texture.format.read(bytes(texture.format.file_bytes)).tobytes())
    block = struct.pack(
        "=2Q8I",
        next(SERIALS),
        texel * math.prod(texture.sides),
        IMAGE if texture.storage else TEXTURE,
        texture.format.vulkan,
        len(texture.sides),
        *(*texture.sides, 1, 1)[:3],
        texture.filter == "LINEAR",
        BORDERS[texture.border],
    )
    return Resource(block, texture.texels)


def buffer_resource(buffer: Buffer) -> Resource:
    """Return a buffer as a resource."""
    size = -(-buffer.size // 16) * 16
    data = None if buffer.data is None else buffer.data.ljust(size, b"\0")
    kind = STORAGE if buffer.storage else UNIFORM
    return Resource(struct.pack("=2Q8I", next(SERIALS), size, kind, *(0,) * 7), data)
