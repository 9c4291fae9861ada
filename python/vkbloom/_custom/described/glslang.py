"""GLSL as it is, and ShaderToy's: by glslang."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from vkbloom._core import ShaderError
from vkbloom._custom.compiler import find_compiler, run_limited, was_ended
from vkbloom._custom.described.files import Files

#: What ShaderToy declares before a shader.
SHADERTOY: Final = """\
layout(location = 0) out vec4 vkb_colour;
uniform vec3 iResolution;
uniform float iTime;
uniform float iTimeDelta;
uniform float iFrameRate;
uniform int iFrame;
uniform vec4 iMouse;
uniform vec4 iDate;
uniform float iSampleRate;
uniform float iChannelTime[4];
uniform vec3 iChannelResolution[4];
uniform sampler2D iChannel0;
uniform sampler2D iChannel1;
uniform sampler2D iChannel2;
uniform sampler2D iChannel3;
#define texture2D texture
#define texture2DLodEXT textureLod
"""
SHADERTOY_MAIN: Final = """
#line 1 1
void main()
{
    vkb_colour = vec4(0.0, 0.0, 0.0, 1.0);
    mainImage(vkb_colour, gl_FragCoord.xy);
}
"""
_VERSION: Final = re.compile(r"^([ \t]*#[ \t]*version\b[^\n]*)$", re.MULTILINE)
_INCLUDES: Final = "#extension GL_GOOGLE_include_directive : enable"
_SUFFIXES: Final = {"fragment": "frag", "compute": "comp", "vertex": "vert"}
_MESSAGE: Final = re.compile(r"^ERROR: (.*?):(\d+): (.*)$", re.MULTILINE)
#: Functions and variables of versions before 1.30, which Vulkan has not.
_OLD: Final = re.compile(r"'(texture2D|texture2DLod|gl_FragColor|gl_FragData|varying|attribute)'")


def compile_glsl(files: Files, stage: str, entry: str | None, defines: list[str]) -> bytes:
    """Return the SPIR-V of a file of GLSL."""
    return _compile(files, stage, entry, defines, with_version(files.main.text))


def compile_shadertoy(files: Files, defines: list[str]) -> bytes:
    """Return the SPIR-V of a file that has mainImage."""
    text = f"#version 450\n{_INCLUDES}\n{SHADERTOY}#line 1 0\n{files.main.text}{SHADERTOY_MAIN}"
    return _compile(files, "fragment", None, defines, text)


def with_version(text: str) -> str:
    """Return GLSL with what includes need, under the file's own numbers of lines."""
    match = _VERSION.search(text)
    if match is None:
        return f"#version 450\n{_INCLUDES}\n#line 1\n{text}"
    line = text.count("\n", 0, match.start()) + 2
    return f"{text[: match.end()]}\n{_INCLUDES}\n#line {line}{text[match.end() :]}"


def _compile(files: Files, stage: str, entry: str | None, defines: list[str], text: str) -> bytes:
    import tempfile  # noqa: PLC0415  rarely needed

    with tempfile.TemporaryDirectory(prefix="vkbloom") as folder:
        target = Path(folder) / "shader.spv"
        command = [find_compiler(), "-V", "-R", "--amb", "--aml", "--target-env", "vulkan1.1"]
        command += ["--stdin", "-S", _SUFFIXES[stage], "-o", str(target), *defines]
        command += [f"-I{each}" for each in (Path(files.main.name).parent, *files.folders)]
        if entry not in (None, "main"):
            command += ["-e", str(entry), "--source-entrypoint", "main"]
        status, output = run_limited(command, text, folder)
        code = target.read_bytes() if status == 0 and target.exists() else b""
    if not code:
        raise _explain(files, status, output)
    return code


def _explain(files: Files, status: int, output: str) -> ShaderError:
    if ended := was_ended(status):
        return files.fault("", 1, ended)
    for name, line, cause in _MESSAGE.findall(output):
        hint = ""
        lines = files.main.text.split("\n")
        quoted = lines[int(line) - 1] if 0 < int(line) <= len(lines) else ""
        if (
            _OLD.search(cause)
            or "texture2D(" in quoted
            or "not supported for this version" in cause
        ):
            hint = "; Vulkan's GLSL is that of version 1.40 and later: texture(), in, out"
        if name == "1":
            missing = "the file has no function 'void mainImage(out vec4, in vec2)'"
            return files.fault("", 1, missing)
        return files.fault(
            "" if name in ("0", "stdin") else name, int(line), f"{cause.strip()}{hint}"
        )
    return _explain_whole(files, status, output)


def _explain_whole(files: Files, status: int, output: str) -> ShaderError:
    """Return the error of a file, where glslang names no line."""
    lines = [line.strip() for line in output.split("\n") if line.strip() not in ("", "stdin")]
    if "Missing entry point" in output:
        return files.fault("", 1, "the file has no function 'void main()'")
    named = [number for number, line in enumerate(lines) if line.startswith("ERROR: ")]
    if not named:
        return files.fault("", 1, f"glslang refused the file: {lines[-1] if lines else status}")
    first = named[0]
    # What it is about is on the line after it.
    cause = lines[first].removeprefix("ERROR: ")
    if cause.endswith(":") and first + 1 < len(lines):
        cause += f" {lines[first + 1]}"
    word = re.search(r"(\w+)\(", cause)
    wanted = re.escape(word[1]) if word else r"#\s*version" if "version" in cause else r"\Z"
    at = re.search(rf"(?<!\w){wanted}\b", files.main.text)
    line = files.main.text.count("\n", 0, at.start()) + 1 if at else 1
    return files.fault("", line, cause)
