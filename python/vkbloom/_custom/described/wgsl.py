"""WGSL by naga, of the package wgpu; WESL by wesl-py, which makes WGSL of it."""

from __future__ import annotations

import dataclasses
import importlib.metadata
import importlib.util
import json
import os
import re
import shutil
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
    "WESL needs wesl-py: pip install vkbloom[wgsl] (6 MB) with Python 3.12 or later (this is "
    "{}.{}), or set VKBLOOM_WESL_PYTHON to a Python that has it; or give the WGSL that it becomes"
)
NO_DRIVER: Final = (
    "WGSL needs the Vulkan loader and a driver, which naga asks for; on Debian or Ubuntu: apt "
    "install libvulkan1 mesa-vulkan-drivers"
)
#: Files of a folder from which WESL imports, of any kind.
MAX_VISITED: Final = 20000
#: Virtual memory, of which a driver and a compiler reserve more than they use.
MAX_MEMORY: Final = 16 << 30
#: Of a file: Mesa 25 has the memory of its CPU device in one, in memory, and ends with SIGBUS where
#: a process may not have 64 MiB of it.
MAX_FILE: Final = 1 << 30
#: Entry points that one process compiles: its bounds are those of all of them.
MAX_TOGETHER: Final = 16

_VARIABLE: Final = re.compile(
    r"@(group|binding)\s*\(\s*(\d+)u?\s*\)\s*@(?:group|binding)\s*\(\s*(\d+)u?\s*\)"
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
_DECLARED: Final = re.compile(r"\bvar\s*+(?:<[^<>]*+>)?+\s*+(\w+)\s*+:")
#: What WESL's module of constants can have.
_NUMBER: Final = re.compile(r"-?\d[\w.]*|true|false")
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
    # What says that another Python is needed comes first.
    wesl = find_wesl() if language == "wesl" else ""
    if importlib.util.find_spec("wgpu") is None:
        raise ShaderError(MISSING)
    return repr((importlib.metadata.version("wgpu"), _core.__file__, wesl)).encode()


@dataclasses.dataclass(frozen=True)
class Compiled:
    """The SPIR-V of an entry point, that of its vertex shader, and the names of what it binds."""

    code: bytes
    vertex: bytes | None
    stage: str
    names: tuple[tuple[str, str], ...]


@dataclasses.dataclass(frozen=True)
class _Request:
    """A pipeline that naga is asked for.

    - `wanted`: Its entry points, with their stages.
    - `parts`: The text of each, and the words that it uses.
    """

    files: Files
    asked: dict[str, object]
    wanted: list[tuple[str, str]]
    parts: list[tuple[str, set[str]]]
    translated: bool


def compile_wgsl(shaders: Sequence[tuple[Shader, Files]]) -> list[Compiled]:
    """Compile entry points, with as few processes as there can be.

    To start one takes several times as long as to compile a shader in it.
    """
    texts = [files.main.text for _, files in shaders]
    from_wesl = [number for number, (shader, _) in enumerate(shaders) if shader.language == "wesl"]
    for number, text in zip(from_wesl, _from_wesl([shaders[n] for n in from_wesl]), strict=True):
        texts[number] = text
    requests = [
        _request(shader, files, _with_defines(text, shader))
        for (shader, files), text in zip(shaders, texts, strict=True)
    ]
    made = []
    for first in range(0, len(requests), MAX_TOGETHER):
        made += _run(requests[first : first + MAX_TOGETHER])
    return [_finish(request, codes) for request, codes in zip(requests, made, strict=True)]


def _request(shader: Shader, files: Files, text: str) -> _Request:
    plain = without_remarks(text)
    stage, entry, inputs, outputs = _interface(shader, files, plain)
    if stage == "fragment" and not outputs:
        raise files.fault("", 1, f"entry: {entry!r} writes no colour")
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
    return _Request(files, asked, wanted, parts, translated=shader.language == "wesl")


def _finish(request: _Request, made: list[bytes]) -> Compiled:
    """Return the modules of a pipeline with the bindings and the names of the source."""
    used: dict[int, set[int]] = {}
    for part, words in request.parts:
        for group, binding, _, name, _ in _variables(part):
            if name in words:
                used.setdefault(group, set()).add(binding)
    code, *vertex = _with_bindings(
        request.files, made, {group: sorted(each) for group, each in used.items()}
    )
    # WebGPU has y upwards, and Vulkan downwards.
    flipped = with_y_down(vertex[0]) if vertex else None
    names = dict(each for part, words in request.parts for each in _names(part, words))
    if request.translated:
        known = {name for text in request.files.texts for name in _DECLARED.findall(text)}
        names = {place: _without_module(name, known) for place, name in names.items()}
    return Compiled(code, flipped, request.wanted[0][1], tuple(names.items()))


def _without_module(name: str, known: set[str]) -> str:
    """Return the name that WESL's source has for one that wesl-py has put its module before.

    It is that of the modules and its own, each with an underscore, and the number of its
    underscores if it has any.
    """
    made = (each for each in known if name.endswith(f"_{each.count('_') or ''}{each}"))
    return max(made, key=len, default=name)


def _variables(text: str) -> Iterator[tuple[int, int, str, str, str]]:
    """Return group, binding, address space, name and type of what a text binds."""
    for first, *numbers, space, name, kind in _VARIABLE.findall(text):
        group, binding = numbers if first == "group" else numbers[::-1]
        yield int(group), int(binding), space, name, kind


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
    for group, binding, space, name, kind in _variables(text):
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


def _run(requests: Sequence[_Request]) -> list[list[bytes]]:
    """Compile in a process of its own; return the modules of the entry points of each request."""
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
            "WGPU_BACKEND_TYPE": "Vulkan",
            "MESA_SHADER_CACHE_DISABLE": "1",
            **_bundled_driver(),
        }
        script = str(Path(__file__).with_name("naga.py"))
        command = [sys.executable, "-I", script]
        text = json.dumps({"folder": folder, "requests": [each.asked for each in requests]})
        status, output = run_limited(
            command, text, folder, environment, memory=MAX_MEMORY, file=MAX_FILE
        )
        # The child makes a folder for each request before it begins with it.
        begun = sum(each.is_dir() for each in Path(folder).iterdir())
        if status:
            raise _explain(requests[max(begun, 1) - 1], status, output)
        return [
            _modules_of(each, Path(folder) / str(number)) for number, each in enumerate(requests)
        ]


