"""Find settings: of a picture, of another method, of a point-spread function."""

from __future__ import annotations

from vkbloom._fit.fitting import fit
from vkbloom._fit.pyramids import fit_pyramid
from vkbloom._fit.result import FitResult
from vkbloom._fit.translating import translate

__all__ = ["FitResult", "fit", "fit_pyramid", "translate"]
