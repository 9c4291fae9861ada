"""The peers: other libraries that do the same, each made as fast as its interface allows.

One module a library, which imports it when a function is called.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable
from importlib.metadata import PackageNotFoundError, packages_distributions, version
from importlib.util import find_spec
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

__all__ = ["PEERS", "ImageBloom", "gather", "versions"]

#: Import names by the names in tables.
PEERS: Final = MappingProxyType(
    {
        "OpenCV": "cv2",
        "SciPy": "scipy",
        "scikit-image": "skimage",
        "PyTorch": "torch",
        "CuPy": "cupy",
        "pygfx": "pygfx",
        "wgpu": "wgpu",
    }
)

ImageBloom = Callable[[NDArray[Any]], NDArray[Any]]


def versions() -> dict[str, str | None]:
    """Return the version of each peer by its name, None for what is not installed."""
    distributions = packages_distributions()
    found: dict[str, str | None] = {}
    for name, package in PEERS.items():
        try:
            found[name] = version(distributions[package][0])
        except (KeyError, PackageNotFoundError):
            found[name] = None
    return found


def gather(
    names: Iterable[str], make: Callable[[Any], dict[str, Any]], missing: list[str]
) -> dict[str, Any]:
    """Collect the contenders of several peers.

    Parameters
    ----------
    names : iterable of str
        Out of `PEERS`.
    make : callable
        Takes the module of this package for a peer and returns its contenders by name.
    missing : list of str
        Gets a line for each peer that is not installed or does not work here.

    Returns
    -------
    dict
        The contenders of those that work.
    """
    found: dict[str, Any] = {}
    for name in names:
        if find_spec(PEERS[name]) is None:
            missing.append(f"{name} is not installed")
            continue
        module = name.lower().replace("-", "_")
        try:
            found.update(make(importlib.import_module(f"{__name__}.{module}")))
        except (ImportError, OSError, RuntimeError, AttributeError) as error:
            # A peer that is half installed, or has no device, must not stop the others.
            missing.append(f"{name} does not run here: {' '.join(str(error).split())[:200]}")
    return found


def rounded(values: NDArray[Any], dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return float values as `dtype`, levels of 8 bits rounded and clamped."""
    levels = np.rint(np.clip(values, 0, 255)) if dtype == np.uint8 else values
    result: NDArray[Any] = levels.astype(dtype, copy=False)
    return result
