"""Bloom of Babylon.js."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar

from vkbloom._formats import MAX_HALF
from vkbloom._public import public
from vkbloom._settings.fields import number_field
from vkbloom._settings.pass_sentences import BLURRED_DOWN
from vkbloom._settings.settings import PublishedSettings


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class BabylonBloom(PublishedSettings):
    """Bloom of Babylon.js' DefaultRenderingPipeline.

    Parameters
    ----------
    kernel : float
        Width of the blur in pixels of the frame, 1 to 256; times `scale` at most 129.
    scale : float
        Size of the blurred image as a share of the frame's, 0.01 to 1.
    weight : float
        Factor of the bloom in ``final``, 0 to 65504; `intensity` multiplies it.
    threshold : float or None
        A colour is kept if its luminance is at least threshold^(1 / 2.2), 0 to 65504.
    composite : {"add"}
    **settings
        The other fields of `Settings`; there is no knee.

    Raises
    ------
    ValueError
        `kernel` times `scale` is above 129.

    Notes
    -----
    ``bright`` is one bilinear tap at `scale` times the frame's size, floored, with the threshold.
    The blur has N weights exp(-4.5 (2 i / (N - 1) - 1)^2), i = 0..N-1, which add up to 1; N is the
    number nearest to kernel * scale that is 1 modulo 4. ``down_0`` is ``bright``, blurred along x,
    then along y; ``bloom`` is one bilinear sample of it.

    Source: BabylonJS/Babylon.js, extractHighlights.fragment.fx @ bc81a5f32960,
    kernelBlur.fragment.fx @ 445b0404049f, bloomMerge.fragment.fx @ 02e530f440cd,
    thinBlurPostProcess.ts @ 076e49a15333, bloomEffect.ts @ 05c105649f04.
    """

    method: ClassVar[str] = "babylon"
    _knobs: ClassVar[tuple[str, ...]] = ("threshold", "kernel")
    _fields_before_composite: ClassVar[frozenset[str]] = frozenset(("intensity",))
    _pass_sentences: ClassVar[Mapping[str, str]] = MappingProxyType({"down": BLURRED_DOWN})
    _threshold_fields: ClassVar[tuple[str, ...]] = ("threshold",)

    threshold: float | None = number_field(default=0.9, slider=(0, 4))
    kernel: float = number_field(
        default=64.0, range=(1, 256), option="kernel-width", differentiable=False
    )
    scale: float = number_field(default=0.5, range=(0.01, 1), differentiable=False)
    weight: float = number_field(default=0.15, range=(0, MAX_HALF), slider=(0, 2))

    def _check_together(self) -> None:
        if self.kernel * self.scale > 129:
            raise ValueError(
                f"kernel: {self.kernel:g} times the scale {self.scale:g} is out of range, up to 129"
            )

    @property
    def blur_weights(self) -> tuple[float, ...]:
        """The weights of the taps 0, 1, ... to each side."""
        wanted = math.floor(max(self.kernel * self.scale, 1) + 0.5)
        steps = (step for step in (0, -1, 1, -2, 2) if wanted + step > 0)
        count = next((wanted + step for step in steps if (wanted + step) % 4 == 1), wanted)
        middle = (max(count, 3) - 1) // 2
        sides = [math.exp(-4.5 * (i / middle) ** 2) for i in range(middle + 1)]
        total = sides[0] + 2 * sum(sides[1:])
        if middle % 2:
            # The middle is half of two samples, whose position is that of the whole middle.
            share, pair = sides[0] / (sides[0] + sides[1]), sides[1] + sides[0] / 2
            sides[:2] = 2 * share * pair, (1 - share) * pair
        return tuple(weight / total for weight in sides)

    def _core_values(self) -> dict[str, Any]:
        """Return what the core names or counts otherwise."""
        return {
            "kernel": None,
            "scale_x": self.scale,
            "weights": self.blur_weights,
            "intensity": self.intensity * self.weight,
        }

    def _threshold_slopes(self) -> dict[str, float]:
        # A step.
        return {"threshold": 0.0}
