"""The GLSL of a pass: what its body finds, the body, and a main function.

Binding 0 is the block of parameters. The images follow in the order of `images`, then the textures
and the buffers of the file, and last the target of a compute pass.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping
from typing import Final

import numpy as np

from vkbloom._custom.buffers import Buffer
from vkbloom._custom.file import CustomFile
from vkbloom._custom.names import HOOKED, stage_of
from vkbloom._custom.params import Param
from vkbloom._custom.passes import CustomPass
from vkbloom._custom.textures import FileTexture

#: Numbers of the parts of a shader in the compiler's messages.
BODY: Final = 1
REST: Final = 2

#: TARGET_BINDING of shaders/params.h.
TARGET: Final = 33

ROUNDING_NAMES: Final = (
    "half_magic",
    "half_size",
    "nearest_half",
    "nearest_level",
    "nearest_srgb",
    "nearest_ufloat",
)

#: The main function of a fragment pass. The constant is STORED of shaders/params.h: how the
#: target's format rounds. Single floats are stored as they are.
COMPUTE_MAIN: Final = "void main() { hook(); }"
FRAGMENT_MAIN: Final = """#include "vkbloom/rounding.glsl"
layout(constant_id = 23) const int vkb_stored = 2;
layout(location = 0) out vec4 vkb_colour;
void main()
{
    vec4 value = hook();
    if (vkb_stored == 0)
        value = vec4(nearest_level(value.rgb), nearest_level(value.aaa).r) * (1.0 / 255.0);
    else if (vkb_stored == 1)
        value = vec4(nearest_half(value.rgb), nearest_half(value.aaa).r);
    else if (vkb_stored == 4)
        value = vec4(nearest_ufloat(value.rgb), 1.0);
    else if (vkb_stored == 5)
        value = vec4(nearest_srgb(value.rgb), nearest_level(value.aaa).r / 255.0);
    vkb_colour = value;
}
"""


@dataclasses.dataclass(frozen=True)
class Member:
    """A member of the block of parameters. `of` is the texture of a size."""

    type: str
    name: str
    of: str | None = None


@dataclasses.dataclass(frozen=True)
class Shader:
    """The GLSL of a pass at a stage, and what it must be given."""

    text: str
    compute: bool
    members: tuple[Member, ...]
    images: tuple[str, ...]
    textures: tuple[FileTexture, ...]
    buffers: tuple[Buffer, ...]

    def pack(self, given: Mapping[str, object]) -> bytes:
        """Return the block of parameters in std140; vectors are first, so there are no gaps."""
        kinds = {"int": "<i4", "uint": "<u4"}
        return b"".join(
            np.asarray(given[member.of or member.name])
            .astype(kinds.get(member.type, "<f4"))
            .tobytes()
            for member in self.members
        )


def names_of(image: str, stage: str, bound: set[str]) -> list[str]:
    """Return the names under which a body finds an image: HOOKED also has the stage's name."""
    names = [image]
    if image == stage and HOOKED in bound:
        names.insert(0, HOOKED)
    if image == "MAIN":
        names.append("MAINPRESUB")
    return names


def image_lines(name: str, sampler: str) -> str:
    """Return the macros of an image that a fragment shader reads."""
    return "\n".join(macros_of(name, sampler, "(gl_FragCoord.xy / vkb_target)"))


def compute_image_lines(name: str, sampler: str) -> str:
    """Return the macros of an image that a compute shader reads."""
    lines = macros_of(name, sampler, f"{name}_map(gl_GlobalInvocationID)")
    lines.append(f"#define {name}_map(id) ((vec2(id) + vec2(0.5)) / vkb_target)")
    return "\n".join(lines)


def macros_of(name: str, sampler: str, position: str) -> list[str]:
    """Return the macros of an image, which the shader reads at a position."""
    return [
        f"#define {name}_raw {sampler}",
        f"#define {name}_pos {position}",
        f"#define {name}_size vkb_size_of_{sampler}",
        f"#define {name}_pt (1.0 / vkb_size_of_{sampler})",
        f"#define {name}_off vec2(0.0)",
        f"#define {name}_rot mat2(1.0)",
        f"#define {name}_mul 1.0",
        f"#define {name}_tex(p) textureLod({sampler}, p, 0.0)",
        f"#define {name}_texOff(o) textureLod({sampler}, {name}_pos + {name}_pt * vec2(o), 0.0)",
        f"#define {name}_gather(p, c) textureGather({sampler}, p, c)",
    ]


def literal(param: Param, value: float) -> str:
    """Return a value as a constant in GLSL."""
    if param.number == "float":
        return f"float({np.float32(value)!s})"
    if param.number == "uint":
        return f"{int(value)}u"
    return f"({int(value)})" if value > -(2**31) else "(-2147483647 - 1)"


