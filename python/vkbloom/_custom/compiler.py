"""The compiler of custom shaders: glslang as a child process, with limits, and a cache."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np

from vkbloom._core import ShaderError
from vkbloom._custom import hints
from vkbloom._custom.file import CustomFile
from vkbloom._custom.glsl import BODY, Shader
from vkbloom._custom.limits import limit_shader
from vkbloom._custom.loops import has_endless_loop
from vkbloom._custom.names import GLOW, HOOKED, STAGES, stage_of
from vkbloom._custom.passes import CustomPass
from vkbloom._custom.spirv import without_contraction
from vkbloom._io.disk_cache import DiskCache

if sys.platform == "linux":
    import resource

#: Of the process: seconds of the processor, seconds in all, bytes of memory, bytes of its result,
#: and of what it says.
MAX_PROCESSOR_SECONDS: Final = 20
MAX_SECONDS: Final = 60.0
MAX_MEMORY: Final = 2 << 30
MAX_RESULT_BYTES: Final = 64 << 20
MAX_OUTPUT_BYTES: Final = 16 << 20

#: The package's GLSL that `#include` finds.
LIBRARY: Final = Path(__file__).parent / "glsl"
CACHE: Final = DiskCache("shaders")
SPIRV_MAGIC: Final = 0x07230203
#: Of what becomes of the compiler's result.
_VERSION: Final = b"1"
MESSAGE: Final = re.compile(r"^ERROR: (?:(\d+):)?(\d+): (.*)$", re.MULTILINE)

MISSING: Final = (
    "custom methods need the compiler glslang (glslangValidator): pip install vkbloom[shaders] "
    "(1 MB), or on Debian or Ubuntu: apt install glslang-tools"
)


@functools.cache
def find_compiler() -> str:
    """Return the path of the compiler: the wheel's, or the system's."""
    with contextlib.suppress(ImportError):
        import vkbloom_glslang  # noqa: PLC0415  where it is installed

        return str(vkbloom_glslang.PATH)
    program = shutil.which("glslangValidator") or shutil.which("glslang")
    if program is None:
        raise ShaderError(MISSING)
    return program


@functools.cache
def identity() -> bytes:
    """Return bytes that differ between compilers, and between states of the library."""
    compiler = os.stat(find_compiler())
    known = hashlib.sha256(f"{find_compiler()} {compiler.st_size} {compiler.st_mtime_ns}".encode())
    for file in sorted(LIBRARY.rglob("*.glsl")):
        known.update(file.read_bytes())
    return known.digest()


def compile_shader(file: CustomFile, item: CustomPass, shader: Shader) -> bytes:
    """Return the SPIR-V of a pass, from the cache where it is there."""
    code = cached_code(shader)
    if code is None:
        code = compile_pass(file, item, shader)
        CACHE.write(_key(shader), code)
    return code


def cached_code(shader: Shader) -> bytes | None:
    """Return the SPIR-V of a shader that was compiled before; None if the cache has it not."""
    return CACHE.read(_key(shader))


def _key(shader: Shader) -> bytes:
    known = identity() + _VERSION + bytes([shader.compute])
    return hashlib.sha256(known + shader.text.encode()).digest()


def compile_pass(file: CustomFile, item: CustomPass, shader: Shader) -> bytes:
    """Run the compiler; raise ShaderError with the user's file and line if it refuses."""
    with tempfile.TemporaryDirectory(prefix="vkbloom") as folder:
        target = Path(folder) / "shader.spv"
        command = [find_compiler(), "-V", "--target-env", "vulkan1.1", "--stdin"]
        command += ["-S", "comp" if shader.compute else "frag", f"-I{LIBRARY}", "-o", str(target)]
        status, text = run_limited(command, shader.text, folder)
        code = target.read_bytes() if status == 0 and target.exists() else b""
    if not code:
        raise ShaderError(explain(file, item, status, text))
    words = np.frombuffer(code, "=u4")
    if len(code) % 4 or len(words) < 6 or words[0] != SPIRV_MAGIC:
        raise ShaderError(file.source.where(item.line, "the compiler's result is not SPIR-V"))
    if has_endless_loop(tuple(words.tolist())):
        cause = "the pass has a loop that never ends"
        raise ShaderError(file.source.where(item.body_line, cause))
    try:
        limited = limit_shader(tuple(words.tolist()))
    except ValueError as error:
        raise ShaderError(file.source.where(item.body_line, str(error))) from None
    return np.array(without_contraction(limited), "=u4").tobytes()


