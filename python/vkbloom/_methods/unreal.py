"""Bloom of three.js, which has the name of Unreal Engine's."""

from __future__ import annotations

import dataclasses
from typing import ClassVar

from vkbloom._settings.fields import choice_field, flag_field, number_field
from vkbloom._settings.settings import BloomFormat, Composite, Settings, no_knee


@dataclasses.dataclass(frozen=True, kw_only=True)
class UnrealBloom(Settings):
    """three.js' UnrealBloomPass.

    Parameters
    ----------
    radius : float
        0 to 1. The factors of the levels are 1, 0.8, 0.6, 0.4, 0.2 at 0, and 0.2, 0.4, 0.6, 0.8, 1
        at 1.
    smooth_width : float
        Luminance over which the threshold fades in, 0.0001 to 65504.
    node : bool
        Whether to compute the bloom of BloomNode, the successor for WebGPU, which floors sizes.
    threshold : float or None
        Luminance at which the fade begins.
    composite : {"add"}
    intensity : float
        Three times the strength of three.js. With `node` it is the strength itself, so that
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
    levels, enlarged bilinearly and multiplied by their factors; ``bloom`` is one bilinear sample
    of it. In "rgba8unorm", up_0 is a third of that.

    With `node`, all halves are floored, but at least 1, and the luminance has the weights of
    Rec. 709 with four digits. Newer versions of BloomNode merge neighbouring taps into one bilinear
    fetch. This differs if a level is read at another size, and is not supported.

    Source: mrdoob/three.js, examples/jsm/postprocessing/UnrealBloomPass.js since pull requests
    #31528 (kernels) and #32517 (factor 3), examples/jsm/shaders/LuminosityHighPassShader.js
    @ 0255e15dd1d4; defaults of examples/jsm/tsl/display/BloomNode.js, since the pass has none
    for radius and threshold.

    Examples
    --------
    >>> vkbloom.UnrealBloom(radius=0.5, threshold=0.8).intensity
    3.0
    """

    method: ClassVar[str] = "unreal"
    published: ClassVar[bool] = True

    threshold: float | None = 0.0
    knee: float = no_knee("unreal")
    composite: Composite = choice_field("composite", ("add",))
    intensity: float = number_field("intensity", default=3.0)
    format: BloomFormat | None = "rgba16float"
    radius: float = number_field("radius", default=0.0, range=(0, 1))
    smooth_width: float = number_field("smooth_width", slider=(0.01, 1))
    node: bool = flag_field("node")
