"""Write image files safely: completely or not at all, in a format that keeps the values.

Files are written to temporary files beside them (`replacing`), which are read again and renamed
when all of them are complete.
"""

from __future__ import annotations

import contextlib
import errno
import functools
import os
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, BinaryIO, Final

import numpy as np

from vkbloom._c_paths import for_c, in_utf8
from vkbloom._extras import import_extra
from vkbloom._io.readers import check_name, failure_of, readable

if TYPE_CHECKING:
    import OpenImageIO

# Formats of OpenImageIO that discard the picture or print it on the terminal.
_FORMATS_WITHOUT_A_FILE: Final = ("null", "term")

# Formats that OpenImageIO has only where it is built with a library.
_MISSING: Final = dict.fromkeys(
    (".avif", ".heic", ".heif"), "libheif; PNG can name PQ, HLG and primaries, too"
)

#: What the attribute "Software" of files begins with.
PROGRAM: Final = "vkbloom"
_TOLD_BY: Final = 16  # bytes that tell text from what is left of an image
_MAX_HEADER_BYTES: Final = 65536  # bytes of a file in addition to its pixels
_TEMPORARY: Final = ".vkbloom-"  # the beginning of the names of temporary files
_TRIED: Final = 32  # pixels on a side that every format can have
_ZEROS: Final = 1 << 20  # bytes written at a time

# Temporary files of this process.
_unfinished: set[Path] = set()


def writer_of(path: str | os.PathLike[str]) -> OpenImageIO.ImageOutput:
    """Return a writer of the format that a file's extension names, or raise ValueError."""
    oiio = import_extra("OpenImageIO", "images", "Writing images")
    suffix = Path(path).suffix
    writer: OpenImageIO.ImageOutput | None = oiio.ImageOutput.create(f"image{suffix}")
    if not suffix:
        raise ValueError(f"{os.fspath(path)}: a file needs an extension, such as .png or .exr")
    if writer is None:
        oiio.geterror()
    if writer is None or writer.format_name() in _FORMATS_WITHOUT_A_FILE:
        reason = _MISSING.get(suffix.lower())
        raise ValueError(
            f"{os.fspath(path)}: {suffix!r} is not the extension of a writable image format, "
            + (f"this OpenImageIO is built without {reason}" if reason else "such as .png or .exr")
        )
    return writer


def reserve(file: Path, size: int) -> Path:
    """Create a temporary file beside a file, and allocate its disk space.

    A failure here has the system's own reason, which OpenImageIO does not report. On a full disk,
    OpenImageIO's JPEG writer would end the process, and its WebP writer would not return.
    """
    return _fill(file, lambda stream: _allocate(stream, _MAX_HEADER_BYTES + size))


@contextlib.contextmanager
def replacing_stream(file: Path) -> Iterator[BinaryIO]:
    """Yield a new temporary file to be written in place of a file, of any size.

    At the end of the block it is renamed. If the block raises, it is removed.
    """
    temporary = _fill(file, lambda _: None)
    try:
        # Buffered: a short write of an unbuffered file is no error.
        with temporary.open("r+b") as stream:
            yield stream
        put_in_place(temporary, file)
    except OSError as error:
        if error.filename is not None:
            raise
        raise OSError(error.errno, error.strerror or str(error), str(file)) from error
    finally:
        remove(temporary)


def has_alpha(writer: OpenImageIO.ImageOutput) -> bool:
    """Return whether a format keeps alpha. OpenImageIO says so of GIF, and writes it opaque."""
    return writer.supports("alpha") != 0 and writer.format_name() != "gif"


@functools.lru_cache
def holds(suffix: str, channels: int, numbers: str) -> bool:
    """Return whether a format supports a number of channels and a number type.

    OpenImageIO knows this only for a complete file: a small one is written and opened again.
    """
    oiio = import_extra("OpenImageIO", "images", "Writing images")
    with tempfile.TemporaryDirectory(prefix="vkbloom-") as folder:
        name = in_utf8(f"{folder}/image{suffix}") or f"{folder}/image{suffix}"
        spec = oiio.ImageSpec(_TRIED, _TRIED, channels, numbers)
        writer = oiio.ImageOutput.create(name)
        is_kept = False
        if writer.open(name, spec):
            opened = writer.spec()
            is_written = writer.write_image(np.zeros((_TRIED, _TRIED, channels), np.float32))
            is_written = writer.close() and is_written
            is_kept = is_written and (str(opened.format), opened.nchannels) == (numbers, channels)
        # Clear the error: OpenImageIO prints an unread one when the writer is destroyed.
        writer.geterror()
        if is_kept:
            reader = oiio.ImageInput.open(name)
            # FITS takes halves for another type. OpenImageIO needs 128 bytes of JPEG XL.
            is_kept = reader is None or str(reader.spec().format) == numbers
            failure_of(oiio)
    return is_kept


