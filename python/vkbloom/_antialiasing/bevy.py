"""The temporal anti-aliasing of Bevy."""

from __future__ import annotations

import dataclasses
from typing import ClassVar

from vkbloom._public import public
from vkbloom._settings.antialiasing import Antialiasing
from vkbloom._settings.fields import number_field


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class BevyAntialiasing(Antialiasing):
    """The temporal anti-aliasing of Bevy.

    Parameters
    ----------
    weight : float
        Largest share of this frame in the result, 0 to 1, where it has a history.
    min_weight : float
        Smallest share, 0.001 to 1, which is reached where nothing moves.
    still : float
        Pixels per frame along each axis, 0 to 64, below which nothing moves.
    order : {"before", "after"}
        As of `Antialiasing`.

    Notes
    -----
    `depth` is larger where the surface is nearer. The motion of a pixel is that of the nearest of
    itself and of four pixels, two rows and columns away. Colours are c / (1 + max(r, g, b)), and
    the history keeps them so, with the confidence in its alpha. Confidence is read at the pixel
    itself, not where it was in the frame before, as in the engine.

    Source: bevyengine/bevy, taa.wesl @ 4805ca792c3e (MIT or Apache-2.0).
    """

    engine: ClassVar[str] = "bevy"

    weight: float = number_field(default=0.1, range=(0.0, 1.0))
    min_weight: float = number_field(default=0.015, range=(1e-3, 1.0))
    still: float = number_field(default=0.01, range=(0.0, 64.0), unit="px")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.min_weight > self.weight:
            raise ValueError(
                f"min_weight: {self.min_weight!r} is not at most weight, {self.weight!r}"
            )

    def _core_numbers_of_frame(self) -> dict[str, float]:
        return {"weight": self.weight, "min_weight": self.min_weight, "still": self.still}
