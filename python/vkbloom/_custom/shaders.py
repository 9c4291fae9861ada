"""The compiled shaders of a custom method."""

from __future__ import annotations

import functools
import hashlib
import os
import struct
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Final

from vkbloom._custom.compiler import cached_code, compile_shader
from vkbloom._custom.file import CustomFile, read_file
from vkbloom._custom.glsl import Shader, write_shader
from vkbloom._custom.passes import CustomPass
from vkbloom._custom.rows import CoreShader, constant_resources
from vkbloom._custom.source import Source
from vkbloom._custom.spirv import shared_bytes

#: Passes that the package adds: a copy, the difference of two pictures, black, a sum of two, white.
PACKAGE_PASSES: Final = """\
//!HOOK MAIN
//!BIND HOOKED
vec4 hook() { return texelFetch(HOOKED_raw, ivec2(gl_FragCoord.xy), 0); }
//!HOOK MAIN
//!BIND HOOKED
//!BIND GLOW
vec4 hook()
{
    ivec2 at = ivec2(gl_FragCoord.xy);
    return vec4(texelFetch(HOOKED_raw, at, 0).rgb - texelFetch(GLOW_raw, at, 0).rgb, 1.0);
}
//!HOOK MAIN
vec4 hook() { return vec4(0.0, 0.0, 0.0, 1.0); }
//!HOOK MAIN
//!BIND HOOKED
//!BIND GLOW
vec4 hook()
{
    ivec2 at = ivec2(gl_FragCoord.xy);
    return vec4(of_r, of_g, of_b, of_a) * texelFetch(HOOKED_raw, at, 0)
        + vec4(by_r, by_g, by_b, by_a) * texelFetch(GLOW_raw, at, 0);
}
//!HOOK MAIN
vec4 hook() { return vec4(1.0); }
"""
#: The factors of blending, of what is drawn and of what is there.
FACTORS: Final = tuple(f"{of}_{channel}" for of in ("of", "by") for channel in "rgba")
COPY, DIFFERENCE, BLACK, BLEND, WHITE = range(5)


class Shaders:
    """The shaders of a file, each compiled at its first use."""

    def __init__(self, name: str, file: CustomFile) -> None:
        self._name = name
        self._file = file
        self.resources = constant_resources(file)
        self._compiled: dict[tuple[Any, ...], tuple[Shader, CoreShader]] = {}

    def of(
        self, item: CustomPass, stage: str, values: Mapping[str, float]
    ) -> tuple[Shader, CoreShader]:
        """Return the shader of a pass at a stage, for the values that the compiler must know."""
        key = self._key(item, stage, values)
        kept = self._compiled.get(key)
        if kept is None:
            shader = write_shader(self._file, item, stage, values)
            kept = self._keep(key, item, shader, compile_shader(self._file, item, shader))
        return kept

    def compile_all(self, values: Mapping[str, float]) -> None:
        """Compile all passes, several at a time."""
        missing = []
        for stage, item in self._file.runs():
            # The cache has most, and a thread takes longer than to read them.
            shader = write_shader(self._file, item, stage, values)
            code = cached_code(shader)
            if code is None:
                missing.append((item, stage))
            else:
                self._keep(self._key(item, stage, values), item, shader, code)
        if not missing:
            return
        with ThreadPoolExecutor(os.cpu_count()) as threads:
            futures = [threads.submit(self.of, item, stage, values) for item, stage in missing]
        for future in futures:
            future.result()

    def _key(self, item: CustomPass, stage: str, values: Mapping[str, float]) -> tuple[Any, ...]:
        fixed = tuple(values[param.name] for param in self._file.params if param.use != "uniform")
        return item.line, stage, fixed

    def _keep(
        self, key: tuple[Any, ...], item: CustomPass, shader: Shader, code: bytes
    ) -> tuple[Shader, CoreShader]:
        digest = hashlib.sha256(code).digest()[:16]
        made = shader, CoreShader(f"{self._name}_{item.line}", code, digest)
        if item.compute:
            words = struct.unpack(f"={len(code) // 4}I", code)
            threads = item.compute.threads
            made = shader, CoreShader(*made[1][:3], *threads, shared_bytes(words))
        self._compiled[key] = made
        return made


def package_shader(index: int) -> CoreShader:
    """Return the shader of one of the package's passes."""
    return _package_shaders(index)[1]


def package_blend(drawn: tuple[float, ...], there: tuple[float, ...]) -> tuple[CoreShader, bytes]:
    """Return the shader that blends two images, and its parameters: four factors of each."""
    shader, core_shader = _package_shaders(BLEND)
    return core_shader, shader.pack(dict(zip(FACTORS, (*drawn, *there), strict=True)))


@functools.cache
def _package_shaders(index: int) -> tuple[Shader, CoreShader]:
    factors = "".join(f"//!PARAM {name}\n//!TYPE float\n1\n" for name in FACTORS)
    file = read_file(Source("vkbloom", factors + PACKAGE_PASSES))
    values = dict.fromkeys(FACTORS, 1.0)
    return Shaders("custom", file).of(file.passes[index], "MAIN", values)
