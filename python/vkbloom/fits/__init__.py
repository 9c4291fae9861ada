"""Find settings: of a picture, of another method, of a point-spread function."""

from __future__ import annotations

from vkbloom.fits.fitting import fit
from vkbloom.fits.pyramids import fit_pyramid
from vkbloom.fits.result import FitResult
from vkbloom.fits.translating import translate

__all__ = ["FitResult", "fit", "fit_pyramid", "translate"]
