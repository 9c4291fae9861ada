"""The text of a custom method, and errors that name a line of it."""

from __future__ import annotations

import dataclasses
import hashlib
import os
from pathlib import Path
from typing import Final

from vkbloom._custom import hints

#: No file of passes is larger; a picture that was given by mistake is.
MAX_FILE_BYTES: Final = 1 << 26
#: Of a line that a message quotes.
QUOTED_CHARACTERS: Final = 160
#: Of a cause, which names of a file can make long.
MAX_CAUSE_CHARACTERS: Final = 2000


@dataclasses.dataclass(frozen=True)
class Source:
    """The text of a custom method, and the name under which messages mention it."""

    name: str
    text: str

    @property
    def files(self) -> tuple[str, ...]:
        """The paths of all files that it was read from."""
        return () if self.name == "<text>" else (self.name,)

    @property
    def digest(self) -> str:
        """The SHA-256 of the text."""
        return hashlib.sha256(self.text.encode()).hexdigest()

    def quote(self, line: int) -> str:
        """Return a line of the file, counted from 1, as messages quote it."""
        lines = self.text.split("\n")
        text = lines[line - 1].strip() if 0 < line <= len(lines) else ""
        text = _printable(text[: QUOTED_CHARACTERS + 1])
        return text if len(text) <= QUOTED_CHARACTERS else text[:QUOTED_CHARACTERS] + "..."

    def where(self, line: int, cause: str) -> str:
        """Return a message that names file, line and cause, and quotes the line."""
        cause = _printable(cause[:MAX_CAUSE_CHARACTERS])
        return f"{self.name}:{line}: {cause}\n    {self.quote(line)}"

    def fault(self, line: int, cause: str) -> ValueError:
        """Return the error of a line."""
        return ValueError(self.where(line, cause))


def _printable(text: str) -> str:
    """Return a text of one line, whose characters do nothing to a terminal."""
    return "".join(
        each if each.isprintable() or each == "\t" else repr(each)[1:-1] for each in text
    )


def read_source(source: str | os.PathLike[str]) -> Source:
    """Read a file, or take a text: what contains a line feed is one."""
    if isinstance(source, str) and "\n" in source:
        return check(Source("<text>", source.replace("\r\n", "\n")))
    if not isinstance(source, str | os.PathLike):
        raise TypeError(f"source: {source!r} is neither a path nor a text")
    path = Path(source)
    if path.stat().st_size > MAX_FILE_BYTES:
        raise ValueError(f"{path}:1: {path.stat().st_size} bytes are more than {MAX_FILE_BYTES}")
    with path.open("rb") as file:  # a device may have no end
        data = file.read(MAX_FILE_BYTES).replace(b"\r\n", b"\n")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise ValueError(
            f"{path}:{line}: byte {data[error.start]:#04x} is not UTF-8; "
            f"{hints.for_bytes(path.name, data)}"
        ) from None
    return check(Source(str(path), text))


def check(source: Source) -> Source:
    """Return the source; raise ValueError if it has a null character."""
    if (offset := source.text.find("\0")) >= 0:
        raise source.fault(source.text.count("\n", 0, offset) + 1, "the line has a null character")
    return source
