"""Kernels that settings and stages make, for the core.

They are cached on disk, since a kernel of 3840 x 2160 takes 5 to 10 s of processor time in each
process. Their key is what a kernel follows from: its class and fields, the sizes, the package's
source of the formulas, and the version of NumPy. A kernel that was computed in less than
`MIN_SECONDS` has no file: reading one takes a part of that, too.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import struct
import sys
import time
from pathlib import Path
from typing import Any, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._array_cache import keep
from vkbloom._core_kernel import CoreKernel, core_kernel
from vkbloom._io.disk_cache import DiskCache
from vkbloom._public import defining_module

Size = tuple[int, int]

CACHE: Final = DiskCache("kernels")
#: Of processor time of the thread.
MIN_SECONDS: Final = 0.02

# Serial, reach, width, height; left, top, width, height and channels of the part that is not 0.
_HEADER: Final = struct.Struct("<Q9I")
_PACKAGE: Final = Path(__file__).parents[1]
# Modules whose functions follow from their fields alone. Those of users may change at any time.
_OURS: Final = ("vkbloom._methods.", "vkbloom._glare.")
_PURE_MODULES: Final = {
    f"vkbloom._psf.{name}" for name in ("apertures", "eye", "lens", "renderers", "stars")
}


class WithKernel:
    """Settings and stages whose kernel the core is given.

    - `shaping`: The fields that change the kernel.
    """

    shaping: ClassVar[tuple[str, ...]]

    @property
    def prefilter(self) -> tuple[float, float, float]:
        """min, max and mult of Unreal Engine's prefilter."""
        return 1.0, 0.0, 1.0

    def _kernel(self, frame: Size, buffers: Size) -> NDArray[Any]:
        """Return the kernel in pixels of the bloom buffers."""
        raise NotImplementedError

    def _with_reach(self, kernel: CoreKernel) -> CoreKernel:
        """Return the kernel with its reach, if transforms are to be no larger than it needs."""
        return kernel

    def core_kernel(self, frame: Size, buffers: Size) -> CoreKernel:
        """Return the kernel as the core reads it."""
        kernel = _core_kernel(type(self), self._shape, frame, buffers)
        return kernel._replace(prefilter=self.prefilter)

    def kept_kernel(self, frame: Size, buffers: Size) -> CoreKernel | None:
        """Return the same if it is kept from an earlier call."""
        kernel = _core_kernel.find(type(self), self._shape, frame, buffers)
        return kernel and kernel._replace(prefilter=self.prefilter)

    @property
    def _shape(self) -> tuple[Any, ...]:
        return tuple([getattr(self, name) for name in self.shaping])

    def core_field(self, frame: Size, buffers: Size) -> tuple[Any, ...] | None:
        """Return the weights of a field of kernels as the core reads them; None: there is none."""
        return None


@keep
def _core_kernel(
    kind: type[WithKernel], fields: tuple[Any, ...], frame: Size, buffers: Size
) -> CoreKernel:
    # A subclass of a user's may have another formula under the same name.
    is_ours = defining_module(kind).startswith(_OURS) and _is_there(kind)
    key = _key((kind.__name__, *fields, frame, buffers)) if is_ours else None
    data = CACHE.read(key) if key else None
    if data is not None:
        return _unpack(data)
    start = time.thread_time()
    shape = kind(**dict(zip(kind.shaping, fields, strict=True)))
    kernel = shape._with_reach(core_kernel(shape._kernel(frame, buffers)))
    if key and time.thread_time() - start >= MIN_SECONDS:
        CACHE.write(key, _pack(kernel))
    return kernel


