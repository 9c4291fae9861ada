"""Files that can be read only once: standard input, named pipes and ``<(...)`` of a shell."""

from __future__ import annotations

import errno
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from typing import BinaryIO, Final

import click

from vkbloom._io import safe_writing

#: Stands for standard input and standard output.
PIPE: Final = "-"

# Where a call keeps its folder of copies.
_FOLDER: Final = "vkbloom.streams"


def is_stream(name: str) -> bool:
    """Return whether a name stands for a pipe, a socket or a device."""
    return name == PIPE or safe_writing.is_stream(name)


def shown(name: str) -> str:
    """Return the name of a file in a message."""
    return "standard input" if name == PIPE else name


@contextmanager
def as_file(name: str) -> Iterator[str]:
    """Yield the name of a file that can be opened repeatedly: of a stream, a copy.

    A call of the program reads each stream once. Errors name the stream instead of its copy.
    """
    if not is_stream(name):
        yield name
        return
    copy = _copy_of(name)
    try:
        yield copy
    except OSError as error:
        if error.filename is None:
            raise
        file = str(error.filename).replace(copy, shown(name))
        raise OSError(error.errno, error.strerror, file) from error
    except ValueError as error:
        raise ValueError(str(error).replace(copy, shown(name))) from error


def _copy_of(name: str) -> str:
    context = click.get_current_context().find_root()
    if _FOLDER not in context.meta:
        context.meta[_FOLDER] = context.with_resource(tempfile.TemporaryDirectory())
    # The name is kept, because some formats are known by it.
    file = os.path.join(context.meta[_FOLDER], name.replace("%", "%25").replace(os.sep, "%2F"))
    if not os.path.exists(file):
        with _opened(name) as stream, open(file, "wb") as copy:
            shutil.copyfileobj(stream, copy)
    return file


@contextmanager
def _opened(name: str) -> Iterator[BinaryIO]:
    if name != PIPE:
        with open(name, "rb") as stream:
            yield stream
    elif sys.stdin is None:
        raise OSError(errno.EBADF, "is closed", shown(name))
    else:
        yield sys.stdin.buffer
