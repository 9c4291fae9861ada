"""Point-spread functions: how the light of a point is distributed over a picture.

There are functions of the eye (`spencer`, `cie_general`, `cie_total`), of lenses (`harvey_shack`,
`airy`, `aperture` with `iris`, `star`), of renderers (`fog_glow`, `unreal`) and of settings
(`measured`). `gaussian` and `samples` are general. `Varying` depends on the place in the picture.
All are subclasses of `PSF`. `vkbloom.Convolution` convolves an image with any of them.
"""

# ruff: noqa: F403, F405  the names are imported at the first use

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from vkbloom import _psf
from vkbloom._settings.registry import FUNCTIONS

if TYPE_CHECKING:
    from vkbloom._measured import measured
    from vkbloom._psf import *

__all__ = [
    "PSF",
    "Gathered",
    "Varying",
    "airy",
    "aperture",
    "cie_general",
    "cie_total",
    "fog_glow",
    "gaussian",
    "harvey_shack",
    "iris",
    "measured",
    "samples",
    "spencer",
    "star",
    "unreal",
]


def __getattr__(name: str) -> Any:
    if name == "measured":
        from vkbloom._measured import measured  # noqa: PLC0415  costs start-up time

        return measured
    if name in __all__:
        return getattr(_psf, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__


def _classes() -> Mapping[str, type[Any]]:
    from vkbloom._measured import measured  # noqa: PLC0415  costs start-up time

    kinds = [measured, *(getattr(_psf, name) for name in dir(_psf) if name != "PSF")]
    return {kind.__name__: kind for kind in kinds if issubclass(kind, _psf.PSF)}


FUNCTIONS.fill(_classes)
