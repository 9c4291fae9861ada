"""Broken descriptions and shaders: each gives one clear line that names a file and its line.

`broken.txt` has a section for each file that is changed, with rows ``old => new -> error``. The
error begins with ``NAME:LINE: `` or ``LINE: `` where that is not the place of the change; three
dots stand for any text.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import pytest

from tests.custom.broken import DESCRIPTION, OTHERS, SHADERS, write_all, write_one
from tests.custom.front_ends import MAX_FILES, Module, Source, compile_all, read_schema, slang, wgsl
from tests.exhaustive import some
from tests.refusals import assert_matches
from vkbloom import ShaderError, load_method

pytestmark = pytest.mark.usefixtures("glslang")

_ERROR: Final = re.compile(r"(?:(?:([\w.]+):)?(\d+): )?(.*)", re.DOTALL)
GLSL: Final = {"bloom.toml": DESCRIPTION, **SHADERS}


def _unescaped(text: str) -> str:
    return text.replace("\\\\", "\1").replace("\\n", "\n").replace("\\0", "\0").replace("\1", "\\")


def table() -> dict[str, list[Any]]:
    """Return the rows of each file: old text, new text, error."""
    text = Path(__file__).with_name("broken.txt").read_text(encoding="utf-8")
    made: dict[str, list[Any]] = {}
    for section in re.sub(r"\n    -> ", " -> ", text).split("\n# ")[1:]:
        name, *lines = section.splitlines()
        for line in filter(None, lines):
            change, _, error = line.rpartition(" -> ")
            old, _, new = f"{change} ".partition(" => ")
            values = name, _unescaped(old), _unescaped(new.removesuffix(" ")), error
            made.setdefault(name, []).append(pytest.param(*values, id=f"{name} {change}"))
    return made


TABLE: Final = table()


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder for all tests, since the cache of compiled shaders goes by paths."""
    outer = tmp_path_factory.mktemp("broken")
    for name in ("x.glsl", "x.hlsl"):
        (outer / name).write_text("float x;\n")
    folder = outer / "inner"
    write_all(folder)
    for file, text in (("a.glsl", '#include "b.glsl"\n'), ("b.glsl", '#include "a.glsl"\n')):
        (folder / file).write_text(text)
    (folder / "link.glsl").symlink_to(outer / "x.glsl")
    for name in ("folder", "folder.frag"):
        (folder / name).mkdir()
    os.mkfifo(folder / "pipe.frag")
    return folder


def assert_refused(path: Path, default: tuple[str, range], error: str) -> None:
    """Check the error of a description: one line, with a file of its folder and a line of it.

    `default`: The file and the lines that it names, if `error` names no others.
    """
    wanted = _ERROR.fullmatch(error)
    assert wanted is not None
    with pytest.raises((ValueError, ShaderError)) as caught:
        load_method(path, name="broken")
    text = str(caught.value)
    found = re.match(rf"{re.escape(str(path.parent))}/([\w./]+):(\d+): ", text)
    assert found, text
    assert found[1] == (wanted[1] or default[0]), text
    assert int(found[2]) in ([int(wanted[2])] if wanted[2] else default[1]), text
    shown = text[found.end() :].replace(f"{path.parent}/", "")
    cause, _, quoted = shown.partition("\n    ")
    assert "\n" not in quoted
    assert_matches(cause, wanted[3])


def assert_change_is_refused(path: Path, text: str, row: tuple[str, str, str, str]) -> None:
    """Change a file beside a description, and check the description's error."""
    name, old, new, error = row
    assert old in text, old
    first = text[: text.index(old)].count("\n") + 1
    path.with_name(name).write_bytes(text.replace(old, new, 1).encode())
    assert_refused(path, (name, range(first, first + new.count("\n") + 1)), error)


@pytest.mark.parametrize(
    ("name", "old", "new", "error"),
    [row for name in GLSL for row in some(TABLE[name], 400 if name == "bloom.toml" else 20)],
)
def test_a_broken_description_or_shader_is_refused(
    shared: Path, name: str, old: str, new: str, error: str
) -> None:
    """One of GLSL."""
    path = write_all(shared)
    assert_change_is_refused(path, GLSL[name], (name, old, new, error))


