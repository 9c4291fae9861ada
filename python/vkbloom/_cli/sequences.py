"""The files that a command reads and writes: single files, sequences, globs, folders, pipes."""

from __future__ import annotations

import errno
import glob
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, Final

import click

from vkbloom._cli.targets import check_folder, check_new_folder
from vkbloom._cli.terminal import note
from vkbloom._io import safe_writing
from vkbloom._io.numbered_files import NumberedFile, files_of, gap_note, pattern_of
from vkbloom._io.readers import readable_extensions

#: Stands for standard input and standard output.
PIPE: Final = "-"

# Where a call keeps its folder of copies.
_FOLDER: Final = "vkbloom.streams"
#: The most names in a note.
_MAX_NAMES: Final = 5


def is_stream(name: str) -> bool:
    """Return whether a name stands for a pipe, a socket or a device."""
    return name == PIPE or safe_writing.is_stream(name)


def displayed_name(name: str) -> str:
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
        file = str(error.filename).replace(copy, displayed_name(name))
        raise OSError(error.errno, error.strerror, file) from error
    except ValueError as error:
        raise ValueError(str(error).replace(copy, displayed_name(name))) from error


def _copy_of(name: str) -> str:
    context = click.get_current_context().find_root()
    if _FOLDER not in context.meta:
        context.meta[_FOLDER] = context.with_resource(tempfile.TemporaryDirectory())
    # The name is kept, because some formats are known by it.
    file = os.path.join(context.meta[_FOLDER], name.replace("%", "%25").replace(os.sep, "%2F"))
    if not os.path.exists(file):
        with _open(name) as stream, open(file, "wb") as copy:
            shutil.copyfileobj(stream, copy)
    return file


@contextmanager
def _open(name: str) -> Iterator[BinaryIO]:
    if name != PIPE:
        with open(name, "rb") as stream:
            yield stream
    elif sys.stdin is None:
        raise OSError(errno.EBADF, "is closed", displayed_name(name))
    else:
        yield sys.stdin.buffer


def pairs(sources: Sequence[str], target: str) -> list[tuple[str, str]]:
    """Return the files to read, each with the file to write."""
    results: list[NumberedFile] = []
    for source in sources:
        files = expand(source)
        results += files
        if (missing := gap_note(files)) is not None:
            note(f"{source}: {missing}")
    is_folder = os.path.isdir(target) or target.endswith(("/", os.sep))
    folder, name = os.path.split(target)
    pattern = pattern_of(name)
    is_single = len(sources) == 1 and results == [(sources[0], None)]
    if is_folder or (not is_single and pattern is None and not Path(target).suffix):
        written = [os.path.join(target, os.path.basename(name)) for name, _ in results]
    elif pattern is not None:
        numbers = [number for _, number in results if number is not None]
        counted = numbers if len(numbers) == len(results) else range(len(results))
        written = [os.path.join(folder, pattern.name_of(number)) for number in counted]
    elif len(results) == 1:
        written = [target]
    else:
        raise click.UsageError(
            f"{target}: one file cannot hold {len(results)} images; name a folder or a pattern "
            "such as f.%04d.png"
        )
    if PIPE in (name for name, _ in results) and written != [target]:
        raise click.UsageError("standard input needs one file, or standard output, as OUT")
    if is_stream(target) and len(results) > 1:
        raise click.UsageError(f"{target}: one pipe cannot hold {len(results)} images")
    if len(set(written)) < len(written):
        raise click.UsageError(f"{target}: two images have the same name; use a pattern")
    return [(name, file) for (name, _), file in zip(results, written, strict=True)]


def check_targets(work: Sequence[tuple[str, str]], out: str, *, overwrite: bool) -> None:
    """Raise an error for files of `pairs` that cannot be written, or that are also read."""
    read = {_identity(source) for source, _ in work if os.path.isfile(source)}
    checked: set[str] = set()
    for _, target in work:
        if target == PIPE and sys.stdout is None:
            raise OSError(errno.EBADF, "is closed", "standard output")
        if target == PIPE and is_terminal():
            raise click.UsageError(
                "standard output is a terminal; redirect it to a file or a program"
            )
        if is_stream(target):
            continue
        if (folder := os.path.dirname(target)) not in checked:
            (check_folder if target == out else check_new_folder)(target)
            checked.add(folder)
        if not overwrite and os.path.exists(target) and _identity(target) in read:
            raise click.UsageError(f"{target}: is read as IN; use --overwrite to replace it")


def _identity(file: str) -> tuple[int, int]:
    """Return what two names of one file have in common."""
    state = os.stat(file)
    return state.st_dev, state.st_ino


def is_terminal() -> bool:
    """Return whether standard output is a terminal."""
    return sys.stdout is not None and sys.stdout.isatty()


def expand(source: str) -> list[NumberedFile]:
    """Return the files of a word, with their numbers if the word is a pattern."""
    # The name of an existing file may look like a pattern.
    if source == PIPE or os.path.isfile(source):
        return [(source, None)]
    folder, name = os.path.split(source)
    results: list[NumberedFile] = []
    if os.path.isdir(source):
        results = [(path, None) for path in _images_of(source)]
    elif (pattern := pattern_of(name)) is not None:
        results = files_of(folder, pattern)
    elif glob.has_magic(source):
        results = [(path, None) for path in sorted(glob.glob(source)) if os.path.isfile(path)]
    elif os.path.lexists(source):
        return [(source, None)]
    else:
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), source)
    if not results:
        raise FileNotFoundError(f"{source}: no file was found")
    return results


def _images_of(folder: str) -> list[str]:
    """Return the image files of a folder, and print a note about the other files."""
    files = sorted(
        file.path for file in os.scandir(folder) if file.is_file() and not file.name.startswith(".")
    )
    known = readable_extensions()
    images = [file for file in files if Path(file).suffix.lower() in known]
    others = [file for file in files if Path(file).suffix.lower() not in known]
    if others:
        names = ", ".join(map(os.path.basename, others[:_MAX_NAMES]))
        more = ", ..." * (len(others) > _MAX_NAMES)
        note(f"{folder}: left out what is no image: {names}{more}")
    return images
