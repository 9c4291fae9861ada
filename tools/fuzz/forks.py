"""glslang in a process that forks for each shader: forty times as many shaders in the same time.

``forks.cpp`` uses the same library as glslangValidator, from Debian's package glslang-dev.
"""

from __future__ import annotations

import subprocess
import threading
from pathlib import Path

from vkbloom._custom import compiler

SOURCE = Path(__file__).with_suffix(".cpp")
LIBRARIES = (
    *("glslang", "MachineIndependent", "GenericCodeGen", "OSDependent", "OGLCompiler", "SPIRV"),
    *("HLSL", "glslang-default-resource-limits", "SPIRV-Tools-opt", "SPIRV-Tools"),
)


def built(folder: Path) -> Path:
    """Build the program in a folder."""
    program = folder / "forks"
    command = ["g++", "-O2", str(SOURCE), "-o", str(program)]
    subprocess.run([*command, *(f"-l{name}" for name in LIBRARIES)], check=True)
    return program


class Forks:
    """The process; in place of ``vkbloom._custom.compiler.run_limited``."""

    def __init__(self, program: Path) -> None:
        self.process = subprocess.Popen(
            [program, compiler.LIBRARY], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        # The passes of a file are compiled in several threads.
        self.lock = threading.Lock()

    def run_limited(self, command: list[str], text: str, folder: str) -> tuple[int, str]:
        """Compile a text; return the exit status and the messages."""
        stage, target = (command[command.index(option) + 1] for option in ("-S", "-o"))
        data = text.encode()
        with self.lock:
            assert self.process.stdin is not None
            assert self.process.stdout is not None
            self.process.stdin.write(f"{stage} {len(data)} {target}\n".encode() + data)
            self.process.stdin.flush()
            status, length = self.process.stdout.readline().split()
            return int(status), self.process.stdout.read(int(length)).decode(errors="replace")
