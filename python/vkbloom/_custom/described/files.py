"""The files of a shader: its text, and what it includes from folders that it may read."""

from __future__ import annotations

import dataclasses
import errno
import hashlib
import os
import re
import stat
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
    r"|(?:^[ \t]*|[;}]\s*)(?:__exported\s+)?(?:import|__include)\s+([^;{}#]{1,999});",
    re.MULTILINE,
)
_CONDITION: Final = re.compile(r"^[ \t]*#[ \t]*(?:if|pragma[ \t]+once)", re.MULTILINE)
_QUOTED: Final = re.compile(r'"([^"\n]+)"|<([^>\n]+)>')
#: A remark, which may have no end.
REMARK: Final = re.compile(r"/\*.*?(?:\*/|\Z)|//[^\n]*", re.DOTALL)


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


def read_bytes(path: Path) -> bytes:
    """Read a file of bounded size; raise OSError or ValueError that names it."""
    state = path.stat()
    if stat.S_ISDIR(state.st_mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not stat.S_ISREG(state.st_mode):
        raise ValueError(f"{path}:1: this is a device or a pipe, not a file")
    if state.st_size > MAX_FILE_BYTES:
        raise ValueError(
            f"{path}:1: {state.st_size} bytes are more than {MAX_FILE_BYTES}, for one shader"
        )
    return path.read_bytes()


def read_text(path: Path) -> Source:
    """Read a file of source text; raise OSError or ValueError that names it."""
    data = read_bytes(path).replace(b"\r\n", b"\n")
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
    # The file that has included another one.
    above: dict[str, Source] = {}
    total = len(main.text)
    for each in waiting:
        for number, (line, name) in enumerate(includes(each)):
            if number > MAX_FILES:
                raise ShaderError(each.where(line, f"more than {MAX_FILES} includes in a file"))
            target = _find(Path(each.name).parent, name, folders)
            if target is None:
                continue
            if not target.is_file():
                raise ShaderError(each.where(line, f"{name!r} is a folder or a device, not a file"))
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
                _check_end(each, line, name, found[real], above)
                continue
            try:
                made = read_text(target)
            except OSError as error:
                cause = f"{name!r}: {error.strerror or error}"
                raise ShaderError(each.where(line, cause)) from None
            found[real] = made
            above[made.name] = each
            waiting.append(made)
            total += len(made.text)
            if len(found) > MAX_FILES or total > MAX_BYTES:
                raise ShaderError(each.where(line, f"{len(found)} included files are too many"))
    return Files(main, folders, tuple(waiting[1:]))


def _check_end(
    source: Source, line: int, name: str, included: Source, above: dict[str, Source]
) -> None:
    """Check that includes end: a file that includes itself has a condition somewhere."""
    chain = [source]
    while chain[-1].name != included.name:
        if chain[-1].name not in above:
            return
        chain.append(above[chain[-1].name])
    if not any(_CONDITION.search(each.text) for each in chain):
        raise ShaderError(source.where(line, f"{name!r} includes itself again and again"))


def includes(source: Source) -> Iterator[tuple[int, str]]:
    """Return line and path of each include; ShaderError if one is no path."""
    text = without_remarks(_joined(source.text))
    for match in _INCLUDE.finditer(text):
        start = match.start(1) if match[1] is not None else match.start(2)
        line = text.count("\n", 0, start) + 1
        what = (match[1] or match[2] or "").strip()
        quoted = _QUOTED.match(what)
        if quoted:
            name = quoted[1] or quoted[2]
        elif match[2]:
            name = re.sub(r"\s", "", what).replace(".", "/")
        else:
            raise ShaderError(source.where(line, f"#include: {what!r} is not a path in quotes"))
        yield line, name if match[1] or "." in Path(name).name else f"{name}.slang"


def without_remarks(text: str) -> str:
    """Return a text with blanks in place of remarks."""
    return REMARK.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)


def _joined(text: str) -> str:
    """Return a text whose lines that a backslash joins are one, and empty lines in their place."""
    made, left = [], 0
    for line in text.split("\n"):
        joins = line.endswith("\\")
        made.append(line[:-1] if joins else line + "\n" * (left + 1))
        left = left + 1 if joins else 0
    return "".join(made)


def _find(folder: Path, name: str, folders: tuple[Path, ...]) -> Path | None:
    if "\0" in name or len(name) > 1000:
        return None
    for each in (folder, *folders):
        target = each / name
        try:
            if target.exists():
                return target
        except OSError:
            continue
    return None