def run_limited(
    command: list[str],
    text: str,
    folder: str,
    variables: Mapping[str, str] | None = None,
    *,
    memory: int = MAX_MEMORY,
    file: int = MAX_RESULT_BYTES,
) -> tuple[int, str]:
    """Run a process that reads a text; return its exit status and its output.

    It has the environment variables of this process, and `variables`. `memory` and `file` are the
    most bytes of its address space and of a file.

    Its output goes to a file, which has a limit, and for which nobody waits that it left behind.

    The limits are set after the process started and before it gets the text, so that nothing of
    this process runs between fork and exec. What is preloaded into this process stays out: a
    sanitizer needs more address space than the limit.
    """
    environment = {name: os.environ[name] for name in os.environ if name != "LD_PRELOAD"}
    environment.update(variables or {})
    with (
        tempfile.TemporaryFile() as output,
        subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=output,
            stderr=subprocess.STDOUT,
            cwd=folder,
            env=environment,
        ) as process,
    ):
        limit(process.pid, memory, file)
        # A wait with a timeout looks for the end every 50 ms.
        timer = threading.Timer(MAX_SECONDS, process.kill)
        timer.daemon = True
        timer.start()
        try:
            process.communicate(text.encode(errors="replace"))
        except BaseException:
            process.kill()
            raise
        finally:
            timer.cancel()
        output.seek(0)
        return process.returncode, output.read(MAX_OUTPUT_BYTES).decode(errors="replace")


def limit(process: int, memory: int, file: int) -> None:
    """Set the limits of a process, where the system can."""
    if sys.platform != "linux":
        return
    for which, most in (
        (resource.RLIMIT_CPU, MAX_PROCESSOR_SECONDS),
        (resource.RLIMIT_AS, memory),
        (resource.RLIMIT_FSIZE, file),
        (resource.RLIMIT_CORE, 0),
    ):
        with contextlib.suppress(ProcessLookupError, ValueError, PermissionError):
            resource.prlimit(process, which, (most, most))


def was_ended(status: int) -> str:
    """Return why a compiler has no result that a signal ended; "" if it ended by itself."""
    if 0 <= status <= 128:
        return ""
    number = -status if status < 0 else status - 128
    known = number in set(signal.Signals)
    name = signal.Signals(number).name if known else f"status {status}"
    return (
        f"the compiler was ended by {name}: it may take {MAX_PROCESSOR_SECONDS} s and "
        f"{MAX_MEMORY >> 20} MiB for a pass"
    )


def explain(file: CustomFile, item: CustomPass, status: int, text: str) -> str:
    """Return the message of a pass that does not compile."""
    source = file.source
    if ended := was_ended(status):
        return source.where(item.line, ended)
    last = item.body_line + item.body.count("\n")
    for part, number, cause in MESSAGE.findall(text):
        if part == str(BODY):
            bound = [stage_of(binding.value) for binding in item.bindings]
            saved = [each.save.value for each in file.passes if each.save is not None]
            textures = [HOOKED, GLOW, *STAGES, *saved, *file.embedded]
            hint = hints.for_undeclared(cause, bound, textures)
            return source.where(min(max(int(number), 1), last), cause.strip() + hint)
    if "'hook'" in text:
        kind = "void hook()" if item.compute else "vec4 hook()"
        return source.where(item.body_line, f"the pass defines no function '{kind}'")
    match = MESSAGE.search(text)
    cause = match[3].strip() if match else text.strip().split("\n")[-1]
    # A name of a block that GLSL does not accept, in the lines before the body.
    lines = {block.name: block.line for block in (*file.params, *file.embedded.values())}
    for name in re.findall(r"'(\w+)'", cause):
        if name in lines:
            return source.where(lines[name], f"{name!r} is not possible as a name: {cause}")
    return source.where(item.body_line, f"the pass is not complete GLSL: {cause}")
