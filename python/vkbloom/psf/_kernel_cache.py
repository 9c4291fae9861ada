"""The kernels of convolutions on disk: the diffraction of an aperture takes a second to compute.

Their key is what a kernel follows from: its function and sizes, the package's source of the
formulas, and the version of NumPy. A kernel that was computed in less than `MIN_SECONDS` has no
file: reading one takes a part of that, too.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import struct
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from vkbloom._core_kernel import CoreKernel
from vkbloom._io.disk_cache import DiskCache
from vkbloom.psf._values import ArrayValue

CACHE: Final = DiskCache("kernels")
#: Of processor time of the thread.
MIN_SECONDS: Final = 0.02

# Serial, width, height; left, top, width, height and channels of the part that is not 0.
_HEADER: Final = struct.Struct("<Q7I")
_DIGEST_SIZE: Final = 32
_PACKAGE: Final = Path(__file__).parents[1]
# Modules whose functions follow from their fields alone. Those of users may change at any time.
_PURE_MODULES: Final = {f"vkbloom.psf._{name}" for name in ("aperture", "eye", "lens", "renderers")}
_SOURCES: Final = ("_core_kernel.py", "_methods/convolution.py", "_methods/blender_kernels.py")

Pixels: TypeAlias = NDArray[np.float32]


def find_or_make(what: tuple[object, ...], make: Callable[[], CoreKernel]) -> CoreKernel:
    """Return a kernel from the cache, or make it and write it there if that took long."""
    key = _key(what)
    if key is None or CACHE.file(key) is None:
        return make()
    data = CACHE.read(key)
    if data is not None:
        return _unpack(data)
    start = time.thread_time()
    kernel = make()
    if time.thread_time() - start >= MIN_SECONDS:
        CACHE.write(key, _pack(kernel))
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
        return all(_update(digest, item) for item in value)
    if not dataclasses.is_dataclass(value) or type(value).__module__ not in _PURE_MODULES:
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


def _pack(kernel: CoreKernel) -> bytes:
    """Return the content of a kernel's file."""
    height, width = kernel.pixels.shape[:2]
    filled = np.asarray(kernel.pixels.any(axis=2))
    rows, columns = _extent(filled, 1), _extent(filled, 0)
    part = kernel.pixels[rows, columns, : 1 if kernel.is_grey else 4]
    sides = width, height, columns.start, rows.start, part.shape[1], part.shape[0], part.shape[2]
    return _HEADER.pack(kernel.serial, *sides) + part.tobytes()


def _extent(filled: NDArray[np.bool_], axis: int) -> slice:
    """Return the first to the last of the lines along an axis that have a True."""
    lines = np.flatnonzero(filled.any(axis=axis))
    return slice(int(lines[0]), int(lines[-1]) + 1) if len(lines) else slice(0, 0)


def _unpack(data: bytes) -> CoreKernel:
    """Return the kernel of a file."""
    serial, width, height, left, top, across, down, channels = _HEADER.unpack_from(data)
    pixels: Pixels = np.zeros((height, width, 4), np.float32)
    values: Pixels = np.frombuffer(data, np.float32, offset=_HEADER.size)
    pixels[top : top + down, left : left + across] = values.reshape(down, across, channels)
    return CoreKernel(pixels, serial, channels == 1)
