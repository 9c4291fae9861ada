"""Find settings: of a picture, of another method, of a point-spread function."""

from __future__ import annotations

from vkbloom.fits.fitting import fit
from vkbloom.fits.result import FitResult

__all__ = ["FitResult", "fit"]
