"""The kernels of convolutions on disk: the diffraction of an aperture takes a second to compute.

A file is used only if its checksum is right for its content and for what the kernel follows from:
its function and sizes, the package's source of the formulas, and the version of NumPy. All files
together have `MAX_BYTES` at the most; the ones whose last use is longest ago are removed. A kernel
that was computed in less than `MIN_SECONDS` has no file: reading one takes a part of that, too.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import hashlib
import os
import struct
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from vkbloom._core_kernel import CoreKernel
from vkbloom._io import pipeline_cache
from vkbloom._io.safe_writing import write_file
from vkbloom.psf._values import ArrayValue

__all__ = ["MAX_BYTES", "MIN_SECONDS", "find_or_make", "folder"]

MAGIC: Final = b"vkbloom kernel 1\n"
#: The bound of all files. A process writes no more than that in total, so that a long sweep of
#: kernels does not replace the files of other processes again and again.
MAX_BYTES: Final = 256 << 20
#: Of processor time of the thread.
MIN_SECONDS: Final = 0.02

# Serial, width, height; left, top, width, height and channels of the part that is not 0.
_HEADER: Final = struct.Struct("<Q7I")
_DIGEST_SIZE: Final = 32
_PACKAGE: Final = Path(__file__).parents[1]
# Modules whose functions follow from their fields alone. Those of users may change at any time.
_OWN: Final = {f"vkbloom.psf._{name}" for name in ("aperture", "eye", "lens", "renderers")}
_SOURCES: Final = ("_core_kernel.py", "_methods/convolution.py", "_methods/blender_kernels.py")

Pixels: TypeAlias = NDArray[np.float32]
_written = 0


def folder() -> Path | None:
    """Return the folder of the files; None if VKBLOOM_CACHE_DIR is empty."""
    base = pipeline_cache.folder()
    return None if base is None else base / "kernels"


def find_or_make(what: tuple[object, ...], make: Callable[[], CoreKernel]) -> CoreKernel:
    """Return a kernel from the cache, or make it and write it there if that took long.

    `what`: All that the kernel follows from: numbers, strings, tuples, point-spread functions.
    """
    base, key = folder(), _key(what)
    if base is None or key is None:
        return make()
    file = base / f"{key.hex()}.bin"
    kernel = _read(file, key)
    if kernel is None:
        start = time.thread_time()
        kernel = make()
        if time.thread_time() - start >= MIN_SECONDS:
            _write(file, _pack(kernel, key))
    return kernel


def _key(what: tuple[object, ...]) -> bytes | None:
    """Return a digest; None if something may change that is not in it."""
    formulas = _formulas()
    digest = hashlib.blake2b(formulas or b"", digest_size=_DIGEST_SIZE)
    return digest.digest() if formulas and _update(digest, what) else None


def _update(digest: Any, value: Any) -> bool:
    """Add a value to a digest; return whether it and all that it contains is known."""
    if value is None or isinstance(value, bool | int | float | str):
        digest.update(f"{value!r}\n".encode())
        return True
    if isinstance(value, ArrayValue):
        digest.update(f"{value.array.shape}\n".encode())
        digest.update(value.array)
        return True
    if isinstance(value, tuple):
        digest.update(f"{len(value)}\n".encode())
        return all(_update(digest, one) for one in value)
    if not dataclasses.is_dataclass(value) or type(value).__module__ not in _OWN:
        return False
    digest.update(f"{type(value).__name__}\n".encode())
    return all(_update(digest, getattr(value, field.name)) for field in dataclasses.fields(value))


@functools.cache
def _formulas() -> bytes | None:
    """Return a digest of the source of all formulas; None if it cannot be read."""
    digest = hashlib.blake2b(np.__version__.encode())
    try:
        files = [*sorted((_PACKAGE / "psf").glob("*.py")), *(_PACKAGE / name for name in _SOURCES)]
        for file in files:
            digest.update(file.read_bytes())
    except OSError:
        return None
    return digest.digest()


def _pack(kernel: CoreKernel, key: bytes) -> bytes:
    """Return the content of a kernel's file."""
    height, width = kernel.pixels.shape[:2]
    filled = np.asarray(kernel.pixels.any(axis=2))
    rows, columns = _extent(filled, 1), _extent(filled, 0)
    part = kernel.pixels[rows, columns, : 1 if kernel.is_grey else 4]
    sides = width, height, columns.start, rows.start, part.shape[1], part.shape[0], part.shape[2]
    data = _HEADER.pack(kernel.serial, *sides) + part.tobytes()
    return MAGIC + _digest(key, data) + data


def _extent(filled: NDArray[np.bool_], axis: int) -> slice:
    """Return the first to the last of the lines along an axis that have a True."""
    places = np.flatnonzero(filled.any(axis=axis))
    return slice(int(places[0]), int(places[-1]) + 1) if len(places) else slice(0, 0)


def _digest(key: bytes, data: bytes | memoryview) -> bytes:
    return hashlib.blake2b(data, key=key, digest_size=_DIGEST_SIZE).digest()


def _read(file: Path, key: bytes) -> CoreKernel | None:
    """Return the kernel of a file; None if it is missing, damaged or another's."""
    start = len(MAGIC) + _DIGEST_SIZE
    try:
        content = file.read_bytes()
        if content[:start] != MAGIC + _digest(key, memoryview(content)[start:]):
            return None
        # The time of its last use.
        os.utime(file)
    except OSError:
        return None
    serial, width, height, left, top, *part = _HEADER.unpack_from(content, start)
    across, down, channels = part
    pixels: Pixels = np.zeros((height, width, 4), np.float32)
    values: Pixels = np.frombuffer(content, np.float32, offset=start + _HEADER.size)
    pixels[top : top + down, left : left + across] = values.reshape(down, across, channels)
    return CoreKernel(pixels, serial, channels == 1)


def _write(file: Path, content: bytes) -> None:
    """Write a file. The cache only saves time, so failing to write it is not an error."""
    global _written  # noqa: PLW0603  of the process
    if _written + len(content) > MAX_BYTES:
        return
    with contextlib.suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        write_file(file, content)
        _written += len(content)
        _remove_oldest(file.parent)


def _remove_oldest(base: Path) -> None:
    """Remove files until the rest has no more bytes than allowed."""
    states = sorted((file.stat().st_mtime_ns, file.stat().st_size, file) for file in base.iterdir())
    total = sum(size for _, size, _ in states)
    for _, size, file in states:
        if total <= MAX_BYTES:
            return
        file.unlink(missing_ok=True)
        total -= size
