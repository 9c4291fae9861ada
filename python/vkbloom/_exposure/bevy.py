"""The automatic exposure of Bevy."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from vkbloom._exposure.mask import read_mask
from vkbloom._public import public
from vkbloom._settings.exposure import Exposure, check_ends
from vkbloom._settings.fields import number_field, numbers_field, value_field


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class BevyExposure(Exposure):
    """The automatic exposure of Bevy, by a histogram.

    Parameters
    ----------
    range_min, range_max : float
        Least and largest log2 of the luminance that is metered, -32 to 32 stops.
    filter_min, filter_max : float
        Shares of the histogram, 0 to 1: what is darker than the first, and what is brighter than
        the second does not count.
    speed_brighten, speed_darken : float
        Stops per second, 0 to 1000, at which the exposure follows a scene that became brighter, or
        darker.
    transition : float
        Distance from the goal in stops, above 0 to 100, within which the exposure slows down.
    mask : array-like, shape (h, w), or None
        Weights of 0 to 1 (uint8 is read as value / 255). None: all pixels count alike.
    compensation : sequence of (float, float)
        Metered log2 luminance and the stops that are added there, 2 to 16 points, from the darkest
        one. Between two points the stops are interpolated linearly, and stored as 256 bytes.

    Notes
    -----
    Bins are stored of 62 steps, and averaged as of 63, so that the goal is too dark by up to a
    quarter of a stop. A step of more than ``transition / speed`` seconds goes beyond the goal. Both
    are as in the engine. The bloom reads light without exposure.

    Source: bevyengine/bevy, crates/bevy_post_process/src/auto_exposure @ 4805ca792c3e (MIT or
    Apache-2.0).
    """

    engine: ClassVar[str] = "bevy"
    _exposes_picture: ClassVar[bool] = True

    range_min: float = number_field(default=-8.0, range=(-32.0, 32.0), unit="stop")
    range_max: float = number_field(default=8.0, range=(-32.0, 32.0), unit="stop")
    filter_min: float = number_field(default=0.1, range=(0.0, 1.0))
    filter_max: float = number_field(default=0.9, range=(0.0, 1.0))
    speed_brighten: float = number_field(default=3.0, range=(0.0, 1000.0), unit="stop/s")
    speed_darken: float = number_field(default=1.0, range=(0.0, 1000.0), unit="stop/s")
    transition: float = number_field(default=1.5, range=(1e-4, 100.0), unit="stop")
    mask: Any = value_field(None, optional=True, read=read_mask)
    compensation: tuple[tuple[float, float], ...] = numbers_field(
        ((-8.0, 0.0), (8.0, 0.0)), -32.0, 32.0, count=(2, 16), unit="stop"
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        check_ends(self, "range_min", "range_max", apart=True)
        check_ends(self, "filter_min", "filter_max")
        places = [place for place, _ in self.compensation]
        if any(later <= place for place, later in itertools.pairwise(places)):
            raise ValueError(f"compensation: the luminances {places} do not increase")

    def _numbers_of_step(self, dt: float) -> dict[str, float]:
        places = [place for place, _ in self.compensation]
        return {
            "low": self.range_min,
            "high": self.range_max,
            "cut_low": self.filter_min,
            "cut_high": self.filter_max,
            "step_up": self.speed_brighten * dt,
            "step_down": self.speed_darken * dt,
            "scale": self.transition,
            "masked": self.mask is not None,
            "table_low": places[0],
            "table_high": places[-1],
        }

    def _core_table(self) -> Sequence[float]:
        levels, _, _, least, spread = self.compensation_table()
        return [float(stops) for stops in least + spread * (levels / 255)]

    def compensation_table(self) -> tuple[NDArray[np.uint8], float, float, float, float]:
        """Return bytes, the ends of luminance, the least stops and the range of stops."""
        x, y = np.array(self.compensation, np.float64).T
        spread = y.max() - y.min()
        stops = np.interp(np.linspace(x[0], x[-1], 256), x, y)
        levels = (stops - y.min()) / spread * 255 if spread > 0 else np.zeros(256)
        # Rounded down, but not a whole number that is an error of floats below itself.
        return (levels + 1e-9).astype(np.uint8), x[0], x[-1], y.min(), spread
