"""The separable blur of the forward and deferred systems."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar, Literal

from vkbloom import _core
from vkbloom._argument_types import check_arguments
from vkbloom._formats import MAX_FLOAT
from vkbloom._numbers import check_above, check_index
from vkbloom._public import public
from vkbloom._settings.fields import choice_field, flag_field, number_field, numbers_field
from vkbloom._settings.pass_sentences import BLURRED_AT_ONCE
from vkbloom._settings.settings import Settings

Texel = Literal["own", "x"]

#: The half-kernel of the forward system: w0 at the centre, w1..w4 to both sides.
TUTORIAL: tuple[float, ...] = (0.227027, 0.1945946, 0.1216216, 0.054054, 0.016216)


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class Separable(Settings):
    """A blur by a symmetric kernel, first vertical, then horizontal.

    One pass computes w0 c(0) + strength * sum of w_i (c(+i) + c(-i)) over i = 1..n. Its taps are
    ``blur_scale`` texels of the bloom buffer apart, filtered bilinearly and clamped to the edge.
    All passes but the last run at the size of the bloom buffers; the last is evaluated at every
    pixel of ``final``.

    Parameters
    ----------
    blur_scale : float
        Distance of the taps in texels, 0 to 16.
    blur_strength : float
        Factor of all taps except the centre, 0 to 16.
    weights : sequence of float
        Half-kernel w0..wn, 1 to 65 of them.
    loops : int
        How often the vertical and horizontal passes are repeated, 1 to 16 times.
    layers : sequence of (float, float)
        (scale, strength), 1 to 8 of them, each number 0 to 16. Each layer is a complete blur at
        blur_scale * scale; the blurs are added with their strengths.
    first_tap : {1, 0}
        First index of the sum, 0 or 1. 0: the sum includes the centre, whose weight becomes
        w0 (1 + 2 strength).
    texel : {"own", "x"}
        Step of the vertical pass. "own": 1 / height of the texture; "x": 1 / width, as in the
        horizontal pass.
    direct : bool
        Whether to apply the kernel as one pass of N x N taps instead of two of N.
    **settings
        The fields of `Settings`.

    Notes
    -----
    Source: the forward system and the outline system, which differ in `first_tap` and `texel`.
    """

    method: ClassVar[str] = "separable"
    _knobs: ClassVar[tuple[str, ...]] = ("blur_scale", "blur_strength")
    _pass_sentences: ClassVar[Mapping[str, str]] = MappingProxyType(
        {"bloom": "blurs along the rows, which completes the blur"}
    )

    blur_scale: float = number_field(unit="texel", slider=(0.1, 2))
    blur_strength: float = number_field(slider=(0, 4))
    weights: tuple[float, ...] = numbers_field(
        TUTORIAL, -MAX_FLOAT, MAX_FLOAT, count=(1, _core.MAX_WEIGHTS)
    )
    loops: int = number_field(slider=(1, 8))
    layers: tuple[tuple[float, float], ...] = numbers_field(
        ((1.0, 1.0),), 0, 16, count=(1, _core.MAX_LAYERS)
    )
    first_tap: int = number_field()
    texel: Texel = choice_field()
    direct: bool = flag_field()

    def _pass_sentence(self, stem: str) -> str:
        if stem == "bloom" and self.direct:
            return BLURRED_AT_ONCE
        return super()._pass_sentence(stem)

    @property
    def _first_stages(self) -> tuple[str, ...]:
        return ("glow", "blur_vertical") if self.loops == 1 else ("glow",)

    def _hidden_stores(self, framebuffer: str) -> int:
        """Return the passes along x, those of earlier loops, and the sums of layers."""
        if framebuffer == "glow" or not self.bloom:
            return 0
        return 2 * (self.loops - 1) + len(self.layers) - 1


@public("vkbloom")
@check_arguments
def gaussian_weights(sigma: float, radius: int | None = None) -> tuple[float, ...]:
    """Make a normalized Gaussian half-kernel.

    Parameters
    ----------
    sigma : float
        Standard deviation in taps, above 0.
    radius : int, optional
        Number of taps on each side, 0 to 64. Default: ceil(3 sigma), at most 64.

    Returns
    -------
    tuple of float
        w0..w_radius with w_i proportional to exp(-i^2 / (2 sigma^2)) and
        w0 + 2 (w1 + ... + w_radius) = 1.
    """
    limit = _core.MAX_WEIGHTS - 1
    deviation = check_above("sigma", sigma)
    if radius is None:
        radius = math.ceil(min(3 * deviation, limit))
    radius = check_index("radius", radius, 0, limit)
    # A product becomes infinity where the operator ** would raise OverflowError.
    distances = [tap / deviation for tap in range(radius + 1)]
    weights = [math.exp(-0.5 * distance * distance) for distance in distances]
    total = weights[0] + 2 * sum(weights[1:])
    return tuple(weight / total for weight in weights)
