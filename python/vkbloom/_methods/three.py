"""Bloom of three.js."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Literal

from vkbloom._public import public
from vkbloom._settings.fields import choice_field, number_field, numbers_field
from vkbloom._settings.pass_sentences import BLURRED_DOWN
from vkbloom._settings.settings import PublishedSettings

Variant = Literal["r185", "r187", "node"]
Tint = tuple[float, float, float]


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class ThreeBloom(PublishedSettings):
    """three.js' UnrealBloomPass, and BloomNode, its successor for WebGPU.

    Parameters
    ----------
    variant : {"r185", "r187", "node"}
        UnrealBloomPass of these releases, or BloomNode since r186.
    radius : float
        0 to 1. The factors of the levels are 1, 0.8, 0.6, 0.4, 0.2 at 0, and 0.2, 0.4, 0.6, 0.8, 1
        at 1.
    smooth_width : float
        Luminance over which the threshold fades in, 0.0001 to 65504.
    resolution_scale : float
        Of BloomNode: the size of ``bright`` as a share of the frame's, 0.01 to 1.
    tints : sequence of five (float, float, float)
        Factor of each level, 0 to 65504.
    threshold : float or None
        Luminance at which the fade begins.
    composite : {"add"}
    intensity : float
        Three times the strength of three.js. With "node" it is the strength itself, so that
        ``intensity=1`` is its default.
    **settings
        The other fields of `Settings`; there is no knee.

    Notes
    -----
    ``bright`` is one bilinear tap at half of the frame's size, rounded, times
    smoothstep(threshold, threshold + smooth_width, luminance). There are five levels. ``down_0``
    has the size of ``bright``, each next level half the size of the one before, rounded. Each is
    the image above it (``bright`` for ``down_0``), blurred along x, then along y. The taps are one
    pixel of the level apart. Their weights are 0.39894 exp(-i^2 / (2 sigma^2)) / sigma with
    -R < i < R, R = 6, 10, 14, 18, 22 and sigma = R / 3, not normalized. ``up_0`` is the sum of the
    levels, enlarged bilinearly and multiplied by their factors and tints; ``bloom`` is one bilinear
    sample of it. In "rgba8unorm", up_0 is a third of that.

    "r187" and "node" read the taps 2 n - 1 and 2 n as one bilinear sample between them. This is
    another blur where a level is read at twice its size. Their luminance has the weights of
    Rec. 709 with four digits. The sizes of "node" are floored, but at least 1.

    Source: mrdoob/three.js, examples/jsm/postprocessing/UnrealBloomPass.js since pull requests
    #31528 (kernels), #32517 (factor 3) and #34479 (samples of two taps),
    examples/jsm/shaders/LuminosityHighPassShader.js @ 0255e15dd1d4,
    examples/jsm/tsl/display/BloomNode.js @ 07e4c12b3840, whose defaults these are, since the pass
    has none for radius and threshold.
    """

    method: ClassVar[str] = "three"
    _knobs: ClassVar[tuple[str, ...]] = ("threshold", "radius")
    _pass_sentences: ClassVar[Mapping[str, str]] = MappingProxyType({"down": BLURRED_DOWN})
    _threshold_fields: ClassVar[tuple[str, ...]] = ("threshold", "smooth_width")

    threshold: float | None = 0.0
    intensity: float = number_field(default=3.0)
    variant: Variant = choice_field()
    radius: float = number_field(default=0.0, range=(0, 1))
    smooth_width: float = number_field(slider=(0.01, 1))
    resolution_scale: float = number_field(default=0.5, range=(0.01, 1), differentiable=False)
    tints: tuple[Tint, ...] = numbers_field(
        ((1.0, 1.0, 1.0),) * 5, kind="pairs", option="level-tints"
    )

    def _core_values(self) -> dict[str, Any]:
        """Return what the core names or counts otherwise."""
        return {"scale_x": self.resolution_scale, "level_weights": self.tints}
