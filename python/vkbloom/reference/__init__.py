"""The bloom methods in NumPy and float64, written from the formulas alone.

Slow, simple and independent of the device code: what a picture is compared with.

`apply` gives all framebuffers of an image, `passes` and `blur` those of the blur alone,
`composite` the final image, `gain` what a method does to a flat image of 1, and `shade` the light
of the deferred system.
"""

from __future__ import annotations

from .compositing import composite
from .framebuffers import apply, blur, gain, passes
from .shading import shade

__all__ = ["apply", "blur", "composite", "gain", "passes", "shade"]
