# The names of `vkbloom._gradients`; lazy_loader reads them, and imports what is asked for.
from .passes import on_device
from .pulling import Pullback, pull_each, pullback_of, vjp

__all__ = [
    "Pullback",
    "on_device",
    "pull_each",
    "pullback_of",
    "vjp",
]
