"""glslang, Khronos' compiler from GLSL to SPIR-V, as one program."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from vkbloom_glslang._build import GLSLANG, SHA256

__all__ = ["GLSLANG", "PATH", "SHA256"]

#: Where the program is.
PATH: Final = Path(__file__).parent / "glslangValidator"
