"""Descriptions from shaders: what reflection tells, and where a person must say more."""

from __future__ import annotations

import dataclasses
import json
import keyword
import os
import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from vkbloom._custom.described import shaderlab
from vkbloom._custom.described.binding import is_stored, rename
from vkbloom._custom.described.files import Files, read_bytes
from vkbloom._custom.described.layout import paths
from vkbloom._custom.described.module import INPUT, OUTPUT, UNIFORM_CONSTANT, Module, Variable
from vkbloom._custom.described.programs import Program, compile_shaders
from vkbloom._custom.described.schema import LANGUAGES, Shader
from vkbloom._custom.described.source import DescribedSource, compile_described
from vkbloom._custom.names import TAKEN
from vkbloom._custom.source import Source
from vkbloom._settings.settings import Settings

#: Marks what a person must say.
TODO: Final = "# TODO"
SUFFIXES: Final = {suffix: name for name, suffixes in LANGUAGES.items() for suffix in suffixes}
_DOWN: Final = re.compile(r"down|reduce|prefilter|shrink", re.IGNORECASE)
_UP: Final = re.compile(r"up(?!date)|expand|tent|combine", re.IGNORECASE)
_SMALL: Final = re.compile(r"low|small|coarse|prev|blur|bloom|input|source|below", re.IGNORECASE)
_TEXEL: Final = re.compile(r"texel|pixel|inv|rcp|recip|pt$|halfpixel|step", re.IGNORECASE)
_SIZE: Final = re.compile(r"size|resolution|dim|extent|viewport|scale", re.IGNORECASE)
_UNITY: Final = re.compile(r"_TexelSize$")
#: Entry points of languages that do not say which one is meant: functions that return a colour.
_ENTRIES: Final = re.compile(
    r"\[shader\(\"(fragment|pixel|compute)\"\)\][^{};]*?\b(\w+)\s*\("
    r"|\[numthreads\([^]]*\][^{};]*?\bvoid\s+(\w+)\s*\("
    r"|\b(?:float|half|min16float|fixed)[34]\s+(\w+)\s*\([^{};]*\)\s*:\s*SV_Target",
    re.IGNORECASE,
)
_WGSL_ENTRIES: Final = re.compile(r"@(?:fragment|compute)\b[^{}]*?\bfn\s+(\w+)")


@dataclasses.dataclass(frozen=True)
class _Found:
    """A shader of a file, and what its entry point uses."""

    file: str
    language: str
    entry: str | None
    name: str
    module: Module
    variables: list[Variable]
    stage: str


def is_shader(path: str | os.PathLike[str]) -> bool:
    """Whether a path is that of a shader, not of passes in the syntax of mpv's user shaders."""
    file = Path(path)
    if file.suffix.lower() not in SUFFIXES or not file.is_file():
        return False
    if SUFFIXES[file.suffix.lower()] != "glsl":
        return True
    with file.open("rb") as stream:
        return b"//!" not in stream.read(1 << 20)


def read_shaders(files: Sequence[str | os.PathLike[str]]) -> DescribedSource:
    """Return the source of a description that is made of shaders.

    Raises ValueError if it has something that a person must say.
    """
    text = describe(files)
    first = Path(files[0])
    for number, line in enumerate(text.split("\n"), 1):
        if TODO in line:
            names = " ".join(str(file) for file in files)
            raise ValueError(
                f"{first}: the shaders do not tell all: {line.partition(TODO)[2].strip(': ')} "
                f"(line {number} of 'vkbloom describe {names}'); write this into a file, complete "
                "it, and give that file"
            )
    return compile_described(Source(str(first), text), Path())


def describe(files: Sequence[str | os.PathLike[str]]) -> str:
    """Return the text of a description of shaders; paths are as they are given."""
    groups = [_find_shaders(Path(file)) for file in files]
    shaders = [shader for _, group in groups for shader in group]
    sources = [source for source, group in groups for _ in group]
    programs = compile_shaders(shaders, sources)
    shared = {group[0].file for _, group in groups if len(group) > 1}
    found = [
        _open(shader, program, several=shader.file in shared)
        for shader, program in zip(shaders, programs, strict=True)
    ]
    writer = _Writer(found)
    return writer.write()


