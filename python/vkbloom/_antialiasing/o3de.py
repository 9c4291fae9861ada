"""The temporal anti-aliasing of O3DE."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import ClassVar

from vkbloom._public import public
from vkbloom._settings.antialiasing import Antialiasing, gaussian_weights, read_jitter
from vkbloom._settings.fields import number_field, value_field


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class O3deAntialiasing(Antialiasing):
    """The temporal anti-aliasing of O3DE.

    Parameters
    ----------
    weight : float
        Share of this frame in the result, 0 to 1.
    gamma : float
        Standard deviations of 3 x 3 pixels from their mean within which the history stays, 0 to 16.
    damping : float
        Standard deviations by which this frame may differ from the history, 0 to 16, before its
        share is reduced.
    jitter : (float, float) or None
        Offset of the camera in this frame, pixels to the right and down, -1 to 1, by which this
        frame is filtered. None: that of the engine in the frame of this number, `offset`; the
        number is counted in the alpha of the history.
    order : {"before", "after"}
        As of `Antialiasing`.

    Notes
    -----
    `depth` is smaller where the surface is nearer. The motion of a pixel is that of the nearest of
    3 x 3 pixels. Pixels outside of the frame are black, with a depth and a motion of 0, so that a
    border of one pixel takes the motion 0, as in the engine. The history begins as black.

    Source: o3de/o3de, Taa.azsl and TaaPass.cpp @ 354a2accd2a2 (Apache-2.0 or MIT).
    """

    engine: ClassVar[str] = "o3de"

    weight: float = number_field(default=0.1, range=(0.0, 1.0))
    gamma: float = number_field(default=1.0, range=(0.0, 16.0))
    damping: float = number_field(default=0.5, range=(0.0, 16.0))
    jitter: tuple[float, float] | None = value_field(None, optional=True, read=read_jitter)

    def offset(self, frame: int) -> tuple[float, float]:
        """As of `Antialiasing`, but up is down: the engine's y points upwards."""
        x, y = super().offset(frame)
        return x, -y

    def _core_numbers_of_frame(self) -> dict[str, float]:
        return {"weight": self.weight, "gamma": self.gamma, "damping": self.damping}

    def filter_weights(self) -> Sequence[Sequence[float]]:
        """Return exp(-2.29 d^2), with d from minus two offsets, which are clip units, on."""
        own = self.jitter
        offsets = [own] if own is not None else [*map(self.offset, range(self.phases))]
        return gaussian_weights(offsets, 2.29, -2.0)