def write_error(writer: OpenImageIO.ImageOutput, temporary: Path, file: Path) -> OSError:
    """Convert a writer's error to an exception."""
    reason = failure_of(writer).replace(str(temporary), file.name) or "not written"
    return OSError(errno.EIO, reason, str(file))


def check_complete(oiio: ModuleType, temporary: Path, file: Path) -> None:
    """Check a written file by reading it: some writers (PNG, Targa) do not notice a full disk."""
    reason = _unreadable(oiio, temporary)
    if reason is None:
        return
    reason = reason.replace(str(temporary), file.name)
    if shutil.disk_usage(temporary.parent).free < _MAX_HEADER_BYTES:
        raise OSError(errno.ENOSPC, f"not written completely: {reason}", str(file))
    # Some formats cannot hold a few pixels, or OpenImageIO cannot read such files.
    raise OSError(
        errno.EIO, f"cannot be read after writing: {reason}; try another format", str(file)
    )


def put_in_place(temporary: Path, file: Path) -> None:
    """Rename a temporary file to its final name, with the permissions of the file it replaces.

    The content is written to a pipe or a device, which is not replaced.
    """
    target = _link_target(file)
    if is_stream(target):
        try:
            with temporary.open("rb") as content, file.open("wb") as stream:
                shutil.copyfileobj(content, stream)
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(file)) from error
        temporary.unlink()
        return
    with contextlib.suppress(OSError):
        shutil.copymode(target, temporary)
    try:
        temporary.replace(target)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(file)) from error


@contextlib.contextmanager
def replacing(
    oiio: ModuleType, sizes: Mapping[Path, int], obsolete: Sequence[Path] = ()
) -> Iterator[list[Path]]:
    """Yield temporary files to be written in place of files, whose pixels have these bytes.

    At the end of the block all are checked, then all are renamed, and the obsolete files, which the
    block may add to, are removed before the last one is. If the block raises, the temporary files
    are removed.
    """
    temporaries: list[Path] = []
    try:
        for file, size in sizes.items():
            temporaries.append(reserve(file, size))
        yield temporaries
        for temporary, file in zip(temporaries, sizes, strict=True):
            check_complete(oiio, temporary, file)
        _put_all_in_place([*zip(temporaries, sizes, strict=True)], obsolete)
    finally:
        for temporary in temporaries:
            remove(temporary)


def _put_all_in_place(pairs: Sequence[tuple[Path, Path]], obsolete: Sequence[Path]) -> None:
    """Rename temporary files to their final names: all of them, or none if one fails."""
    *others, last = pairs
    if not others and not obsolete:
        put_in_place(*last)
        return
    replaced: list[tuple[Path, Path | None]] = []

    def keep(target: Path) -> None:
        if (backup := _backup_of(target)) is not None:
            replaced.append(backup)

    try:
        for temporary, file in others:
            keep(_link_target(file))
            put_in_place(temporary, file)
        for file in obsolete:
            keep(file)
            file.unlink(missing_ok=True)
        keep(_link_target(last[1]))
        put_in_place(*last)
    except BaseException:
        # BaseException includes Ctrl-C.
        for target, kept in reversed(replaced):
            if kept is None:
                target.unlink(missing_ok=True)
            else:
                kept.replace(target)
        raise
    finally:
        for _, kept in replaced:
            if kept is not None:
                remove(kept)


def _backup_of(target: Path) -> tuple[Path, Path | None] | None:
    """Return a file with a second link to it, or with None if there is no such file.

    None: it cannot be put back, because it is a stream or its file system has no links.
    """
    if not os.path.lexists(target):
        return target, None
    kept = target.parent / f"{_TEMPORARY}{os.urandom(8).hex()}{target.suffix}"
    try:
        _unfinished.add(kept)
        os.link(target, kept)
    except OSError:
        _unfinished.discard(kept)
        return None
    return target, kept


def write_file(file: Path, content: bytes) -> None:
    """Write a file atomically."""
    temporary = _fill(file, lambda stream: stream.write(content))
    try:
        put_in_place(temporary, file)
    finally:
        remove(temporary)


def remove(*files: Path) -> None:
    """Remove temporary files that still exist; without arguments, all of this process."""
    for temporary in files or [*_unfinished]:
        temporary.unlink(missing_ok=True)
        _unfinished.discard(temporary)


