"""Point-spread functions: how the light of a point is distributed over a picture.

There are functions of the eye (`spencer`, `cie_general`, `cie_total`), of lenses (`harvey_shack`,
`airy`, `aperture` with `iris`), of renderers (`fog_glow`, `unreal`) and of settings (`measured`).
`gaussian` and `samples` are general. All are subclasses of `PSF`. `vkbloom.Convolution` convolves
an image with any of them.
"""

from __future__ import annotations

from ._aperture import aperture, iris
from ._base import PSF
from ._eye import cie_general, cie_total, spencer
from ._lens import airy, gaussian, harvey_shack
from ._measuring import measured
from ._renderers import fog_glow, unreal
from ._sampled import samples

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