def _find_shaders(path: Path) -> tuple[Source, list[Shader]]:
    """Read a file, and return its entry points."""
    language = SUFFIXES.get(path.suffix.lower())
    if language is None:
        raise ValueError(
            f"{path}: the name does not tell the language; known are {', '.join(SUFFIXES)}"
        )
    text = read_bytes(path).decode("latin-1")
    if language == "glsl" and re.search(r"\bvoid\s+mainImage\s*\(", text):
        language = "shadertoy"
    entries: list[str | None] = [None]
    if language in ("hlsl", "slang"):
        kernels = shaderlab.read_kernels(Files(Source(str(path), text), (), ()))
        names = [*kernels] or [
            next(filter(None, match.groups()[1:])) for match in _ENTRIES.finditer(text)
        ]
        entries = list(dict.fromkeys(names)) or ["main"]
    elif language in ("wgsl", "wesl"):
        entries = list(dict.fromkeys(_WGSL_ENTRIES.findall(text))) or [None]
    stage = {".comp": "compute", ".frag": "fragment"}.get(path.suffix)
    shaders = [
        Shader(str(path), language, entry, stage, None, (), (), (), (), (), (), 0, 1)
        for entry in entries
    ]
    return Source(str(path), text), shaders


def _open(shader: Shader, program: Program, *, several: bool) -> _Found:
    """Return what an entry point uses. `several`: its file has others."""
    path = Path(shader.file)
    module = Module(program.code)
    for place, name in program.names:
        rename(module, place, name)
    entry = module.entry(None, program.stage)
    stem = re.sub(r"\W", "_", path.name.partition(".")[0])[:20]
    name = (shader.entry or stem)[:20] if several else stem
    shown = shader.entry if several or shader.entry != "main" else None
    variables = module.variables(entry)
    return _Found(str(path), shader.language, shown, name, module, variables, entry.stage)