def is_stream(path: str | os.PathLike[str]) -> bool:
    """Return whether a name is that of a pipe, a socket or a device."""
    try:
        mode = os.stat(path).st_mode
    except (OSError, ValueError):
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def is_picture(file: Path) -> bool:
    """Return whether a file is an image whose header can be read."""
    return _program_of(file) is not None


def is_damaged(file: Path) -> bool:
    """Return whether a file is an image that is not complete, or nothing yet.

    False for what is no image, such as text.
    """
    oiio = import_extra("OpenImageIO", "images", "Reading images")
    if is_picture(file):
        return _unreadable(oiio, file) is not None
    with file.open("rb") as stream:
        begun = stream.read(_TOLD_BY)
    return not begun or not begun.isascii() or b"\0" in begun


def is_of_another_program(file: Path) -> bool:
    """Return whether a file is an image of a format that names its program, and that is another."""
    program = _program_of(file)
    return program is not None and not program.startswith(PROGRAM) and _names_program(file.suffix)


def _program_of(file: Path) -> str | None:
    """Return the program that an image file names, or ""; None: it is no image."""
    oiio = import_extra("OpenImageIO", "images", "Reading images")
    with readable(file) as name, for_c(name) as given:
        reader = oiio.ImageInput.open(given)
        if reader is None:
            failure_of(oiio)
            return None
        program: str = reader.spec().get_string_attribute("Software")
        reader.close()
    return program


@functools.lru_cache
def _names_program(suffix: str) -> bool:
    """Return whether a format that can be written keeps the name of the program."""
    oiio = import_extra("OpenImageIO", "images", "Writing images")
    with tempfile.TemporaryDirectory(prefix="vkbloom-") as folder:
        file = Path(folder, f"image{suffix}")
        spec = oiio.ImageSpec(_TRIED, _TRIED, 3, "uint8")
        spec.attribute("Software", PROGRAM)
        with for_c(str(file)) as given:
            writer = oiio.ImageOutput.create(given)
            if writer is None:
                failure_of(oiio)
                return False
            is_written = writer.open(given, spec)
            is_written = is_written and writer.write_image(np.zeros((_TRIED, _TRIED, 3), np.uint8))
            is_written = is_written and writer.close()
            failure_of(writer)
        return is_written and (_program_of(file) or "").startswith(PROGRAM)


def is_temporary(path: Path) -> bool:
    """Return whether a file is one that a process writes before it is renamed."""
    return path.name.startswith(_TEMPORARY)


def _fill(file: Path, fill: Callable[[BinaryIO], object]) -> Path:
    """Create a temporary file beside a file and fill it; remove it if that fails."""
    check_name(file)
    target = _link_target(file)
    folder = Path(tempfile.gettempdir()) if is_stream(target) else target.parent
    temporary = folder / f"{_TEMPORARY}{os.urandom(8).hex()}{file.suffix}"
    _unfinished.add(temporary)
    try:
        with temporary.open("xb") as stream:
            fill(stream)
    except BaseException as error:
        # BaseException includes Ctrl-C, which may arrive while a large file is written.
        with contextlib.suppress(OSError):
            remove(temporary)
        if isinstance(error, OSError):
            raise OSError(error.errno, error.strerror, str(file)) from error
        raise
    return temporary


def _allocate(stream: BinaryIO, size: int) -> None:
    """Allocate disk space for a new file; write zeros if the system cannot allocate."""
    if hasattr(os, "posix_fallocate"):
        try:
            os.posix_fallocate(stream.fileno(), 0, size)
            return
        except OSError as error:
            # musl's error if the file system cannot allocate; glibc writes zeros itself.
            if error.errno not in (errno.EOPNOTSUPP, errno.EINVAL):
                raise
    for start in range(0, size, _ZEROS):
        stream.write(bytes(min(_ZEROS, size - start)))


def _link_target(file: Path) -> Path:
    """Follow symbolic links: the file they point to is written, and the link is kept."""
    try:
        return Path(os.path.realpath(file))
    except OSError as error:
        # The current folder has been removed.
        raise OSError(error.errno, error.strerror, str(file)) from error


def _unreadable(oiio: ModuleType, file: Path) -> str | None:
    """Return why a file cannot be read; None: it can."""
    with readable(file) as name, for_c(name) as given:
        reader = oiio.ImageInput.open(given)
        if reader is None:
            return failure_of(oiio) or "unknown format"
        spec = reader.spec()
        is_readable = reader.read_image(0, 0, 0, spec.nchannels, spec.format) is not None
        reason = failure_of(reader) or "the pixels are missing"
        reader.close()
    return None if is_readable else reason
