# The public names of `vkbloom.psf`; lazy_loader reads them, and imports what is asked for.
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
