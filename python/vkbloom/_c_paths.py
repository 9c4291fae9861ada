"""Paths for C libraries whose Python modules encode them as UTF-8, whatever the locale is."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator


def in_utf8(path: str | os.PathLike[str]) -> str | None:
    """Return the text whose UTF-8 bytes are those of a path for the system; None: there is none.

    Where the locale is not UTF-8, Python decodes the bytes of a file's name by another encoding.
    """
    try:
        return os.fsencode(path).decode()
    except UnicodeError:
        return None


def is_name(path: str) -> bool:
    """Return whether a name is text, and not bytes that are neither of the locale nor UTF-8."""
    if in_utf8(path) is not None:
        return True
    with contextlib.suppress(UnicodeError):
        path.encode()
        os.fsencode(path)
        return True
    return False


@contextlib.contextmanager
def for_c(path: str | os.PathLike[str]) -> Iterator[str]:
    """Yield a name by which OpenImageIO finds a file, which it must not replace.

    A link in a temporary folder stands for a file whose name in the locale's encoding is not UTF-8.
    """
    name = in_utf8(path)
    if name is not None:
        yield name
        return
    import tempfile  # noqa: PLC0415  costs start-up time

    with tempfile.TemporaryDirectory(prefix="vkbloom-") as folder:
        link = f"{folder}/file{os.path.splitext(path)[1]}"
        os.symlink(os.path.abspath(path), link)
        if (name := in_utf8(link)) is None:
            raise ValueError(
                f"path: {os.fspath(path)!r} is not UTF-8 in the locale's encoding, "
                f"{sys.getfilesystemencoding()}; use a UTF-8 locale or rename the file"
            )
        yield name
