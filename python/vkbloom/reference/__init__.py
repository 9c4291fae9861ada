"""The bloom methods in NumPy and float64, written only from the formulas.

It is slow, simple and independent of the device code. Tests compare rendered images with it.

`apply` returns all framebuffers of an image, `passes` and `blur` only those of the blur,
`composite` the final image, `gain` the bloom of a flat image of 1, `shade` the light of the
deferred system, and `vjp` the framebuffers with their derivatives.
"""

from __future__ import annotations

from ._compositing import composite
from ._derivatives import vjp
from ._framebuffers import apply, blur, gain, passes
from ._shading import shade

__all__ = ["apply", "blur", "composite", "gain", "passes", "shade", "vjp"]
