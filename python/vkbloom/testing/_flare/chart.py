"""The charts of a flare report: where their black spots and lights are, and their pictures."""

from __future__ import annotations

import dataclasses
import functools
import json
import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._argument_types import check_arguments
from vkbloom._numbers import check_above, check_floats, check_number, check_size
from vkbloom._public import public

#: Black spots and lights.
COUNT: Final = 9
# Of the picture's diagonal: the radius of a black spot, and that of a light.
_SPOT: Final = 1 / 35
_LIGHT: Final = 1 / 140
#: Distance of the white areas from the middle of a spot, in radii of the spot.
WHITE_AT: Final = 2.0
#: Radius of the areas that are measured, in radii of the spot or of the light.
INNER: Final = 0.5
# By how much the shape of pictures may differ from that of their charts.
_SHAPE: Final = 0.02
# Points along a side of a pixel at the edge of a disc.
_FINE: Final = 16


@public("vkbloom.testing")
@dataclasses.dataclass(frozen=True, kw_only=True)
class FlareChart:
    """The charts of a flare report.

    Nine black spots or lights stand in the middles of nine equal parts of the picture, in rows from
    the top left. Positions are in pixels; the centre of the first pixel is (0, 0).

    Parameters
    ----------
    size : (int, int)
        Width and height in pixels.
    positions : sequence of (float, float), optional
        x and y of the nine middles. Default: rounded to pixels.
    radius : float, optional
        Of a black spot in pixels. Default: 1/35 of the diagonal, so that nine spots cover less than
        5 % of the picture.
    light_radius : float, optional
        Of a light in pixels. Default: 1/140 of the diagonal.
    mask_radius : float, optional
        Of the circle around a light that is left out, because it has the light's own image.
        Default: twice the light's radius.
    contrast : float
        White of the chart divided by its black, above 1; infinity: black has no light of its own.

    Examples
    --------
    >>> from vkbloom import testing
    >>> chart = testing.FlareChart(size=(120, 80))
    >>> chart.positions[:3]
    ((20.0, 13.0), (60.0, 13.0), (100.0, 13.0))
    >>> chart.draw("spot_4")[40, 60, 0], chart.draw("light_4")[40, 60, 0]
    (np.float32(0.0), np.float32(1.0))
    """

    size: tuple[int, int] = (480, 320)
    positions: Any = None
    radius: float | None = None
    light_radius: float | None = None
    mask_radius: float | None = None
    contrast: float = math.inf

    def __post_init__(self) -> None:
        size = check_size("size", self.size)
        diagonal = math.hypot(*size)
        radius = diagonal * _SPOT if self.radius is None else self.radius
        light = diagonal * _LIGHT if self.light_radius is None else self.light_radius
        light = check_above("light_radius", light)
        mask = 2 * light if self.mask_radius is None else self.mask_radius
        if check_above("mask_radius", mask) < light:
            raise ValueError(f"mask_radius: {mask!r} is less than the light's radius, {light:g}")
        values = {
            "size": size,
            "positions": _check_positions(self.positions, size),
            "radius": check_above("radius", radius),
            "light_radius": light,
            "mask_radius": float(mask),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)
        check_number("contrast", self.contrast, math.nextafter(1.0, 2.0), math.inf)
        self._check_room()

    def _check_room(self) -> None:
        """Raise ValueError if white areas beside a spot are outside or reach another spot."""
        reach = (WHITE_AT + INNER) * self.spot_radius
        for index, (x, y) in enumerate(self.positions):
            sides = (x, y, self.size[0] - 1 - x, self.size[1] - 1 - y)
            if min(sides) < reach - 0.5:
                raise ValueError(
                    f"positions: that of {index}, {(x, y)}, is less than {reach:.4g} pixels, 2.5 "
                    f"radii of a spot, from the border of {self.size}; give a smaller radius"
                )
            for other in self.positions[:index]:
                if math.dist((x, y), other) < reach + self.spot_radius:
                    raise ValueError(
                        f"positions: {(x, y)} and {other} are less than 3.5 radii of a spot, "
                        f"{reach + self.spot_radius:.4g} pixels, apart"
                    )

    @property
    def spot_radius(self) -> float:
        """`radius`, which is a number here."""
        return float(self.radius or 0.0)

    @property
    def source_radius(self) -> float:
        """`light_radius`, which is a number here."""
        return float(self.light_radius or 0.0)

    @property
    def left_out_radius(self) -> float:
        """`mask_radius`, which is a number here."""
        return float(self.mask_radius or 0.0)

    @property
    def names(self) -> tuple[str, ...]:
        """The charts that `draw` knows."""
        numbered = (f"{what}_{index}" for what in ("spot", "light") for index in range(COUNT))
        return ("chart", "black", *numbered, "diffuser")

    @check_arguments
    def draw(self, name: str) -> NDArray[np.float32]:
        """Return a chart to show, to print, or to give to a bloom.

        Parameters
        ----------
        name : str
            "chart": nine black spots in white. "black": no white. "spot_0" to "spot_8": one black
            spot in white. "light_0" to "light_8": one light in the dark. "diffuser": white.

        Returns
        -------
        ndarray of float32, shape (H, W, 3)
            Linear light, white 1. Edges are the shares of the pixels that a disc covers.
        """
        if name not in self.names:
            raise ValueError(f"name: {name!r} is not one of {', '.join(self.names)}")
        what, _, number = name.partition("_")
        chosen = self.positions if not number else (self.positions[int(number)],)
        covered = np.zeros((self.size[1], self.size[0]))
        if what in ("chart", "spot", "light"):
            radius = self.source_radius if what == "light" else self.spot_radius
            for position in chosen:
                window, share = disc(self.size, position, radius)
                covered[window] += share
        black = 1 / self.contrast
        if what in ("chart", "spot"):
            plane = 1 - (1 - black) * covered
        else:
            plane = covered + {"black": black, "diffuser": 1.0}.get(what, 0.0)
        return np.repeat(plane.astype(np.float32)[..., np.newaxis], 3, axis=2)

    def to_json(self) -> str:
        """Return the geometry as JSON, which `from_json` reads."""
        values = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        if math.isinf(self.contrast):
            values["contrast"] = None
        return json.dumps(values, indent=1) + "\n"

    @classmethod
    def from_json(cls, text: str) -> FlareChart:
        """Return the geometry of `to_json`.

        Parameters
        ----------
        text : str

        Returns
        -------
        FlareChart

        Raises
        ------
        ValueError
            The text is not of a chart.
        """
        try:
            values = json.loads(text)
        except ValueError as error:
            raise ValueError(f"text: it is no JSON: {error}") from None
        known = {field.name for field in dataclasses.fields(cls)}
        if not isinstance(values, Mapping) or not {*values} <= known:
            raise ValueError(f"text: it is no chart; its keys are {', '.join(sorted(known))}")
        contrast = values.get("contrast")
        return cls(**{**values, "contrast": math.inf if contrast is None else contrast})

    def scaled(self, size: tuple[int, int]) -> FlareChart:
        """Return the same charts in pictures of another size, but of the same shape."""
        factors = [to / of for to, of in zip(size, self.size, strict=True)]
        if abs(factors[0] / factors[1] - 1) > _SHAPE:
            raise ValueError(
                f"chart: its size {self.size} has not the shape of the pictures, {size}"
            )
        x_factor, y_factor = factors
        mean = math.sqrt(x_factor * y_factor)
        return FlareChart(
            size=size,
            positions=[
                ((x + 0.5) * x_factor - 0.5, (y + 0.5) * y_factor - 0.5) for x, y in self.positions
            ],
            radius=self.spot_radius * mean,
            light_radius=self.source_radius * mean,
            mask_radius=self.left_out_radius * mean,
            contrast=self.contrast,
        )


