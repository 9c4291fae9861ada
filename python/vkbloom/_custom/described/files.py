"""The files of a shader: its text, and what it includes from folders that it may read."""

from __future__ import annotations

import dataclasses
import hashlib
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from vkbloom._core import ShaderError
from vkbloom._custom.source import Source

#: Of one file, of all files of a shader, and their number.
MAX_FILE_BYTES: Final = 4 << 20
MAX_BYTES: Final = 32 << 20
MAX_FILES: Final = 2000

_INCLUDE: Final = re.compile(
    r"^[ \t]*#[ \t]*include(?:_with_pragmas)?\b[ \t]*([^\n]*)$"
    r"|^[ \t]*(?:__exported[ \t]+)?(?:import|__include)[ \t]+([^;\n]+);",
    re.MULTILINE,
)
_QUOTED: Final = re.compile(r'"([^"\n]+)"|<([^>\n]+)>')
_REMARK: Final = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)


@dataclasses.dataclass(frozen=True)
class Files:
    """The files of a shader. `folders`: where includes are searched."""

    main: Source
    folders: tuple[Path, ...]
    others: tuple[Source, ...]

    @property
    def digest(self) -> bytes:
        """A hash of all content."""
        known = hashlib.sha256()
        for each in (self.main, *self.others):
            known.update(f"{each.name}\0{len(each.text)}\0".encode())
            known.update(each.text.encode("utf-8", "surrogateescape"))
        return known.digest()

    @property
    def texts(self) -> tuple[str, ...]:
        """The texts of all files."""
        return tuple(each.text for each in (self.main, *self.others))

    @property
    def paths(self) -> tuple[str, ...]:
        """The paths of all files."""
        return tuple(each.name for each in (self.main, *self.others))

    def fault(self, name: str, line: int, cause: str) -> ShaderError:
        """Return the error of a line of one of the files."""
        for each in (self.main, *self.others):
            if name in (each.name, ""):
                last = each.text.count("\n") + 1
                return ShaderError(each.where(min(max(line, 1), last), cause))
        return ShaderError(f"{name}:{line}: {cause}")


def read_text(path: Path) -> Source:
    """Read a file of source text; raise OSError or ValueError that names it."""
    size = path.stat().st_size
    if size > MAX_FILE_BYTES:
        raise ValueError(f"{path}:1: {size} bytes are more than {MAX_FILE_BYTES}, for one shader")
    data = path.read_bytes().replace(b"\r\n", b"\n")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        # Remarks in files of others are in any encoding.
        text = data.decode("latin-1")
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise ValueError(f"{path}:{line}: the line has a null character; this is no text")
    return Source(str(path), text)


def collect(path: Path, folders: tuple[Path, ...], home: Path) -> Files:
    """Read a file and what it includes.

    Includes come from the file's own folder, from that of the description, or from the folders that
    it names; ShaderError with file and line if a file is elsewhere.
    """
    main = read_text(path)
    roots = [each.resolve() for each in (path.parent, home, *folders)]
    found: dict[Path, Source] = {path.resolve(): main}
    waiting = [main]
    total = len(main.text)
    for each in waiting:
        for line, name in includes(each):
            target = _find(Path(each.name).parent, name, folders)
            if target is None:
                continue
            real = target.resolve()
            if not any(real.is_relative_to(root) for root in roots):
                raise ShaderError(
                    each.where(
                        line,
                        f"{name!r} lies outside of the shader's folder; name its folder in "
                        'include = ["FOLDER"] of the description',
                    )
                )
            if real in found:
                continue
            made = read_text(target)
            found[real] = made
            waiting.append(made)
            total += len(made.text)
            if len(found) > MAX_FILES or total > MAX_BYTES:
                raise ShaderError(each.where(line, f"{len(found)} included files are too many"))
    return Files(main, folders, tuple(waiting[1:]))


def includes(source: Source) -> Iterator[tuple[int, str]]:
    """Return line and path of each include; ShaderError if one is no path."""
    text = _REMARK.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), source.text)
    for match in _INCLUDE.finditer(text):
        line = text.count("\n", 0, match.start()) + 1
        what = (match[1] or match[2] or "").strip()
        quoted = _QUOTED.match(what)
        if quoted:
            name = quoted[1] or quoted[2]
        elif match[2]:
            name = what.replace(".", "/")
        else:
            raise ShaderError(source.where(line, f"#include: {what!r} is not a path in quotes"))
        yield line, name if match[1] or "." in Path(name).name else f"{name}.slang"


def _find(folder: Path, name: str, folders: tuple[Path, ...]) -> Path | None:
    if "\0" in name or len(name) > 1000:
        return None
    for each in (folder, *folders):
        target = each / name
        try:
            if target.is_file():
                return target
        except OSError:
            continue
    return None