@pytest.mark.parametrize(
    ("name", "old", "new", "error"),
    [row for name in OTHERS if name in TABLE for row in some(TABLE[name], 1)],
)
def test_a_broken_shader_of_another_language_is_refused(
    shared: Path, name: str, old: str, new: str, error: str
) -> None:
    path = write_one(shared, name)
    try:
        slang.find_slangc()
        wgsl.identity("wgsl")
    except ShaderError as missing:
        pytest.skip(str(missing))
    assert_change_is_refused(path, OTHERS[name], (name, old, new, error))


def make_large(path: Path) -> None:
    """Make a file of 100 MB, of which the disk has nothing."""
    with path.open("wb") as file:
        file.truncate(100_000_000)


def deny(path: Path) -> Callable[..., bytes]:
    """Return a way to read files that may not read one; the superuser may read all."""
    read = Path.read_bytes

    def read_bytes(self: Path) -> bytes:
        if self.name == path.name:
            raise PermissionError(13, "Permission denied", str(self))
        return read(self)

    return read_bytes


def many_includes(path: Path) -> None:
    """Include more files than are read."""
    path.write_text("".join(f'#include "{n}.glsl"\n' for n in range(MAX_FILES + 2)))


def in_its_place(make: Callable[[Path], None]) -> Callable[[Path], None]:
    """Return a change that makes something in place of a file."""

    def change(path: Path) -> None:
        path.unlink()
        make(path)

    return change


#: What happens to the file copy.frag or another one, and the error.
FILES: Final[dict[str, tuple[str, Callable[[Path], Any], str]]] = {
    "gone": ("copy.frag", Path.unlink, "bloom.toml:17: file: ...No such file or directory"),
    "a folder": (
        "copy.frag",
        in_its_place(Path.mkdir),
        "bloom.toml:17: file: ...Is a directory",
    ),
    "a pipe": (
        "two.comp",
        in_its_place(os.mkfifo),
        "two.comp:1: this is a device or a pipe, not a file",
    ),
    "a device": (
        "copy.frag",
        in_its_place(lambda path: path.symlink_to("/dev/zero")),
        "copy.frag:1: this is a device or a pipe, not a file",
    ),
    "a link to itself": (
        "copy.frag",
        in_its_place(lambda path: path.symlink_to(path)),
        "bloom.toml:17: file: ...Too many levels of symbolic links",
    ),
    "100 MB": ("copy.frag", make_large, "copy.frag:1: 100000000 bytes are more than ..."),
    "100 MB of a description": (
        "bloom.toml",
        make_large,
        "bloom.toml:1: 100000000 bytes are more than ...",
    ),
    "2 MB of a description": (
        "bloom.toml",
        lambda path: path.write_text("#" * (2 << 20)),
        "1: 2097152 characters are more than 1048576",
    ),
    "a description of no text": (
        "bloom.toml",
        lambda path: path.write_bytes(b'bloom = "out"\n\xff\xfe'),
        "2: byte 0xff is not UTF-8; ...",
    ),
    "a description with a null character": (
        "bloom.toml",
        lambda path: path.write_bytes(b'bloom = "out"\n\0'),
        "2: the line has a null character",
    ),
    "an empty description": (
        "bloom.toml",
        lambda path: path.write_text(""),
        "1: passes: the description has none; a pass begins with [[passes]]",
    ),
    "UTF-16": (
        "copy.frag",
        lambda path: path.write_bytes(path.read_text().encode("utf-16")),
        "copy.frag:1: the line has a null character; this is no text",
    ),
    "empty": ("copy.frag", lambda path: path.write_text(""), "copy.frag:1: ...void main()..."),
    "no output": (
        "copy.frag",
        lambda path: path.write_text("#version 450\nvoid main() {}\n"),
        "bloom.toml:17: output: the shader writes no image",
    ),
    "passes that are no list": (
        "bloom.toml",
        lambda path: path.write_text("bloom = 1\npasses = 1\n"),
        "2: passes: 1 is not a list",
    ),
    "an image of three dimensions": (
        "copy.frag",
        lambda path: path.write_text(
            SHADERS["copy.frag"].replace("sampler2D", "sampler3D").replace(", uv)", ", uv.xyx)")
        ),
        "bloom.toml:17: textures: 'image' (0.0) is no texture of two dimensions with floats",
    ),
    "many includes": ("copy.frag", many_includes, "copy.frag:2002: more than 2000 includes ..."),
    "remarks without an end": (
        "copy.frag",
        lambda path: path.write_text("/*" * (1 << 20)),
        "copy.frag:1: ...",
    ),
    "nested brackets": (
        "copy.frag",
        lambda path: path.write_text(f"void main() {{ int a = {'(' * 100_000}1; }}\n"),
        "copy.frag:1: ...",
    ),
    "a long list of blanks": (
        "bloom.toml",
        lambda path: path.write_text(f"a = [\n[{' ' * 100_000}]\n]\n"),
        "bloom.toml:1: passes: the description has none...",
    ),
    "numbers of many digits": (
        "bloom.toml",
        lambda path: path.write_text(f"a = 1\nb = {'9' * 5000}\n"),
        "...this is not TOML: Exceeds the limit (4300 digits)...",
    ),
    "a hexadecimal number of many digits": (
        "bloom.toml",
        lambda path: path.write_text(f"bloom = 0x{'f' * 5000}\n[[passes]]\nfile=1"),
        "3: file: 1 is not a text",
    ),
    "tables in tables": (
        "bloom.toml",
        lambda path: path.write_text("a = " + "[" * 5000),
        "1: the file nests its lists too deeply",
    ),
}