def _check_positions(positions: Any, size: tuple[int, int]) -> tuple[tuple[float, float], ...]:
    """Return nine positions, by default the middles of nine equal parts."""
    if positions is None:
        columns, rows = (
            [float(math.floor((2 * part + 1) * side / 6)) for part in range(3)] for side in size
        )
        return tuple((x, y) for y in rows for x in columns)
    try:
        pairs = tuple(check_floats("positions", pair) for pair in positions)
    except TypeError:
        raise TypeError(f"positions: {positions!r} are not nine pairs (x, y)") from None
    if len(pairs) != COUNT or any(len(pair) != 2 for pair in pairs):
        raise ValueError(f"positions: {positions!r} are not nine pairs (x, y)")
    return tuple((pair[0], pair[1]) for pair in pairs)


@functools.lru_cache(maxsize=128)
def disc(
    size: tuple[int, int], position: tuple[float, float], radius: float
) -> tuple[tuple[slice, slice], NDArray[np.float64]]:
    """Return the rows and columns of pixels around a disc, and which share of each it covers."""
    windows, axes = [], []
    for middle, side in zip(position, size, strict=True):
        first = min(max(math.floor(middle - radius), 0), side)
        end = max(min(math.ceil(middle + radius) + 1, side), first)
        windows.append(slice(first, end))
        offsets = (np.arange(_FINE) + 0.5) / _FINE - 0.5
        axes.append((np.arange(first, end)[:, np.newaxis] + offsets - middle).ravel())
    columns, rows = axes
    inside = columns**2 + rows[:, np.newaxis] ** 2 <= radius**2
    shape = (len(rows) // _FINE, _FINE, len(columns) // _FINE, _FINE)
    share = inside.reshape(shape).mean(axis=(1, 3))
    share.flags.writeable = False
    return (windows[1], windows[0]), share
