"""Safe writing of image files: whole ones or none, in formats that keep what they are given.

A file is written under another name beside its own, and takes its place when it is complete:

1. `check_extension`, before anything is done
2. `reserve` the temporary file, on which `holds` tries what the format can keep
3. write it; a failure of OpenImageIO becomes a `write_error`
4. `check_complete`, then `put_in_place`
5. remove the temporary file where one is left
"""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, BinaryIO, Final

import numpy as np

from vkbloom.io.images import check_name

if TYPE_CHECKING:
    import OpenImageIO

__all__ = [
    "check_complete",
    "check_extension",
    "holds",
    "put_in_place",
    "reserve",
    "write_error",
    "write_whole",
]

# Formats of OpenImageIO that throw the picture away or print it on the terminal.
_FORMATS_WITHOUT_A_FILE: Final = ("null", "term")

_LARGEST_HEADER: Final = 65536  # bytes; what a file may hold beside the pixels
_ZEROS: Final = 1 << 20  # bytes written at a time


def check_extension(oiio: ModuleType, suffix: str) -> None:
    """Find out whether an extension is of a format that can be written.

    Parameters
    ----------
    oiio : module
        OpenImageIO.
    suffix : str
        With its dot, such as ".png".

    Raises
    ------
    ValueError
        It is not.
    """
    writer = oiio.ImageOutput.create(f"image{suffix}")
    if writer is None:
        oiio.geterror()
    if writer is None or writer.format_name() in _FORMATS_WITHOUT_A_FILE:
        raise ValueError(f"path: no image format for the extension {suffix!r} can be written")


def reserve(file: Path, size: int) -> Path:
    """Make a file of a new name beside a file, with the disk space that it shall need.

    Doing it here gives the system's own reason where it fails, which OpenImageIO does not
    pass on. And on a full disk its JPEG writer would end the process and its WebP writer
    would not return.

    Parameters
    ----------
    file : Path
        The file to write in the end, which is left alone.
    size : int
        Bytes of the pixels.

    Returns
    -------
    Path
        The temporary file, with the extension of `file`.

    Raises
    ------
    ValueError
        The name is not UTF-8.
    OSError
        It cannot be made or the disk is full; it names `file`, and nothing is left.
    """
    return _filled(file, lambda stream: _allocate(stream, _LARGEST_HEADER + size))


def holds(oiio: ModuleType, temporary: Path, channels: int, numbers: str) -> bool:
    """Tell whether a format keeps a number of channels and a type of numbers.

    A format answers only once a file is open, and libpng complains on stderr about a file
    without pixels; so one pixel is written.

    Parameters
    ----------
    oiio : module
        OpenImageIO.
    temporary : Path
        From `reserve`; what is in it is lost.
    channels : int
        1 to 4.
    numbers : str
        OpenImageIO's name of the numbers, such as "half".

    Returns
    -------
    bool
    """
    spec = oiio.ImageSpec(1, 1, channels, numbers)
    writer = oiio.ImageOutput.create(str(temporary))
    is_kept = False
    if writer.open(str(temporary), spec):
        opened = writer.spec()
        is_kept = (str(opened.format), opened.nchannels) == (numbers, channels)
        writer.write_image(np.zeros((1, 1, channels), np.float32))
        writer.close()
    # An error that nobody asked for would be printed when the writer is gone.
    writer.geterror()
    return is_kept


def write_error(writer: OpenImageIO.ImageOutput, temporary: Path, file: Path) -> OSError:
    """Make an exception of what went wrong in a writer.

    Parameters
    ----------
    writer : OpenImageIO.ImageOutput
        A call of it has failed.
    temporary, file : Path
        What it was writing, and the file that the exception names instead.

    Returns
    -------
    OSError
        With the writer's reason.
    """
    reason = writer.geterror().replace(str(temporary), file.name).strip() or "not written"
    return OSError(errno.EIO, reason, str(file))


def check_complete(oiio: ModuleType, temporary: Path, file: Path) -> None:
    """Read what was written, as not all writers (PNG, Targa) notice that a disk is full.

    Parameters
    ----------
    oiio : module
        OpenImageIO.
    temporary, file : Path
        What was written, and the file that the exception names instead.

    Raises
    ------
    OSError
        It cannot be read.
    """
    if not _is_readable(oiio, temporary):
        raise OSError(errno.EIO, "not written completely; is the disk full?", str(file))


def put_in_place(temporary: Path, file: Path) -> None:
    """Give a temporary file its name, in place of what is there, and the permissions of that.

    Parameters
    ----------
    temporary, file : Path
        From `reserve`, and what it was given.

    Raises
    ------
    OSError
        It cannot be done, for example because a folder is there; it names `file`.
    """
    meant = _meant(file)
    with contextlib.suppress(OSError):
        shutil.copymode(meant, temporary)
    try:
        temporary.replace(meant)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(file)) from error


def write_whole(file: Path, content: bytes) -> None:
    """Write a file at once, in place of what is there.

    Parameters
    ----------
    file : Path
    content : bytes

    Raises
    ------
    OSError
        It cannot be written; it names `file`, which is as it was.
    """
    temporary = _filled(file, lambda stream: stream.write(content))
    try:
        put_in_place(temporary, file)
    finally:
        temporary.unlink(missing_ok=True)


def _filled(file: Path, fill: Callable[[BinaryIO], object]) -> Path:
    """Make a temporary file beside a file and fill it; where that fails, nothing is left."""
    check_name(file)
    temporary = _meant(file).with_name(f".vkbloom-{os.urandom(8).hex()}{file.suffix}")
    try:
        with temporary.open("xb") as stream:
            fill(stream)
    except BaseException as error:
        # Ctrl-C too, which a large file leaves time for.
        with contextlib.suppress(OSError):
            temporary.unlink()
        if isinstance(error, OSError):
            raise OSError(error.errno, error.strerror, str(file)) from error
        raise
    return temporary


def _allocate(stream: BinaryIO, size: int) -> None:
    """Give a new file disk space, without writing it where the system can."""
    if hasattr(os, "posix_fallocate"):
        try:
            os.posix_fallocate(stream.fileno(), 0, size)
            return
        except OSError as error:
            # What musl says where the file system cannot; glibc writes instead.
            if error.errno not in (errno.EOPNOTSUPP, errno.EINVAL):
                raise
    for start in range(0, size, _ZEROS):
        stream.write(bytes(min(_ZEROS, size - start)))


def _meant(file: Path) -> Path:
    """Return the file that a name stands for: links are written through, not replaced."""
    try:
        return Path(os.path.realpath(file))
    except OSError as error:
        # The current folder is not there any more.
        raise OSError(error.errno, error.strerror, str(file)) from error


def _is_readable(oiio: ModuleType, file: Path) -> bool:
    reader = oiio.ImageInput.open(str(file))
    if reader is None:
        oiio.geterror()
        return False
    spec = reader.spec()
    readable = reader.read_image(0, 0, 0, spec.nchannels, spec.format) is not None
    reader.geterror()
    reader.close()
    return readable
