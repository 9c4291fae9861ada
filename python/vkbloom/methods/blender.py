"""The bloom of Blender's compositor."""

from __future__ import annotations

import dataclasses
from typing import ClassVar

from vkbloom.fields import choice_field, number_field
from vkbloom.settings import BloomFormat, Composite, Settings, no_knee


@dataclasses.dataclass(frozen=True, kw_only=True)
class BlenderGlare(Settings):
    """The bloom of Blender's Glare node, in high quality.

    Parameters
    ----------
    threshold : float or None
        Brightest channel from which a colour glows.
    smoothness : float
        Width of the soft parts of the threshold and of the maximum, 0 to 1.
    size : float
        Size of the glare as a share of the frame, 0 to 1.
    maximum : float or None
        Largest brightness above the threshold, 0 to 65504. None: no limit.
    composite : {"add"}
    intensity : float
        The node's strength, 0 to 1.
    **settings
        The other fields of `Settings`; there is no knee.

    See Also
    --------
    presets : "blender_bloom".

    Notes
    -----
    There are n = floor(log2(size * shorter side)) levels, at least one. ``down_0`` has the size of
    the frame. With v the brightest channel of a colour c, it is c (v' - threshold) / v, or 0 if
    v <= 0, with v' = smooth_min(smooth_max(v, threshold), threshold + maximum). smooth_min(a, b) is
    min(a, b) - h^2 k / 4 with h = max(1 - abs(a - b) / k, 0), and smooth_max is its mirror image. k
    is the smoothness, but not more than the distance of the end from 0 and from the other end.

    Each next level has half the size of the one before, floored, by the 13 taps of `Pyramid`. For
    ``down_1``, the four taps of each group are weighted by 1 / (1 + brightest channel).
    up_k = down_k + tent(up_k+1) with a tent of one pixel of the larger level, and ``bloom`` is
    up_0 / n. The other qualities, saturation and tint are not supported.

    Source: the formulas of the compositor of Blender 4.5, source/blender/nodes/composite/nodes/
    node_composite_glare.cc.

    Examples
    --------
    >>> vkbloom.BlenderGlare(size=0.25).size
    0.25
    """

    method: ClassVar[str] = "blender"
    published: ClassVar[bool] = True

    threshold: float | None = 1.0
    knee: float = no_knee("blender")
    composite: Composite = choice_field("composite", ("add",))
    intensity: float = number_field("intensity", range=(0, 1))
    format: BloomFormat | None = "rgba16float"
    smoothness: float = number_field("smoothness")
    # On the command line, --size is the size of a frame.
    size: float = number_field("size", option="glare-size")
    maximum: float | None = number_field("maximum", default=None, slider=(0, 20))