class _Writer:
    """Writes a description."""

    def __init__(self, found: list[_Found]) -> None:
        self._found = found
        self._settings: dict[str, str] = {}
        self._passes: list[str] = []
        downs = [each for each in found if _DOWN.search(each.name)]
        ups = [each for each in found if _UP.search(each.name) and each not in downs]
        self._is_chain = len(found) == 2 and len(downs) == len(ups) == 1
        if self._is_chain:
            self._found = [*downs, *ups]

    def write(self) -> str:
        """Return the text."""
        for number, each in enumerate(self._found):
            self._write_pass(each, number)
        last = self._found[-1]
        several = len(_targets(last)) > 1
        result = f"{last.name}{'_0' * several}{'[0]' * self._is_chain}"
        lines = ["# What an engine's CPU code does for these shaders.", f'bloom = "{result}"', ""]
        if self._is_chain:
            lines += ["[settings.levels]", 'type = "int"', "default = 5", "range = [2, 10]", ""]
        for name, text in self._settings.items():
            lines += [f"[settings.{name}]", text, ""]
        return "\n".join(lines + self._passes)

    def _write_pass(self, each: _Found, number: int) -> None:
        is_down = self._is_chain and number == 0
        lines = ["[[passes]]", f"file = {json.dumps(each.file)}"]
        if each.language != SUFFIXES.get(Path(each.file).suffix.lower()):
            lines.append(f'language = "{each.language}"')
        if each.entry:
            lines.append(f'entry = "{each.entry}"')
        if self._is_chain:
            down = self._found[0].name
            level = "[level]"
            lines.append('down = [0, "levels - 1"]' if is_down else 'up = ["levels - 2", 0]')
            size = f"size({down}[level])"
        else:
            level, size = "", "size(glow)"
        sources = self._textures(each, number)
        image = next((name for name, _ in sources if name.isidentifier()), "glow")
        if is_down:
            size = f"size({image}) / 2"
        lines += self._outputs(each, level, size)
        if sources:
            lines.append("[passes.textures]")
            lines += [f"{_key(name)} = {source}" for name, source in sources]
        values = self._values(each, image)
        if values:
            lines.append("[passes.values]")
            lines += values
        self._passes += [*lines, ""]

    def _outputs(self, each: _Found, level: str, size: str) -> list[str]:
        compute = each.stage == "compute"
        targets = _targets(each)
        sized = f'size = "{size}"'
        if len(targets) <= 1:
            return [f'output = "{each.name}{level}"', sized]
        names = dict.fromkeys(
            _array_label(variable) if compute else str(variable.location) for variable in targets
        )
        arrays = {_array_label(variable) for variable in targets if variable.element is not None}
        inside = ", ".join(
            f'{_key(name)} = "{each.name}_{number}{"[element]" if name in arrays else level}"'
            for number, name in enumerate(names)
        )
        return [f"outputs = {{ {inside} }}  {TODO}: which of them is what, and its size", sized]

    def _textures(self, each: _Found, number: int) -> list[tuple[str, str]]:
        names = [
            _label(variable)
            for variable in each.variables
            if variable.storage == UNIFORM_CONSTANT
            and variable.type.kind in ("sampled", "image")
            and not is_stored(variable)
        ]
        if each.language == "shadertoy":
            names = [name for name in names if name != "iChannel0"]
        if self._is_chain:
            return self._chain_textures(names, number)
        made = []
        before = self._found[number - 1].name if number else "glow"
        for place, name in enumerate(names):
            if place == 0 and (number == 0 or len(names) == 1):
                made.append((name, f'"{before}"'))
            elif re.search(r"scene|frame|hdr|orig", name, re.IGNORECASE):
                made.append((name, '"frame"'))
            else:
                made.append((name, f'"{before}"  {TODO}: which image {name} is'))
        return made

    def _chain_textures(self, names: list[str], number: int) -> list[tuple[str, str]]:
        down, up = self._found[0].name, self._found[1].name
        if number == 0:
            source = f'["{down}[level - 1]", "glow"]'
            rest = [(name, f'"glow"  {TODO}: which image {name} is') for name in names[1:]]
            return [(name, source) for name in names[:1]] + rest
        low = f'["{up}[level + 1]", "{down}[level + 1]"]'
        here = f'"{down}[level]"'
        if len(names) == 1:
            return [
                (names[0], f'{low}  {TODO}: an up pass that reads one image needs blend = "add"')
            ]
        small = [name for name in names if _SMALL.search(name)]
        if len(names) == 2 and len(small) == 1:
            return [(name, low if name in small else here) for name in names]
        return [
            (name, f"{low if place == 0 else here}  {TODO}: which level {name} is")
            for place, name in enumerate(names)
        ]

    def _values(self, each: _Found, image: str) -> list[str]:
        if each.language == "shadertoy":
            return []
        lines = []
        for variable in each.variables:
            if not (variable.is_block or variable.is_buffer) or variable.storage in (INPUT, OUTPUT):
                continue
            if variable.is_buffer:
                if variable.read_only:
                    lines.append(
                        f"{_key(_label(variable))} = 0  {TODO}: the numbers of this buffer"
                    )
                continue
            lines += self._members(variable, image, _shared_members(each))
        return lines

    def _members(self, variable: Variable, image: str, shared: set[str]) -> list[str]:
        """Return lines of values. `shared`: the members that several blocks have."""
        lines = []
        for path, kind, _ in paths(variable.type):
            if not path or kind.kind == "struct" or "[" in path:
                continue
            if variable.members is not None and len(variable.type.members) > 1:
                top = [
                    index
                    for index, member in enumerate(variable.type.members)
                    if path.split(".")[0] == member.name
                ]
                if top and not any(used[:1] == (top[0],) for used in variable.members):
                    continue
            key = f"{_label(variable)}.{path}" if path in shared else path
            lines.append(f"{_key(key)} = {self._value(path, kind.kind, kind.count, image)}")
        return lines

    def _value(self, path: str, kind: str, count: int, image: str) -> str:
        name = path.rpartition(".")[2]
        if _UNITY.search(name) and kind == "vector" and count == 4:
            return f'["texel({image})", "size({image})"]'
        if kind == "vector" and count == 2 and _TEXEL.search(name):
            return f'"texel({image})"'
        if kind == "vector" and count == 2 and _SIZE.search(name):
            return f'"size({image})"'
        if kind in ("float", "int", "uint"):
            if name in ("level", "mip", "lod", "i", "index") and self._is_chain:
                return '"level"'
            setting = re.sub(r"\W|^(?=\d)|^_+", "", name).lower() or "value"
            if hasattr(Settings, setting) or keyword.iskeyword(setting) or setting in TAKEN:
                setting += "_value"
            whole = 'type = "int"\n' if kind != "float" else ""
            self._settings.setdefault(setting, f"{whole}default = 1  # a guess; range = [0, 4]")
            return f'"{setting}"'
        entries = count if kind in ("vector", "array") else 1
        return f"0  {TODO}: the {entries} numbers of {path}"


def _targets(each: _Found) -> list[Variable]:
    """Return what a shader writes."""
    compute = each.stage == "compute"
    return [
        variable
        for variable in each.variables
        if (variable.storage == OUTPUT and variable.location is not None and not compute)
        or (is_stored(variable) and compute)
    ]


def _shared_members(each: _Found) -> set[str]:
    """Return the members that several blocks of a shader have."""
    names = Counter(
        path
        for variable in each.variables
        if variable.is_block and variable.storage not in (INPUT, OUTPUT)
        for path, *_ in paths(variable.type)
    )
    return {name for name, count in names.items() if count > 1}


def _label(variable: Variable) -> str:
    return variable.name.removeprefix("entryPointParams.") or variable.place


def _array_label(variable: Variable) -> str:
    """Return the name of a variable, or of the array of which it is an element."""
    return _label(variable).removesuffix(f"[{variable.element}]")


def _key(name: str) -> str:
    """Return a key of TOML."""
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else json.dumps(name)
