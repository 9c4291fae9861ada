"""WGSL by naga, of the package wgpu; WESL by wesl-py, which makes WGSL of it."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import json
import os
import re
import struct
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

from vkbloom import _core
from vkbloom._core import ShaderError
from vkbloom._custom.compiler import run_limited, was_ended
from vkbloom._custom.described.files import (
    MAX_BYTES,
    MAX_FILES,
    Files,
    read_text,
    without_remarks,
)
from vkbloom._custom.described.lowering import with_y_down
from vkbloom._custom.described.module import BINDING, DECORATE, SET, Module, ModuleFault
from vkbloom._custom.described.schema import Shader
from vkbloom._custom.source import Source
from vkbloom._custom.spirv import HEADER_WORDS

MISSING: Final = "WGSL needs naga: pip install vkbloom[wgsl] (wgpu, 4 MB)"
MISSING_WESL: Final = (
    "WESL needs wesl-py: pip install vkbloom[wgsl] with Python 3.12 or later (this is {}.{}), or "
    "set VKBLOOM_WESL_PYTHON to a Python that has it; or give the WGSL that it becomes"
)
#: Files of a folder from which WESL imports, of any kind.
MAX_VISITED: Final = 20000
#: Virtual memory, of which a driver and a compiler reserve more than they use.
MAX_MEMORY: Final = 16 << 30

_VARIABLE: Final = re.compile(
    r"@group\s*\(\s*(\d+)u?\s*\)\s*@binding\s*\(\s*(\d+)u?\s*\)"
    r"\s*var\s*(<[^<>]*>)?\s*(\w+)\s*:\s*([\w<>, ]+?)\s*;"
)
_STRUCT: Final = re.compile(r"\bstruct\s+(\w+)\s*\{([^{}]*)\}")
_MEMBER: Final = re.compile(r"(?:@\w+\s*+(?:\([^()]*\)\s*+)?)*+(\w+)\s*:\s*([^,;]+(?:<[^>]*>)?)")
_LOCATION: Final = re.compile(r"@location\s*+\(\s*+(\d+)u?\s*+\)")
_INTERPOLATE: Final = re.compile(r"@interpolate\s*+\(\s*+([^()]*?)\s*\)")
_ENTRY: Final = re.compile(
    r"@(vertex|fragment|compute)\b(?:[^{}@]|@(?!vertex\b|fragment\b|compute\b))*?\bfn\s++(\w++)\s*+"
    r"\(((?:[^()]|\([^()]*+\))*+)\)\s*+(?:->\s*+([^{]*+))?\{"
)
_MESSAGE_LINE: Final = re.compile(r"┌─ (?:wgsl)?:(\d+):\d+")
#: What is wrong with a part of a module, below what has that part.
_NOTE: Final = re.compile(r"^\s*= (.+)$", re.MULTILINE)


def collect(path: Path, dependencies: Sequence[Path]) -> Files:
    """Read a file; of WESL, all files that it may import: of its folder and of dependencies."""
    main = read_text(path.absolute())
    if path.suffix != ".wesl" and "import " not in main.text:
        return Files(main, (), ())
    line = main.text.count("\n", 0, max(main.text.find("import "), 0)) + 1
    found: dict[Path, Source] = {}
    outside: list[Path] = []
    total = 0
    for folder in (path.absolute().parent, *dependencies):
        for each in _sources_in(folder, main, line):
            if not each.resolve().is_relative_to(folder.resolve()):
                outside.append(each)
            elif each.resolve() != path.resolve():
                found[each] = read_text(each)
                total += len(found[each].text)
            if len(found) > MAX_FILES or total > MAX_BYTES:
                raise main.fault(line, f"{folder} has too many files to import from")
    for each in outside:
        named = re.compile(rf"\b{re.escape(each.stem)}\b")
        for source in (main, *found.values()):
            if match := named.search(source.text):
                line = source.text.count("\n", 0, match.start()) + 1
                raise source.fault(line, f"{str(each)!r} leads out of its folder")
    return Files(main, (), tuple(found.values()))


def _sources_in(folder: Path, main: Source, line: int) -> Iterator[Path]:
    """Return the files of a folder and those within it, in order; without end it is refused."""
    count = 0
    for root, folders, names in os.walk(folder):
        folders.sort()
        count += 1 + len(names)
        if count > MAX_VISITED:
            raise main.fault(line, f"{folder} has too many files to import from")
        for name in sorted(names):
            each = Path(root) / name
            if each.suffix in (".wesl", ".wgsl") and each.is_file():
                yield each


def identity(language: str) -> bytes:
    """Return bytes that differ between compilers; ShaderError without one."""
    if importlib.util.find_spec("wgpu") is None:
        raise ShaderError(MISSING)
    versions = [importlib.metadata.version("wgpu"), _core.__file__]
    if language == "wesl":
        versions.append(find_wesl())
    return repr(versions).encode()


def compile_wgsl(
    shader: Shader, files: Files, dependencies: Mapping[str, Path]
) -> tuple[bytes, bytes | None, str, tuple[tuple[str, str], ...]]:
    """Return the SPIR-V of an entry point, that of its vertex shader, its stage, and the names.

    The names are those of what it binds.
    """
    text = files.main.text
    if shader.language == "wesl":
        text = _from_wesl(shader, files, dependencies)
    text = _with_defines(text, shader)
    plain = without_remarks(text)
    stage, entry, inputs, outputs = _interface(shader, files, plain)
    asked = {
        "code": text,
        "entry": entry,
        "stage": stage,
        "inputs": inputs,
        "outputs": outputs,
        "constants": dict(shader.constants),
    }
    wanted, parts = [(entry, stage)], [(plain, _words_of(plain, entry))]
    if shader.vertex is not None:
        asked["vertex_code"], asked["vertex"] = _find_vertex(shader, files, text, stage)
        other = without_remarks(str(asked["vertex_code"]))
        wanted.append((str(asked["vertex"]), "vertex"))
        parts.append((other, _words_of(other, str(asked["vertex"]))))
    made = _run(files, asked, wanted, translated=shader.language == "wesl")
    used: dict[int, set[int]] = {}
    for part, words in parts:
        for group, binding, _, name, _ in _VARIABLE.findall(part):
            if name in words:
                used.setdefault(int(group), set()).add(int(binding))
    code, *vertex = _with_bindings(
        files, made, {group: sorted(each) for group, each in used.items()}
    )
    # WebGPU has y upwards, and Vulkan downwards.
    flipped = with_y_down(vertex[0]) if vertex else None
    names = dict(each for part, words in parts for each in _names(part, words))
    return code, flipped, stage, tuple(names.items())


def _with_defines(text: str, shader: Shader) -> str:
    """Return WGSL with what engines put into it before they compile it."""
    for name, value in shader.defines:
        text = text.replace(f"##{name}##", value).replace(f"{{{name}}}", value)
    return text


def _find_vertex(shader: Shader, files: Files, text: str, stage: str) -> tuple[str, str]:
    """Return the text that has the vertex shader of a fragment shader, and its entry point."""
    if stage != "fragment":
        raise files.fault("", 1, "vertex: a compute shader has none")
    name, source = str(shader.vertex), files.main
    if vertex_file(shader) is not None:
        source = next(each for each in files.others if Path(each.name).name == Path(name).name)
        text, name = _with_defines(source.text, shader), ""
    known = re.findall(r"@vertex\b[^{}]*?\bfn\s+(\w+)", without_remarks(text))
    if name not in (known if name or len(known) != 1 else ("",)):
        cause = f"vertex: {name!r} is not one" if name else "vertex: there is not just one"
        listed = ", ".join(known) or "none"
        raise files.fault(source.name, 1, f"{cause} of the file's: {listed}")
    return text, name or known[0]


def vertex_file(shader: Shader) -> str | None:
    """Return the file of a vertex shader that is not in that of the fragment shader."""
    own = shader.language == "glsl" or str(shader.vertex).endswith(".wgsl")
    return shader.vertex if own else None


def _words_of(text: str, entry: str) -> set[str]:
    """Return the words in an entry point, and in the functions that it calls."""
    bodies = {}
    for match in re.finditer(r"\bfn\s+(\w+)\s*\(", text):
        bodies[match[1]] = set(re.findall(r"[A-Za-z_]\w*", _body(text, match.end())))
    words: set[str] = set()
    waiting = [entry]
    while waiting:
        found = bodies.pop(waiting.pop(), set())
        words |= found
        waiting += found & bodies.keys()
    return words


def _body(text: str, start: int) -> str:
    """Return the text from a position to the end of the braces that follow it."""
    at = text.find("{", start)
    depth = 0
    for end in range(max(at, start), len(text)):
        depth += {"{": 1, "}": -1}.get(text[end], 0)
        if depth == 0 and end > at >= 0:
            return text[at:end]
    return text[start:]


def _with_bindings(files: Files, codes: list[bytes], used: Mapping[int, list[int]]) -> list[bytes]:
    """Return the modules of a pipeline with the bindings of the source: wgpu numbers them."""
    modules = [Module(code) for code in codes]
    places = [
        {
            identity: (marks[SET], marks[BINDING])
            for identity, marks in module.decorations.items()
            if SET in marks and BINDING in marks
        }
        for module in modules
    ]
    all_places = {place for each in places for place in each.values()}
    changed = {}
    for group in {place[0] for place in all_places}:
        found = sorted({place[1] for place in all_places if place[0] == group})
        wanted = used.get(group, [])
        if len(found) != len(wanted):
            raise files.fault("", 1, f"naga binds {len(found)} of group {group}, not {len(wanted)}")
        changed.update({(group, a): b for a, b in zip(found, wanted, strict=True)})
    return [
        _renumber(module, {key: changed[place] for key, place in each.items()})
        for module, each in zip(modules, places, strict=True)
    ]


def _renumber(module: Module, bindings: Mapping[int, int]) -> bytes:
    words = list(module.words)
    position = HEADER_WORDS
    for word in module.instructions:
        if word[0] == 4 << 16 | DECORATE and word[2] == BINDING and word[1] in bindings:
            words[position + 3] = bindings[word[1]]
        position += len(word)
    return struct.pack(f"={len(words)}I", *words)


def _interface(
    shader: Shader, files: Files, text: str
) -> tuple[str, str, list[tuple[str, str, str]], int]:
    """Return stage and name of the entry point, its inputs, and the number of its outputs."""
    found = [
        (match[1], match[2], match[3], match[4] or "")
        for match in re.finditer(
            _ENTRY,
            text,
        )
        if match[1] != "vertex"
    ]
    wanted = [
        each
        for each in found
        if shader.entry in (None, each[1]) and shader.stage in (None, each[0])
    ]
    if len(wanted) != 1:
        known = ", ".join(f"{each[1]} ({each[0]})" for each in found) or "none"
        cause = f"entry: {shader.entry!r} is not one" if shader.entry else "entry: give one"
        raise files.fault("", 1, f"{cause} of the file's entry points: {known}")
    stage, entry, given, returned = wanted[0]
    structs = {match[1]: match[2] for match in _STRUCT.finditer(text)}
    inputs = list(_locations(given, structs))
    outputs = len(
        list(
            _locations(
                f"x: {returned}" if "@" not in returned else returned.replace(")", ") x:", 1),
                structs,
            )
        )
    )
    return stage, entry, inputs, outputs


def _locations(text: str, structs: Mapping[str, str]) -> Iterator[tuple[str, str, str]]:
    """Return location, interpolation and type of parameters, or of members of their types."""
    for part in re.split(r",(?![^<(]*[>)])", text):
        name, _, kind = part.rpartition(":")
        kind = kind.strip()
        if match := _LOCATION.search(name):
            how = _INTERPOLATE.search(name)
            yield match[1], how[1] if how else "", kind
        elif kind in structs:
            yield from _locations(structs[kind], {})


def _names(text: str, words: set[str]) -> Iterator[tuple[str, str]]:
    """Return names by place, of what an entry point uses: naga's modules have none."""
    structs = {
        match[1]: [(each[1], each[2].strip()) for each in _MEMBER.finditer(match[2])]
        for match in _STRUCT.finditer(text)
    }
    for group, binding, space, name, kind in _VARIABLE.findall(text):
        if name not in words:
            continue
        place = f"{group}.{binding}"
        yield place, name
        if not space:
            continue
        # Naga puts what is bound into a structure, unless that ends with an array of any length.
        members = structs.get(kind.strip())
        last = members[-1][1] if members else ""
        if not (last.startswith("array") and "," not in last):
            yield f"{place}.0", "*"
            place += ".0"
        yield from _member_names(place, members or [], structs, 0)


