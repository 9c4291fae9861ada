"""HLSL and Slang: by Slang's command slangc, and SPIRV-Tools' spirv-opt."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import re
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Final

from vkbloom._core import ShaderError
from vkbloom._custom.compiler import run_limited, was_ended
from vkbloom._custom.described.files import Files

#: The first binding of each kind of HLSL's registers: b, t, s, u.
SHIFTS: Final = {"b": 0, "t": 100, "s": 200, "u": 300}
MISSING: Final = (
    "HLSL and Slang need the compiler slangc: pip install vkbloom[slang] && pip install --no-deps "
    "slangtorch (29 MB), or set VKBLOOM_SLANGC to its path"
)
MISSING_TOOLS: Final = "{} is needed: pip install vkbloom[slang] (SPIRV-Tools, 14 MB)"
_MESSAGE: Final = re.compile(
    r"^error(?:\[\w+\])?: (.*)\n\s*--> (.*?):(\d+):\d+"
    r"|^(.*?)\((\d+)\): (?:fatal )?error(?: \w+)?: (.*)$",
    re.MULTILINE,
)
#: What a message says below the line that it quotes.
_SAID: Final = re.compile(r"^\s*\|\s*\^+ (.+)$", re.MULTILINE)
#: What is not there in a stage: the place where it is used.
_USED: Final = re.compile(r"^note: see using of '(\w+)'\n\s*--> (.*?):(\d+):\d+", re.MULTILINE)
#: Names of Direct3D 9, which Unity's shaders have and Slang has not.
_D3D9: Final = """\
#define sampler2D Sampler2D<float4>
float4 tex2D(Sampler2D<float4> image, float2 at) { return image.Sample(at); }
float4 tex2Dlod(Sampler2D<float4> image, float4 at) { return image.SampleLevel(at.xy, at.w); }
float4 tex2Dbias(Sampler2D<float4> image, float4 at) { return image.SampleBias(at.xy, at.w); }
"""
#: Unity's own header UnityCG.cginc is no part of its projects: a small one in its place.
UNITY: Final = Path(__file__).with_name("unity")


def find_slangc() -> str:
    """Return the path of slangc: of VKBLOOM_SLANGC, the system's, or the package slangtorch's."""
    if (chosen := os.environ.get("VKBLOOM_SLANGC")) and shutil.which(chosen) is None:
        raise ShaderError(f"VKBLOOM_SLANGC: {chosen!r} is not a program")
    if given := chosen or shutil.which("slangc"):
        return given
    # Its files alone: the package itself needs PyTorch.
    with contextlib.suppress(ImportError, ValueError):
        spec = importlib.util.find_spec("slangtorch")
        for folder in (spec.submodule_search_locations or []) if spec else []:
            if os.path.isfile(program := os.path.join(folder, "bin", "slangc")):
                return program
    raise ShaderError(MISSING)


def find_tool(name: str) -> str | None:
    """Return the path of a command of SPIRV-Tools: that of the extra, or the system's."""
    for folder in sys.path:
        if os.path.isfile(program := os.path.join(folder, "cmeel.prefix", "bin", name)):
            return program
    return shutil.which(name)


