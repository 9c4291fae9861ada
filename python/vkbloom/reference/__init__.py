"""The bloom methods in NumPy and float64, written only from the formulas.

It is slow, simple and independent of the device code. Tests compare rendered images with it.

`apply` returns all framebuffers of an image, `passes` and `blur` only those of the blur,
`composite` the final image, `gain` the bloom of a flat image of 1, `shade` the light of the
deferred system, and `vjp` the framebuffers with their derivatives.

All but `gain` and `vjp` also run on arrays of other libraries, such as PyTorch, CuPy and JAX, and
return such arrays, on their device (the extra `arrays`).
"""

from __future__ import annotations

import lazy_loader

# Modules are imported at the first use of a name. Imported here, they could meet a thread that
# imports one of them and waits for this module: Python then gives one of the threads half a module.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