def _member_names(
    place: str,
    members: list[tuple[str, str]],
    structs: Mapping[str, list[tuple[str, str]]],
    depth: int,
) -> Iterator[tuple[str, str]]:
    for number, (name, kind) in enumerate(members):
        yield f"{place}.{number}", name
        if kind in structs and depth < 8:
            yield from _member_names(f"{place}.{number}", structs[kind], structs, depth + 1)


def _run(
    files: Files, asked: dict[str, object], wanted: list[tuple[str, str]], *, translated: bool
) -> list[bytes]:
    """Compile in a process of its own; return the modules of entry points, given with stages."""
    with tempfile.TemporaryDirectory(prefix="vkbloom") as folder:
        layer = {
            "name": "VK_LAYER_VKBLOOM_modules",
            "type": "GLOBAL",
            "library_path": _core.__file__,
            "api_version": "1.3.0",
            "implementation_version": "1",
            "description": "Writes shader modules to files",
        }
        manifest = {"file_format_version": "1.2.0", "layer": layer}
        (Path(folder) / "layer.json").write_text(json.dumps(manifest))
        environment = {
            "VK_LAYER_PATH": folder,
            "VK_INSTANCE_LAYERS": layer["name"],
            "VKBLOOM_MODULES": folder,
            "WGPU_BACKEND_TYPE": "Vulkan",
            "MESA_SHADER_CACHE_DISABLE": "1",
        }
        script = str(Path(__file__).with_name("naga.py"))
        command = [sys.executable, "-I", script]
        text = json.dumps(asked)
        status, output = run_limited(command, text, folder, environment, MAX_MEMORY)
        if status:
            raise _explain(files, status, output, translated=translated)
        order = sorted(Path(folder).glob("*.spv"), key=lambda each: -int(each.stem))
        made = [file.read_bytes() for file in order]
    found = [
        next((code for code in made if _has_entry(code, name, stage)), None)
        for name, stage in wanted
    ]
    codes = [code for code in found if code is not None]
    if len(codes) < len(found):
        raise files.fault("", 1, "naga gave no SPIR-V; is the Vulkan loader installed?")
    return codes