def _bundled_driver() -> dict[str, str]:
    """Return what makes the driver of the package ``vkbloom-lavapipe`` that of a process."""
    try:
        import vkbloom_lavapipe  # noqa: PLC0415  where it is installed
    except ModuleNotFoundError:
        return {}
    found: dict[str, str] = vkbloom_lavapipe.environment()
    # Its own loader, for systems without one, has no layers.
    return found if "LD_LIBRARY_PATH" not in found else {}


def _modules_of(request: _Request, folder: Path) -> list[bytes]:
    made = [file.read_bytes() for file in folder.glob("*.spv")]
    found = [
        next((code for code in made if _has_entry(code, name, stage)), None)
        for name, stage in request.wanted
    ]
    codes = [code for code in found if code is not None]
    if len(codes) < len(found):
        raise request.files.fault("", 1, "naga gave no SPIR-V; does the Vulkan loader have layers?")
    return codes


def _has_entry(code: bytes, name: str, stage: str) -> bool:
    try:
        entries = Module(code).entries
    except ModuleFault:
        return False
    return any(each.name == name and each.stage == stage for each in entries)


def _explain(request: _Request, status: int, output: str) -> ShaderError:
    files = request.files
    if ended := was_ended(status):
        return files.fault("", 1, ended)
    text = output.partition("VKBLOOM-ERROR\n")[2] or output
    match = _MESSAGE_LINE.search(text)
    lines = [line.strip(" │─┌└\t") for line in text.split("\n")]
    causes = [line for line in lines if line and "wgsl:" not in line and not line[0].isdigit()]
    named = [line.partition("error:")[2].strip() for line in lines if "error:" in line]
    cause = (named or causes or ["no message"])[-1 if named else 0]
    if cause == "Validation Error":  # what it is about is said last
        cause = causes[-1]
    if cause.endswith("is invalid") and (notes := _NOTE.findall(text)):
        cause += f": {notes[-1].strip()}"
    if "adapter" in cause.lower() and match is None:
        return ShaderError(NO_DRIVER)
    if match is None or request.translated:
        return files.fault("", _line_of_word(files, cause), cause)
    return files.fault("", int(match[1]), cause)


def _from_wesl(shaders: Sequence[tuple[Shader, Files]]) -> list[str]:
    """Return the WGSL that a process of its own makes of WESL."""
    if not shaders:
        return []
    asked = [
        {
            "file": os.path.realpath(files.main.name),
            "text": _with_defines(files.main.text, shader),
            "features": dict(shader.features),
            "constants": {
                name: value for name, value in shader.defines if _NUMBER.fullmatch(value)
            },
            "dependencies": dict(shader.dependencies),
        }
        for shader, files in shaders
    ]
    with tempfile.TemporaryDirectory(prefix="vkbloom") as folder:
        script = str(Path(__file__).with_name("wesl_child.py"))
        command = [find_wesl(), "-I", script]
        status, output = run_limited(command, json.dumps(asked), folder)
    made = [json.loads(line) for line in output.split("\n") if line.startswith('"')]
    if not status and len(made) == len(shaders):
        return made
    files = shaders[min(len(made), len(shaders) - 1)][1]
    if ended := was_ended(status):
        raise files.fault("", 1, ended)
    if "No module named 'wesl'" in output:
        raise ShaderError(f"{find_wesl()} has no wesl-py: {find_wesl()} -m pip install wesl-py")
    name, line, cause = (*output.partition("VKBLOOM-ERROR\n")[2].split("\n", 2), "", "")[:3]
    cause = cause.strip().split("\n")[0] or "wesl-py failed"
    raise files.fault(name, int(line) if line > "1" else _line_of_word(files, cause), cause)


def _line_of_word(files: Files, cause: str) -> int:
    """Return the first line that has a word of a message without a place; 1 if there is none."""
    text = files.main.text
    word = re.search(r"[`'](\w+)[`']", cause)
    at = re.search(rf"\b{word[1]}\b", text) if word else None
    return text.count("\n", 0, at.start()) + 1 if at else 1


def find_wesl() -> str:
    """Return the Python that has wesl-py: this one, or that of VKBLOOM_WESL_PYTHON."""
    if given := os.environ.get("VKBLOOM_WESL_PYTHON"):
        if shutil.which(given) is None:
            raise ShaderError(f"VKBLOOM_WESL_PYTHON: {given!r} is not a program")
        return given
    if importlib.util.find_spec("wesl") is None:
        raise ShaderError(MISSING_WESL.format(*sys.version_info[:2]))
    return sys.executable