def compile_slang(
    files: Files,
    language: str,
    stage: str,
    entry: str,
    arguments: list[str],
    *,
    text: str | None = None,
) -> bytes:
    """Return the SPIR-V of an entry point. `text`: what is compiled in place of the file."""
    optimizer = find_tool("spirv-opt")
    with tempfile.TemporaryDirectory(prefix="vkbloom") as folder:
        target = Path(folder) / "shader.spv"
        file = Path(files.main.name)
        if text is None and language == "hlsl" and is_old(files):
            text = f'#line 1 "{file}"\n{files.main.text}'
        if text is not None:
            text = f"{_D3D9 if is_old(files) else ''}{text}"
            file = Path(folder) / f"shader.{language}"
            file.write_text(text, encoding="utf-8")
        command = [find_slangc(), "-lang", language, str(file), "-target", "spirv"]
        command += ["-stage", stage, "-entry", entry, "-o", str(target), *arguments]
        command += [f"-I{each}" for each in (Path(files.main.name).parent, *files.folders, UNITY)]
        command += ["-warnings-disable", "39001,39029,39013,30081,15205,41018"]
        if language == "hlsl" and has_registers(files):
            command += ["-fvk-bind-globals", "99", "0"]
            for kind, shift in SHIFTS.items():
                command += [f"-fvk-{kind}-shift", str(shift), "all"]
        # slangc of slangtorch comes without its optimizer.
        command += ["-O0"] if optimizer else []
        status, output = run_limited(command, "", folder)
        code = target.read_bytes() if status == 0 and target.exists() else b""
        if not code:
            raise _explain(files, str(file), status, output, entry)
        return optimize(optimizer, code, folder) if optimizer else code


def has_registers(files: Files) -> bool:
    """Whether a file names registers; without them Slang gives each binding its own number."""
    return any(re.search(r"\bregister\s*\(", text) for text in files.texts)


def is_old(files: Files) -> bool:
    """Whether a file has the names of Direct3D 9."""
    return any(
        re.search(r"\btex2D(?:lod|bias)?\s*\(", each.text) for each in (files.main, *files.others)
    )


def split_arrays(code: bytes) -> bytes:
    """Return SPIR-V in which each element of an array of textures is a variable."""
    program = find_tool("spirv-opt")
    if program is None:
        raise ShaderError(f"arrays of textures: {MISSING_TOOLS.format('spirv-opt')}")
    passes = [
        "-O",
        "--replace-desc-array-access-using-var-index",
        "--eliminate-dead-code-aggressive",
    ]
    passes += ["--descriptor-array-scalar-replacement", "-O"]
    with tempfile.TemporaryDirectory(prefix="vkbloom") as folder:
        return _run_optimizer(program, code, folder, passes)


def optimize(program: str, code: bytes, folder: str) -> bytes:
    """Return SPIR-V with loops unrolled, constants folded, and what is not used left out."""
    return _run_optimizer(program, code, folder, ["-O"])


def _run_optimizer(program: str, code: bytes, folder: str, passes: list[str]) -> bytes:
    """Return SPIR-V after some passes of SPIRV-Tools; as it was where these fail."""
    source, target = Path(folder) / "before.spv", Path(folder) / "after.spv"
    source.write_bytes(code)
    command = [program, "--skip-validation", *passes, str(source), "-o", str(target)]
    status, _ = run_limited(command, "", folder)
    return target.read_bytes() if status == 0 and target.exists() else code


def _explain(files: Files, file: str, status: int, output: str, entry: str) -> ShaderError:
    # Its own status is -1, which is 255.
    if ended := was_ended(min(status, 0)):
        return files.fault("", 1, ended)
    if "downstream compiler" in output:
        return ShaderError(MISSING_TOOLS.format("spirv-opt"))
    for match in _MESSAGE.finditer(output):
        cause, name, line = match[1], match[2], match[3]
        if cause is None:
            name, line, cause = match[4], match[5], match[6]
        if "uses features that are not available" in output[match.end() :]:
            used = _USED.search(output, match.end())
            if used:
                cause, name, line = f"Slang has no {used[1]!r} for SPIR-V", used[2], used[3]
                return files.fault("" if name == file else name, int(line), cause)
        name = "" if name == file or not name else name
        said = _SAID.search(output, match.end())
        return files.fault(name, int(line), (said[1] if said else cause).strip().rstrip("."))
    if "entry point" in output or "E38000" in output:
        return files.fault("", 1, f'the file has no entry point {entry!r}; give entry = "NAME"')
    lines = [line for line in output.strip().split("\n") if "rror" in line] or [f"status {status}"]
    return files.fault("", 1, f"slangc refused the file: {lines[0].strip()}")