def constant_lines(file: CustomFile, values: Mapping[str, float]) -> str:
    """Return the parameters that the compiler must know, and the names of all ENUMs."""
    lines = []
    for param in file.params:
        lines += [f"#define {name} {index}" for index, name in enumerate(param.names)]
        value = values[param.name]
        if param.use == "define":
            lines.append(f"#define {param.name} {int(value)}")
        elif param.use == "constant":
            lines.append(f"const {param.number} {param.name} = {literal(param, value)};")
    return "\n".join(lines)


def block_members(file: CustomFile, body: str, images: list[tuple[str, list[str]]]) -> list[Member]:
    """Return the members of the block: what the body's words need, vectors first."""
    words = set(re.findall(r"[A-Za-z_]\w*", body))
    members = []
    for number, (image, names) in enumerate(images):
        suffixes = ("size", "pt", "texOff")
        if any(f"{name}_{suffix}" in words for name in names for suffix in suffixes):
            members.append(Member("vec2", f"vkb_size_of_vkb_image_{number}", image))
    positions = ("pos", "map", "texOff")
    if any(
        f"{name}_{ending}" in words for _, names in images for name in names for ending in positions
    ):
        members.append(Member("vec2", "vkb_target"))
    members += [Member("vec2", name) for name in ("input_size", "target_size") if name in words]
    members += [
        Member(param.number, param.name)
        for param in file.params
        if param.use == "uniform" and param.name in words
    ]
    numbers = (("int", "frame"), ("float", "random"))
    return members + [Member(kind, name) for kind, name in numbers if name in words]


def write_shader(
    file: CustomFile, item: CustomPass, stage: str, values: Mapping[str, float]
) -> Shader:
    """Write the shader of a pass at a stage; `values` has the number of each parameter."""
    bound = {binding.value for binding in item.bindings}
    textures = [texture for texture in file.textures if texture.name in bound]
    buffers = [buffer for buffer in file.buffers if buffer.name in bound]
    names_bound = dict.fromkeys(
        stage if binding.value == HOOKED else stage_of(binding.value)
        # Images of this frame first, as in Row.
        for binding in sorted(item.bindings, key=lambda binding: binding.value in file.histories)
        if binding.value not in file.embedded
    )
    images = [(image, names_of(image, stage, bound)) for image in names_bound]
    without_remarks = re.sub(r"//[^\n]*|/\*.*?\*/", " ", item.body, flags=re.DOTALL)
    members = block_members(file, without_remarks, images)
    compute = item.compute is not None
    lines_of = compute_image_lines if compute else image_lines
    lines = ["#version 450", "#extension GL_GOOGLE_include_directive : enable"]
    if members:
        inside = "".join(f"{member.type} {member.name}; " for member in members)
        lines.append(f"layout(binding = 0, std140) uniform vkb_parameters {{ {inside}}};")
    for index, (_, names) in enumerate(images):
        sampler = f"vkb_image_{index}"
        lines.append(f"layout(binding = {index + 1}) uniform sampler2D {sampler};")
        lines += [lines_of(name, sampler) for name in names]
    binding = len(images) + 1
    for texture in textures:
        lines.append(texture_lines(texture, binding))
        binding += 1
    for buffer in buffers:
        lines.append(buffer_lines(buffer, binding))
        binding += 1
    if item.compute:
        width, height = item.compute.threads
        lines.append(f"layout(local_size_x = {width}, local_size_y = {height}) in;")
        lines.append(f"layout(binding = {TARGET}) uniform writeonly image2D out_image;")
    lines += [
        "#define tex_offset vec2(0.0)",
        "#define linearize(c) (c)",
        "#define delinearize(c) (c)",
        constant_lines(file, values),
        f"#line {item.body_line} {BODY}",
        item.body,
        f"#line 1 {REST}",
        COMPUTE_MAIN if compute else fragment_main(),
    ]
    return Shader(
        "\n".join(lines) + "\n",
        compute,
        tuple(members),
        tuple(names_bound),
        tuple(textures),
        tuple(buffers),
    )


def texture_lines(texture: FileTexture, binding: int) -> str:
    """Return the declaration of a texture."""
    if texture.storage:
        qualifiers = f"binding = {binding}, {texture.format.layout}"
        return f"layout({qualifiers}) uniform {texture.declaration} {texture.name};"
    return (
        f"layout(binding = {binding}) uniform {texture.declaration} {texture.name};\n"
        f"#define {texture.name}_tex(p) texture({texture.name}, p)"
    )


def buffer_lines(buffer: Buffer, binding: int) -> str:
    """Return the declaration of a buffer."""
    inside = " ".join(f"{variable.declaration};" for variable in buffer.variables)
    packing, kind = ("std430", "buffer") if buffer.storage else ("std140", "uniform")
    return f"layout(binding = {binding}, {packing}) {kind} vkb_of_{buffer.name} {{ {inside} }};"


def fragment_main() -> str:
    """Return what follows the body of a fragment shader: main, which rounds to the format."""
    renamed = "".join(f"#undef {name}\n#define {name} vkb_{name}\n" for name in ROUNDING_NAMES)
    return renamed + FRAGMENT_MAIN
