# The names of `vkbloom._psf`; lazy_loader reads them, and imports what is asked for.
from .apertures import aperture, iris
from .base import PSF
from .eye import cie_general, cie_total, spencer
from .lens import airy, gaussian, harvey_shack
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
    "samples",
    "spencer",
    "unreal",
]