@pytest.mark.parametrize("case", FILES)
def test_a_broken_file_is_refused(shared: Path, case: str) -> None:
    name, change, error = FILES[case]
    path = write_all(shared)
    change(path.with_name(name))
    assert_refused(path, ("bloom.toml", range(1, 1000)), error)


def test_a_file_that_may_not_be_read(shared: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_all(shared)
    monkeypatch.setattr(Path, "read_bytes", deny(path.with_name("two.comp")))
    assert_refused(path, ("bloom.toml", range(27, 28)), "file: ...Permission denied")
    path.with_name("copy.frag").write_text('#version 450\n#include "two.comp"\n')
    error = "'two.comp': Permission denied"
    assert_refused(path, ("copy.frag", range(2, 3)), error)


@pytest.mark.parametrize(
    "change",
    [
        lambda data: data.replace(b"\n", b"\r\n"),
        lambda data: b"\xef\xbb\xbf" + data,
        lambda data: data + b"# \xc3\xbc\n",
    ],
    ids=["CRLF", "BOM", "a letter"],
)
def test_what_editors_write_is_read(shared: Path, change: Callable[[bytes], bytes]) -> None:
    path = write_all(shared)
    path.write_bytes(change(path.read_bytes()))
    for name in ("copy.frag", "split.frag"):
        file = path.with_name(name)
        data = change(file.read_bytes()).replace(b"# \xc3\xbc", b"// \xfc")
        file.write_bytes(data)
    load_method(path, name="unbroken")


def spirv(shared: Path) -> bytes:
    """Return the SPIR-V of copy.frag."""
    path = write_all(shared)
    programs, _ = compile_all(read_schema(Source(str(path), path.read_text())), shared)
    return next(iter(programs.values())).code


@pytest.mark.parametrize(
    "change",
    [
        lambda code: b"",
        lambda code: code[:10],
        lambda code: code[:-6],
        lambda code: code[:200],
        lambda code: b"\1\2\3\4" + code[4:],
        lambda code: code[:20] + b"\0\0\0\0" + code[24:],
        lambda code: code[:20] + b"\xff\xff\xff\xff" + code[24:],
        lambda code: code[:12] + b"\xff\xff\xff\x7f" + code[16:],
        lambda code: code + b"\0" * (4 << 20),
    ],
    ids=[
        *("empty", "short", "not whole words", "cut", "magic", "length 0", "long", "bound", "5 MB"),
    ],
)
def test_broken_spirv_is_refused(shared: Path, change: Callable[[bytes], bytes]) -> None:
    """By spirv-val where it is; by the reader of modules in any case."""
    code = change(spirv(shared))
    (shared / "copy.spv").write_bytes(code)
    path = shared / "bloom.toml"
    path.write_text(DESCRIPTION.replace("copy.frag", "copy.spv"))
    with pytest.raises((ValueError, ShaderError)) as caught:
        load_method(path, name="broken")
    if "pip install" not in str(caught.value):
        assert re.match(rf"{shared}/(copy\.spv:1|bloom\.toml:17): ", str(caught.value))
    with pytest.raises(ValueError, match=r"SPIR-V|ids are more"):
        Module(code)


def test_spirv_of_the_other_order_of_bytes(shared: Path) -> None:
    """It is the same module."""
    code = spirv(shared)
    other = b"".join(code[at : at + 4][::-1] for at in range(0, len(code), 4))
    assert Module(other).words == Module(code).words


def test_there_are_three_hundred() -> None:
    assert sum(map(len, TABLE.values())) + len(FILES) > 300
