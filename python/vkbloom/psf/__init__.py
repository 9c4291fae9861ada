"""Point-spread functions: how the light of a point is distributed over a picture.

There are functions of the eye (`spencer`, `cie_general`, `cie_total`), of lenses (`harvey_shack`,
`airy`, `aperture` with `iris`), of renderers (`fog_glow`, `unreal`) and of settings (`measured`).
`gaussian` and `samples` are general. All are subclasses of `PSF`. `vkbloom.Convolution` convolves
an image with any of them.
"""

from __future__ import annotations

from .aperture import aperture, iris
from .base import PSF
from .eye import cie_general, cie_total, spencer
from .lens import airy, gaussian, harvey_shack
from .measuring import measured
from .renderers import fog_glow, unreal
from .sampled import samples

__all__ = [
    "PSF",
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
    "unreal",
]
