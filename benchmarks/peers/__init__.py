"""The peers: other libraries that do the same work, each used as fast as its interface allows.

There is one module for each library. It imports the library when a function is called.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable
from importlib.metadata import PackageNotFoundError, packages_distributions, version
from importlib.util import find_spec
from types import MappingProxyType
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.results import Table
from benchmarks.timing import Times

__all__ = ["COPY", "PEERS", "GpuWork", "ImageBloom", "bandwidths", "gather", "versions"]

#: Import name of each peer, by its name in tables.
PEERS: Final = MappingProxyType(
    {
        "OpenCV": "cv2",
        "SciPy": "scipy",
        "ducc0": "ducc0",
        "scikit-image": "skimage",
        "PyTorch": "torch",
        "CuPy": "cupy",
        "VkFFT": "pyvkfft",
        "CV-CUDA": "cvcuda",
        "pygfx": "pygfx",
        "wgpu": "wgpu",
        "optiland": "optiland",
        "photutils": "photutils",
    }
)

ImageBloom = Callable[[NDArray[Any]], NDArray[Any]]

#: The contender that copies an image's bytes from device memory to device memory.
COPY: Final = "plain copy on the device"


# What a peer raises with a broken installation, without a device, or in another version.
_BROKEN: Final = (ImportError, OSError, RuntimeError, AttributeError, TypeError, ValueError)


class GpuWork(NamedTuple):
    """Work on a GPU.

    Attributes
    ----------
    call : callable
        Takes the round and does the work once.
    seconds : callable
        Takes a result of `call` and returns the time by CUDA events.
    fetch : callable
        Takes a result of `call` and returns its picture.
    """

    call: Callable[[int], Any]
    seconds: Callable[[Any], float]
    fetch: Callable[[Any], NDArray[Any]]


def versions() -> dict[str, str | None]:
    """Return the version of each peer by its name, None for peers that are not installed."""
    distributions = packages_distributions()
    found: dict[str, str | None] = {}
    for name, package in PEERS.items():
        try:
            # A package that is one extension module has no entry.
            found[name] = version(distributions.get(package, [package])[0])
        except PackageNotFoundError:
            found[name] = None
    return found


def gather(
    names: Iterable[str], make: Callable[[Any], dict[str, Any]], missing: list[str]
) -> dict[str, Any]:
    """Collect the contenders of several peers.

    Parameters
    ----------
    names : iterable of str
        Keys of `PEERS`.
    make : callable
        Takes the module of this package for a peer and returns its contenders by name.
    missing : list of str
        Gets a line for each peer that is not installed or does not work here.

    Returns
    -------
    dict
        The contenders of the peers that work.
    """
    found: dict[str, Any] = {}
    for name in names:
        if find_spec(PEERS[name]) is None:
            missing.append(f"{name} is not installed")
            continue
        module = name.lower().replace("-", "_")
        try:
            found.update(make(importlib.import_module(f"{__name__}.{module}")))
        except _BROKEN as error:
            # It must not stop the others.
            missing.append(f"{name} does not run here: {' '.join(str(error).split())[:200]}")
    return found


def bandwidths(group: str, times: dict[str, Times], size: int, names: Iterable[str]) -> list[Table]:
    """Return a table of an image of `size` bytes that is read and written once, beside COPY."""
    if COPY not in times:
        return []
    rows = tuple(
        (
            name,
            f"{2 * size / times[name].median / 1e9:.0f}",
            f"{times[COPY].median / times[name].median:.3f}",
        )
        for name in names
        if name in times
    )
    header = ("", "GB/s", "share of the copy")
    return [Table(f"{group}: image read once and written once", header, rows)]


def round_to(values: NDArray[Any], dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return float values as `dtype`; 8-bit levels are rounded and clamped."""
    levels = np.rint(np.clip(values, 0, 255)) if dtype == np.uint8 else values
    result: NDArray[Any] = levels.astype(dtype, copy=False)
    return result
