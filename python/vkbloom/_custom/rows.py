"""Passes, textures and buffers of custom methods as the core takes them: blocks of bytes."""

from __future__ import annotations

import itertools
import math
import struct
from typing import Any, Final, NamedTuple

from vkbloom import _core
from vkbloom._custom.buffers import Buffer
from vkbloom._custom.file import CustomFile
from vkbloom._custom.textures import FileTexture

#: The most images that a pass reads, textures and buffers that it binds, bytes of parameters.
MAX_READS: Final = 16
MAX_RESOURCES: Final = 16
MAX_PARAMETERS: Final = 1024
#: With the 0 at its end.
NAME_SIZE: Final = 32


class CoreShader(NamedTuple):
    """A shader: its name in plans, its SPIR-V, and 16 bytes that are equal only for equal code.

    Of a compute shader also the threads of a workgroup, and its bytes of shared memory.
    """

    name: str
    code: bytes
    hash: bytes
    threads_x: int = 1
    threads_y: int = 1
    shared: int = 0


class Resource(NamedTuple):
    """A texture or a buffer: a block of the core, and its content. None: zeros.

    Renderers keep what passes change as long as there is its `owner`; others have none.
    """

    block: bytes
    data: bytes | None
    owner: object = None


class Row(NamedTuple):
    """A row of `core_passes`.

    - `framebuffer`: Whether the image that it writes is one.
    - `params`: The bytes of its parameters.
    - `group`: The pixels of a compute shader's workgroup. None: it is a fragment shader.
    - `groups`: How many workgroups run; None: as many as cover the image.
    - `turn`: Another number for each run of a pass that changes a resource; 0 for others.
    - `histories`: The framebuffers that it reads as the call before left them, after `reads`.
    - `sampling`: How it samples each image that it reads, of `SAMPLINGS`; the default is 0.
    - `format`: The core's number of the format of its image; 0: that of the bloom buffers.
    - `joined`: It is no pass, but one more image that the pass before it writes.
    - `vertex`: Its vertex shader. None: the package's.
    - `positions`: Whether the package's gives the fragment shader its position, 0 to 1.
    - `vertices`: How many its own has; 0: of one triangle.
    """

    name: str
    shader: CoreShader
    size: tuple[int, int]
    reads: tuple[str, ...] = ()
    framebuffer: bool = False
    params: bytes = b""
    group: tuple[int, int] | None = None
    resources: tuple[Resource, ...] = ()
    turn: int = 0
    histories: tuple[str, ...] = ()
    sampling: tuple[int, ...] = ()
    format: int = 0
    joined: bool = False
    groups: tuple[int, int] | None = None
    positions: bool = False
    vertex: CoreShader | None = None
    vertices: int = 0

    def pack(self) -> tuple[Any, ...]:
        """Return it as the core takes it; ValueError where the core has no room."""
        for what, count, most in (
            ("images read", len(self.reads) + len(self.histories), MAX_READS),
            ("textures and buffers", len(self.resources), MAX_RESOURCES),
            ("bytes of parameters", len(self.params), MAX_PARAMETERS),
        ):
            if count > most:
                raise ValueError(f"passes: {self.name}: {count} {what} are more than {most}")
        reads = (*self.reads, *self.histories)
        block = struct.pack(
            f"={MAX_PARAMETERS}sQ13I{NAME_SIZE}s{MAX_READS * NAME_SIZE}s{MAX_READS}s4x",
            self.params,
            self.turn,
            *self.size,
            *(self.group or (0, 0)),
            *(self.groups or (0, 0)),
            self.framebuffer,
            len(reads),
            (1 << len(reads)) - (1 << len(self.reads)),
            self.format,
            self.joined,
            self.positions,
            self.vertices,
            self.name.encode(),
            b"".join(read.encode().ljust(NAME_SIZE, b"\0") for read in reads),
            bytes(self.sampling),
        )
        vertex = () if self.vertex is None else (self.vertex.code, self.vertex.hash)
        return block, *self.shader, self.resources, *vertex


#: Kinds of the core's resources, and Vulkan's address modes.
TEXTURE, IMAGE, UNIFORM, STORAGE = range(4)
BORDERS: Final = {"REPEAT": 0, "MIRROR": 1, "CLAMP": 2}

#: Each resource has another serial, under which renderers keep it.
SERIALS: Final = itertools.count(1)

Resources = dict[str, Resource]


def constant_resources(file: CustomFile) -> Resources:
    """Return new resources by name, of those that no pass changes."""
    return {name: resource_of(block) for name, block in file.embedded.items() if not block.storage}


def changing_resources(file: CustomFile) -> Resources:
    """Return new resources by name, of those that passes change; they have an owner."""
    made = {name: resource_of(block) for name, block in file.embedded.items() if block.storage}
    if not made:
        return made
    owner = _core.resource_owner()
    return {name: resource._replace(owner=owner) for name, resource in made.items()}


def resource_of(block: FileTexture | Buffer) -> Resource:
    """Return a texture or a buffer as a resource."""
    return texture_resource(block) if isinstance(block, FileTexture) else buffer_resource(block)


def texture_resource(texture: FileTexture) -> Resource:
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