def with_reach(kernel: CoreKernel) -> CoreKernel:
    """Return a kernel with its reach.

    Devices read subnormal numbers as zeros, too. Of the 7,679 x 4,319 pixels that reach everywhere
    in an image of 3840 x 2160, a Gaussian of 40 pixels has 999 x 999 that are not: a training step
    takes 4.1 ms in place of 5.7 (H200, 2026-11-30).
    """
    least = np.finfo(np.float32).tiny
    filled = np.asarray(((kernel.pixels >= least) | (kernel.pixels <= -least)).any(axis=2))
    reaches = [
        max(side // 2 - lines.start, lines.stop - 1 - side // 2, 0)
        for side, lines in zip(filled.shape, _extents(filled), strict=True)
    ]
    return kernel._replace(reach=(reaches[1], reaches[0]))


def _key(what: tuple[object, ...]) -> bytes | None:
    """Return a digest; None if something may change that is not in it."""
    formulas = _formulas()
    digest = hashlib.blake2b(formulas or b"", digest_size=32)
    return digest.digest() if formulas and _update(digest, what) else None


def _update(digest: Any, value: Any) -> bool:
    """Add a value to a digest; return whether it and all that it contains is known."""
    array = getattr(value, "array", None)
    if value is None or isinstance(value, bool | int | float | str):
        digest.update(f"{value!r}\n".encode())
        return True
    if isinstance(array, np.ndarray):
        digest.update(f"{array.shape}\n".encode())
        digest.update(array)
        return True
    if isinstance(value, tuple):
        digest.update(f"{len(value)}\n".encode())
        return all(_update(digest, item) for item in value)
    kind = type(value)
    is_pure = dataclasses.is_dataclass(kind) and defining_module(kind) in _PURE_MODULES
    if not is_pure or not _is_there(kind):
        return False
    digest.update(f"{kind.__name__}\n".encode())
    return all(_update(digest, getattr(value, field.name)) for field in dataclasses.fields(kind))


def _is_there(kind: type[Any]) -> bool:
    """Return whether a class is the one that its module has under its name."""
    return getattr(sys.modules.get(defining_module(kind)), kind.__name__, None) is kind


@functools.cache
def _formulas() -> bytes | None:
    """Return a digest of the source of all formulas; None if it cannot be read."""
    digest = hashlib.blake2b(np.__version__.encode())
    folders = [_PACKAGE / name for name in ("_psf", "_methods", "_glare")]
    try:
        for file in (
            _PACKAGE / "_core_kernel.py",
            *sorted(f for base in folders for f in base.glob("*.py")),
        ):
            digest.update(file.read_bytes())
    except OSError:
        return None
    return digest.digest()


def _pack(kernel: CoreKernel) -> bytes:
    """Return the content of a kernel's file."""
    height, width = kernel.pixels.shape[:2]
    filled = np.asarray(kernel.pixels.any(axis=2))
    rows, columns = _extents(filled)
    part = kernel.pixels[rows, columns]
    sides = width, height, columns.start, rows.start, part.shape[1], part.shape[0], part.shape[2]
    return _HEADER.pack(kernel.serial, *kernel.reach, *sides) + part.tobytes()


def _extents(filled: NDArray[np.bool_]) -> list[slice]:
    """Return the first to the last of the rows, and of the columns, that have a True."""
    lines = [np.flatnonzero(filled.any(axis=axis)) for axis in (1, 0)]
    return [slice(int(at[0]), int(at[-1]) + 1) if len(at) else slice(0, 0) for at in lines]


def _unpack(data: bytes) -> CoreKernel:
    """Return the kernel of a file."""
    serial, *reach, width, height, left, top, across, down, channels = _HEADER.unpack_from(data)
    values: NDArray[np.float32] = np.frombuffer(data, np.float32, offset=_HEADER.size)
    part = values.reshape(down, across, channels)
    if (down, across) == (height, width):
        return CoreKernel(part, serial, reach=(reach[0], reach[1]))
    pixels = np.zeros((height, width, channels), np.float32)
    pixels[top : top + down, left : left + across] = part
    return CoreKernel(pixels, serial, reach=(reach[0], reach[1]))
