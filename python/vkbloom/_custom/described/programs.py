"""The compiled shaders of a description: by each language's tool, with a cache."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
import re
import struct
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Final

from vkbloom._core import ShaderError
from vkbloom._custom import compiler
from vkbloom._custom.compiler import CACHE, run_limited
from vkbloom._custom.described import glslang, lowering, shaderlab, slang, wgsl
from vkbloom._custom.described.files import Files, collect, read_bytes
from vkbloom._custom.described.module import ModuleFault
from vkbloom._custom.described.schema import Description, Shader
from vkbloom._custom.source import Source

#: The attribute of a compute shader before an entry point of HLSL or Slang.
_COMPUTE: Final = (
    r"(?i:\[\s*numthreads)\b[^\]]*\]\s*(?:\[[^\]]*\]\s*|#[^\n]*\n\s*)*(?:public\s+)?void\s+{}\s*\("
)
#: Of all results together with what is before them.
_VERSION: Final = b"9"


@dataclasses.dataclass(frozen=True)
class Program:
    """A compiled shader.

    - `code`: SPIR-V, with the entry point `entry`; None: there is one.
    - `vertex`: SPIR-V of its vertex shader; None: a triangle that covers the target.
    - `names`: Of modules without names, those of the source: place and member, and name.
    - `shift`: Whether bindings are HLSL's registers.
    """

    code: bytes
    entry: str | None
    stage: str | None
    vertex: bytes | None = None
    names: tuple[tuple[str, str], ...] = ()
    shift: bool = False


def compile_all(description: Description, home: Path) -> tuple[dict[Shader, Program], list[str]]:
    """Compile all shaders of a description; return them, and the paths of all files read.

    Raises ShaderError or ValueError with file and line, also for files that cannot be read.
    """
    shaders = list(dict.fromkeys(each.shader for each in description.passes))
    placed = [_with_folders(description.source, shader, home) for shader in shaders]
    prepared = [_prepare(description.source, shader, home) for shader in shaders]
    programs = dict(zip(shaders, _compile(placed, prepared), strict=True))
    return programs, list(dict.fromkeys(path for files in prepared for path in files.paths))


def compile_shaders(shaders: Sequence[Shader], sources: Sequence[Source]) -> list[Program]:
    """Compile shaders whose paths begin in the current folder; errors name their sources."""
    prepared = [
        _prepare(source, shader, Path()) for shader, source in zip(shaders, sources, strict=True)
    ]
    return _compile(shaders, prepared)


def _prepare(source: Source, shader: Shader, home: Path) -> Files:
    path = home / shader.file
    if "\0" in str(path):
        raise source.fault(shader.line, "file: the path has a null character")
    folders = []
    for name in shader.include:
        folders.append(_folder(source, shader, "include", home / name))
    try:
        if shader.language == "spirv":
            return _binary(path)
        if shader.language in ("wgsl", "wesl"):
            folders = [Path(each) for _, each in _with_folders(source, shader, home).dependencies]
            files = wgsl.collect(path, folders)
        else:
            files = collect(path.absolute(), tuple(folders), home.absolute())
        vertex = wgsl.vertex_file(shader)
        if vertex is None:
            return files
        path = path.parent / vertex
        other = collect(path.absolute(), tuple(folders), home.absolute())
        return dataclasses.replace(files, others=(*files.others, other.main, *other.others))
    except OSError as error:
        cause = f"file: {path}: {error.strerror or error}"
        raise source.fault(shader.line, cause) from None


def _with_folders(source: Source, shader: Shader, home: Path) -> Shader:
    """Return a shader with the whole paths of its dependencies."""
    paths = tuple(
        (name, str(_folder(source, shader, "dependencies", home / each)))
        for name, each in shader.dependencies
    )
    return dataclasses.replace(shader, dependencies=paths)


def _folder(source: Source, shader: Shader, key: str, path: Path) -> Path:
    try:
        if path.is_dir():
            return path.resolve()
    except (OSError, ValueError):  # a name that no file can have
        pass
    raise source.fault(shader.line, f"{key}: there is no folder {path}")


def _binary(path: Path) -> Files:
    """Return a file of SPIR-V, whose bytes are characters of its text."""
    return Files(Source(str(path), read_bytes(path).decode("latin-1")), (), ())


def _compile(shaders: Sequence[Shader], prepared: Sequence[Files]) -> list[Program]:
    """Return programs, from the cache where they are there."""
    keys = [_key(*each) for each in zip(shaders, prepared, strict=True)]
    programs = {number: stored for number, key in enumerate(keys) if (stored := _read(key))}
    missing = [number for number in range(len(shaders)) if number not in programs]
    # One process compiles all of WGSL.
    together = [n for n in missing if shaders[n].language in ("wgsl", "wesl")]
    groups = [[n] for n in missing if n not in together] + [together] * bool(together)

    def compile_group(group: list[int]) -> list[Program]:
        asked = [(shaders[number], prepared[number]) for number in group]
        return _wgsl(asked) if group is together else [_COMPILERS[asked[0][0].language](*asked[0])]

    with ThreadPoolExecutor(os.cpu_count()) as threads:
        futures = [threads.submit(compile_group, group) for group in sorted(groups)]
    for group, future in zip(sorted(groups), futures, strict=True):
        for number, program in zip(group, future.result(), strict=True):
            lowered = _lower_program(program, shaders[number], prepared[number])
            CACHE.write(keys[number], _pack(lowered))
            programs[number] = lowered
    return [programs[number] for number in range(len(shaders))]


def _key(shader: Shader, files: Files) -> bytes:
    key = hashlib.sha256(_VERSION + _tool(shader.language) + files.digest)
    key.update(repr(dataclasses.replace(shader, line=0)).encode())
    key.update(repr(files.folders).encode())
    return key.digest()


def _read(key: bytes) -> Program | None:
    stored = CACHE.read(key)
    return None if stored is None else _unpack(stored)


def _lower_program(program: Program, shader: Shader, files: Files) -> Program:
    try:
        vertex = None if program.vertex is None else _lower(program.vertex, shader.language)
        code = _lower(program.code, shader.language)
    except ModuleFault as error:
        raise files.fault("", 1, str(error)) from None
    except (IndexError, KeyError, struct.error):
        raise files.fault("", 1, "the SPIR-V is not valid") from None
    return dataclasses.replace(program, code=code, vertex=vertex)


def _lower(code: bytes, language: str) -> bytes:
    """Return a module without arrays of textures, and without layers of them."""
    if language in ("hlsl", "shaderlab"):
        code = lowering.without_halves(code)
    if lowering.has_arrays(code):
        code = lowering.split_arrays(code, slang.split_arrays)
    return lowering.without_layers(code)


def _pack(program: Program) -> bytes:
    fields = dataclasses.asdict(program)
    for name in ("code", "vertex"):
        fields[name] = None if fields[name] is None else fields[name].hex()
    return json.dumps(fields).encode()


def _unpack(data: bytes) -> Program | None:
    try:
        fields = json.loads(data)
        for name in ("code", "vertex"):
            fields[name] = None if fields[name] is None else bytes.fromhex(fields[name])
        fields["names"] = tuple((place, name) for place, name in fields["names"])
        return Program(**fields)
    except (ValueError, TypeError):
        return None


_COUNTS: Final = ("", "2", "3", "4")
#: Types of HLSL that Slang does not know: of at least so many bits.
_AT_LEAST: Final = {
    f"{name}{count}": f"{kind}{count}"
    for name, kind in (
        *(("min16float", "half"), ("min10float", "half")),
        *(("min16int", "int"), ("min12int", "int"), ("min16uint", "uint")),
    )
    for count in _COUNTS
}
#: What Unity's compiler defines where a description does not. A suffix is the precision of what
#: a texture gives.
_UNITY: Final = {
    "SHADER_API_VULKAN": "1",
    "SHADER_TARGET": "45",
    **{f"fixed{count}": f"float{count}" for count in _COUNTS},
    **{
        f"{kind}_{suffix}": kind
        for kind in (
            *("Texture2D", "Texture2DArray", "Texture3D", "TextureCube", "TextureCubeArray"),
            *("sampler2D", "sampler3D", "samplerCUBE"),
        )
        for suffix in ("float", "half")
    },
    **_AT_LEAST,
}
#: On desktops its half is float.
_FLOATS: Final = {
    **{f"half{count}": f"float{count}" for count in _COUNTS},
    **{f"half{n}x{n}": f"float{n}x{n}" for n in (2, 3, 4)},
}


def _tool(language: str) -> bytes:
    """Return bytes that differ between compilers."""
    if language in ("glsl", "shadertoy"):
        return compiler.identity()
    if language in ("wgsl", "wesl"):
        return wgsl.identity(language)
    if language == "spirv":
        return b"spirv"
    names = (slang.find_slangc(), slang.find_tool("spirv-opt") or "")
    states = [os.stat(name) for name in names if name]
    return repr([names, [(each.st_size, each.st_mtime_ns) for each in states]]).encode()


def _defines(shader: Shader) -> list[str]:
    return [f"-D{name}={value}" for name, value in shader.defines]


def _glsl(shader: Shader, files: Files) -> Program:
    suffix = shader.file.rpartition(".")[2]
    stage = shader.stage or ("compute" if suffix == "comp" else "fragment")
    code = glslang.compile_glsl(files, stage, shader.entry, _defines(shader))
    if shader.vertex is None:
        return Program(code, None, stage)
    path = Path(files.main.name).parent / shader.vertex
    vertex = collect(path, files.folders, path.parent)
    return Program(
        code, None, stage, glslang.compile_glsl(vertex, "vertex", None, _defines(shader))
    )


def _shadertoy(shader: Shader, files: Files) -> Program:
    return Program(glslang.compile_shadertoy(files, _defines(shader)), None, "fragment")


def _slang(shader: Shader, files: Files) -> Program:
    kernels = shaderlab.read_kernels(files) if shader.language == "hlsl" else {}
    if kernels:
        return _kernel(shader, files, kernels)
    stage, entry = shader.stage or "fragment", shader.entry or "main"
    # The entry point may be in a file that this one includes.
    known = re.compile(_COMPUTE.format(re.escape(entry)))
    if shader.stage is None and any(known.search(text) for text in files.texts):
        stage = "compute"
    arguments = [*_defines(shader), *shader.options]
    if shader.language == "hlsl":
        arguments = [*(f"-D{name}={kind}" for name, kind in _AT_LEAST.items()), *arguments]
    code = slang.compile_slang(files, shader.language, stage, entry, arguments)
    vertex = None
    if shader.vertex is not None:
        arguments = [*arguments, "-fvk-invert-y"]
        vertex = slang.compile_slang(files, shader.language, "vertex", shader.vertex, arguments)
    return Program(
        code, None, stage, vertex, shift=shader.language == "hlsl" and slang.has_registers(files)
    )


def _shaderlab(shader: Shader, files: Files) -> Program:
    program = shaderlab.read_program(files, shader.number)
    entry = shader.entry or program.fragment
    if entry is None:
        raise files.fault("", 1, f"program {shader.number} has no #pragma fragment; give entry")
    return _unity(shader, files, "fragment", entry, program.text)


def _kernel(shader: Shader, files: Files, kernels: Mapping[str, Mapping[str, str]]) -> Program:
    """Compile a compute shader of Unity."""
    entry = shader.entry or next(iter(kernels))
    if entry not in kernels or (shader.entry is None and len(kernels) > 1):
        named = f"entry: {entry!r} is not one" if shader.entry else "entry: give one"
        raise files.fault("", 1, f"{named} of the file's kernels: {', '.join(kernels)}")
    defines = (*kernels[entry].items(), *shader.defines)
    return _unity(dataclasses.replace(shader, defines=defines), files, "compute", entry, None)


def _unity(shader: Shader, files: Files, stage: str, entry: str, text: str | None) -> Program:
    """Compile as Unity does. `text`: as of `compile_slang`."""

    def compile(usual: Mapping[str, str]) -> Program:
        known = [f"-D{name}={value}" for name, value in {**usual, **dict(shader.defines)}.items()]
        arguments = [*known, *shader.options]
        code = slang.compile_slang(files, "hlsl", stage, entry, arguments, text=text)
        vertex = None
        if shader.vertex is not None:
            arguments = [*arguments, "-fvk-invert-y"]
            vertex = slang.compile_slang(
                files, "hlsl", "vertex", shader.vertex, arguments, text=text
            )
        return Program(code, None, stage, vertex, shift=slang.has_registers(files))

    try:
        return compile({**_UNITY, **_FLOATS})
    except ShaderError as error:
        # Functions for half beside the same ones for float.
        if not any(word in str(error) for word in ("redeclar", "redefin", "ambiguous")):
            raise
    return compile(_UNITY)


def _wgsl(asked: list[tuple[Shader, Files]]) -> list[Program]:
    return [
        Program(each.code, None, each.stage, each.vertex, names=each.names)
        for each in wgsl.compile_wgsl(asked)
    ]


def _spirv(shader: Shader, files: Files) -> Program:
    code = files.main.text.encode("latin-1")
    validator = slang.find_tool("spirv-val")
    if validator is None:
        raise ShaderError(f"SPIR-V: {slang.MISSING_TOOLS.format('spirv-val')}")
    with tempfile.TemporaryDirectory(prefix="vkbloom") as folder:
        file = Path(folder) / "shader.spv"
        file.write_bytes(code)
        command = [validator, "--target-env", "vulkan1.3", "--scalar-block-layout", str(file)]
        status, output = run_limited(command, "", folder)
    if status:
        lines = output.strip().split("\n")
        cause = lines[0].replace(f"{file}:", "").replace("error:", "").strip()
        raise ShaderError(f"{files.main.name}:1: the SPIR-V is not valid: {cause}")
    return Program(code, shader.entry, shader.stage)


_COMPILERS: Final = {
    "glsl": _glsl,
    "shadertoy": _shadertoy,
    "hlsl": _slang,
    "slang": _slang,
    "shaderlab": _shaderlab,
    "spirv": _spirv,
}
