"""What reads descriptions and shaders before anything is compiled or rendered.

Tests that change files by the thousand call it without the compilers behind it.
"""

from __future__ import annotations

from vkbloom._custom.compiler import find_compiler, identity, run_limited
from vkbloom._custom.described import files, shaderlab, slang, wgsl
from vkbloom._custom.described.binding import bind
from vkbloom._custom.described.files import MAX_FILES
from vkbloom._custom.described.lines import find_lines
from vkbloom._custom.described.module import Module
from vkbloom._custom.described.programs import Program, compile_all
from vkbloom._custom.described.schema import Description, Shader, read_schema
from vkbloom._custom.described.source import compile_described, open_described
from vkbloom._custom.loops import has_endless_loop
from vkbloom._custom.rounds import limit_rounds
from vkbloom._custom.source import Source, check

__all__ = [
    "MAX_FILES",
    "Description",
    "Module",
    "Program",
    "Shader",
    "Source",
    "bind",
    "check",
    "compile_all",
    "compile_described",
    "files",
    "find_compiler",
    "find_lines",
    "has_endless_loop",
    "identity",
    "limit_rounds",
    "open_described",
    "read_schema",
    "run_limited",
    "shaderlab",
    "slang",
    "wgsl",
]