def _has_entry(code: bytes, name: str, stage: str) -> bool:
    try:
        entries = Module(code).entries
    except ModuleFault:
        return False
    return any(each.name == name and each.stage == stage for each in entries)


def _explain(files: Files, status: int, output: str, *, translated: bool) -> ShaderError:
    if ended := was_ended(status):
        return files.fault("", 1, ended)
    text = output.partition("VKBLOOM-ERROR\n")[2] or output
    match = _MESSAGE_LINE.search(text)
    lines = [line.strip(" │─┌└\t") for line in text.split("\n")]
    causes = [line for line in lines if line and "wgsl:" not in line and not line[0].isdigit()]
    named = [line.partition("error:")[2].strip() for line in lines if "error:" in line]
    cause = (named or causes or ["no message"])[-1 if named else 0]
    if cause.endswith("is invalid") and (notes := _NOTE.findall(text)):
        cause += f": {notes[-1].strip()}"
    if "adapter" in cause.lower() and match is None:
        cause = f"naga finds no Vulkan driver: {cause}"
    if match is None or translated:
        return files.fault("", _line_of_word(files, cause), cause)
    return files.fault("", int(match[1]), cause)


def _from_wesl(shader: Shader, files: Files, dependencies: Mapping[str, Path]) -> str:
    """Return WGSL, which a process of its own makes of WESL."""
    asked = {
        "file": files.main.name,
        "features": dict(shader.features),
        "dependencies": {name: str(folder) for name, folder in dependencies.items()},
    }
    with tempfile.TemporaryDirectory(prefix="vkbloom") as folder:
        script = str(Path(__file__).with_name("wesl_child.py"))
        command = [find_wesl(), "-I", script]
        status, output = run_limited(command, json.dumps(asked), folder)
    if not status:
        return output
    if ended := was_ended(status):
        raise files.fault("", 1, ended)
    name, line, cause = (*output.partition("VKBLOOM-ERROR\n")[2].split("\n", 2), "", "")[:3]
    cause = cause.strip().split("\n")[0] or "wesl-py failed"
    raise files.fault(name, int(line) if line > "1" else _line_of_word(files, cause), cause)


def _line_of_word(files: Files, cause: str) -> int:
    """Return the first line that has a word of a message without a place; 1 if there is none."""
    text = files.main.text
    word = re.search(r"`(\w+)`", cause)
    at = re.search(rf"\b{word[1]}\b", text) if word else None
    return text.count("\n", 0, at.start()) + 1 if at else 1


def find_wesl() -> str:
    """Return the Python that has wesl-py: this one, or that of VKBLOOM_WESL_PYTHON."""
    if given := os.environ.get("VKBLOOM_WESL_PYTHON"):
        return given
    if importlib.util.find_spec("wesl") is None:
        raise ShaderError(MISSING_WESL.format(*sys.version_info[:2]))
    return sys.executable
