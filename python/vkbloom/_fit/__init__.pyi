# The names of `vkbloom._fit`; lazy_loader reads them, and imports what is asked for.
from .fitting import fit
from .pyramids import fit_pyramid
from .result import FitResult
from .translating import translate

__all__ = [
    "FitResult",
    "fit",
    "fit_pyramid",
    "translate",
]
