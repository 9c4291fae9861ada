# The names of `vkbloom._fit`; lazy_loader reads them, and imports what is asked for.
from .fitting import fit
from .pyramids import fit_pyramid
from .recovery import RecoveredPSF, recover_psf
from .result import FitResult
from .translating import translate

__all__ = [
    "FitResult",
    "RecoveredPSF",
    "fit",
    "fit_pyramid",
    "recover_psf",
    "translate",
]
