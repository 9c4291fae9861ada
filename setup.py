"""Builds the C core; the shaders are compiled to SPIR-V and embedded as part of it."""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

SHADERS = Path("shaders")
SPIRV = Path("build/spirv")
STAGES = (".vert", ".frag", ".comp")


def identifier(shader: Path) -> str:
    """`blur.frag` is `blur_frag` in C."""
    return shader.name.replace(".", "_")


def compile_shader(shader: Path) -> tuple[int, ...]:
    """Compile one shader to its SPIR-V words."""
    compiler = shutil.which("glslangValidator") or shutil.which("glslang")
    if compiler is None:
        raise SystemExit(
            "glslangValidator is missing; on Debian or Ubuntu: apt install glslang-tools"
        )
    target = SPIRV / f"{shader.name}.spv"
    command = [compiler, "-V", "--target-env", "vulkan1.1", f"-I{SHADERS}", "-o", str(target)]
    result = subprocess.run([*command, str(shader)], capture_output=True, text=True, check=False)
    if result.returncode != 0:
        raise SystemExit(f"{shader} does not compile:\n{result.stdout}{result.stderr}")
    code = target.read_bytes()
    return struct.unpack(f"={len(code) // 4}I", code)


def write_spirv() -> None:
    """Write spirv.h and spirv.c: an enum of the shaders, and their code, one row for each file."""
    SPIRV.mkdir(parents=True, exist_ok=True)
    shaders = sorted(path for path in SHADERS.iterdir() if path.suffix in STAGES)
    names = [identifier(shader) for shader in shaders]
    enum = "".join(f"    VKB_SHADER_{name},\n" for name in names)
    arrays = "".join(
        f"static const uint32_t {name}[] = {{{','.join(map(str, compile_shader(shader)))}}};\n"
        for name, shader in zip(names, shaders, strict=True)
    )
    rows = "".join(f"    {{{name}, sizeof {name}}},\n" for name in names)
    (SPIRV / "spirv.h").write_text(
        "// Made by setup.py from shaders/.\n#ifndef VKB_SPIRV_H\n#define VKB_SPIRV_H\n\n"
        "#include <stddef.h>\n#include <stdint.h>\n\n"
        f"enum vkb_shader {{\n{enum}    VKB_SHADER_COUNT,\n}};\n\n"
        "struct vkb_spirv { const uint32_t *code; size_t size; };\n"
        "extern const struct vkb_spirv vkb_spirv[VKB_SHADER_COUNT];\n\n#endif\n"
    )
    (SPIRV / "spirv.c").write_text(
        '#include "spirv.h"\n\n'
        f"{arrays}\nconst struct vkb_spirv vkb_spirv[VKB_SHADER_COUNT] = {{\n{rows}}};\n"
    )


class BuildCore(build_ext):
    """build_ext with the shaders compiled first and the compiler's options set."""

    def build_extension(self, ext: Extension) -> None:
        """Build one extension, with the embedded shaders as one more source."""
        write_spirv()
        ext.include_dirs.append(str(SPIRV))
        ext.sources.append(str(SPIRV / "spirv.c"))
        if self.compiler.compiler_type == "msvc":
            ext.extra_compile_args += ["/std:c11"]
        else:
            ext.extra_compile_args += ["-std=c11", "-fvisibility=hidden"]
        # Warnings are errors in CI only: a newer compiler must not stop a user's build.
        ext.extra_compile_args += os.environ.get("VKBLOOM_CFLAGS", "").split()
        ext.extra_link_args += os.environ.get("VKBLOOM_LDFLAGS", "").split()
        super().build_extension(ext)


def volk_folder() -> str:
    """Find volk.h and volk.c (Debian: libvulkan-volk-dev, elsewhere the Vulkan SDK)."""
    places = [Path("/usr/include"), Path("/usr/local/include")]
    if sdk := os.environ.get("VULKAN_SDK"):
        places[:0] = [Path(sdk) / "include", Path(sdk) / "Include"]
    for place in places:
        for folder in (place, place / "volk", place / "Volk"):
            if (folder / "volk.c").is_file() and (folder / "volk.h").is_file():
                return str(folder)
    raise SystemExit("volk is missing; on Debian or Ubuntu: apt install libvulkan-volk-dev")


setup(
    ext_modules=[
        Extension(
            "vkbloom._core",
            sources=sorted(str(path) for path in Path("csrc").glob("*.c")),
            depends=[
                *(str(path) for path in Path("csrc").glob("*.h")),
                *(str(path) for path in SHADERS.iterdir()),
            ],
            include_dirs=["csrc", volk_folder()],
            define_macros=[("VK_NO_PROTOTYPES", None), ("Py_LIMITED_API", "0x030b0000")],
            libraries=[] if os.name == "nt" else ["m", "dl"],
            py_limited_api=True,
        )
    ],
    cmdclass={"build_ext": BuildCore},
    options={"bdist_wheel": {"py_limited_api": "cp311"}},
)
