# The public names of `vkbloom.reference`; lazy_loader reads them, and imports what is asked for.
from ._compositing import composite
from ._derivatives import vjp
from ._exposure import expose
from ._framebuffers import apply, blur, gain, passes
from ._shading import shade

__all__ = [
    "apply",
    "blur",
    "composite",
    "expose",
    "gain",
    "passes",
    "shade",
    "vjp",
]
