"""Pictures of the charts of a flare report: from files and arrays, or from a bloom."""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from vkbloom._arrays import native_order, view_image
from vkbloom._formats import LUMINANCE
from vkbloom._io.image_file import read_picture, read_stored
from vkbloom._io.picture import Highlights
from vkbloom._numbers import check_above, check_floats
from vkbloom._spelling import did_you_mean
from vkbloom.testing._flare.chart import COUNT, FlareChart
from vkbloom.testing._probe import Bloom, call, check_result

Array = NDArray[np.float64]
Role = Literal[
    "chart", "chart_long", "black", "spots", "lights", "direct", "diffuser", "dark_frame"
]

ROLES: Final = get_args(Role)
#: Nine pictures each; one of the others.
SEVERAL: Final = ("spots", "lights")
#: Exposures where none are given. ISO 18844: 8 times that of the chart.
EXPOSURES: Final[Mapping[str, float]] = {
    **dict.fromkeys(ROLES, 1.0),
    "chart_long": 8.0,
    "black": 8.0,
}
# The white of a chart that a bloom is given: a level of 225 in 8 bits of sRGB, as ISO 18844 asks.
_WHITE: Final = 0.7529
# A value is saturated if it is no further below the level than this share of it.
_ROUNDING: Final = 1e-6
_KINDS: Final = ("uint8", "uint16", "float16", "float32", "float64")


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class Shot:
    """A picture, without its dark level, divided by its exposure.

    - `values`: shape (H, W, C), linear light; the last channel is luminance, Y.
    - `saturated`: shape (H, W), where a channel has the saturated level.
    - `exposure`, `dark`, `saturation`: What the values were divided by; what was subtracted, by
      channel; the largest value that a picture can hold. These two are in the picture's own values.
    """

    values: Array
    saturated: NDArray[np.bool_]
    exposure: float
    dark: tuple[float, ...]
    saturation: float

    @property
    def size(self) -> tuple[int, int]:
        """Width and height."""
        return self.values.shape[1], self.values.shape[0]

    @property
    def highest(self) -> float:
        """The largest luminance that can be measured."""
        return (self.saturation - self.dark[-1]) / self.exposure


@dataclasses.dataclass(frozen=True, kw_only=True)
class Levels:
    """How values of pictures are read.

    - `exposures`: By role.
    - `dark`, `saturation`: As arguments of `flare`.
    - `raw`: Whether integers of files are linear.
    """

    exposures: Mapping[str, float]
    dark: tuple[float, ...] = (0.0,)
    saturation: float | None = None
    raw: bool = False


def check_exposures(given: Mapping[str, Any]) -> dict[str, float]:
    """Return the exposure of each role."""
    for role, value in given.items():
        _check_role("exposures", role)
        check_above(f"exposures: {role}", value)
    return {**EXPOSURES, **{role: float(value) for role, value in given.items()}}


def check_dark(dark: Any) -> tuple[float, ...]:
    """Return a dark level of all channels, or those of red, green and blue."""
    levels = check_floats("dark", np.atleast_1d(dark) if np.isscalar(dark) else dark)
    if len(levels) not in (1, 3):
        raise ValueError(f"dark: {dark!r} is not one number or three")
    return levels


def _check_role(name: str, role: object) -> None:
    if role not in ROLES:
        raise ValueError(
            f"{name}: {role!r} is not one of {', '.join(ROLES)}{did_you_mean(str(role), ROLES)}"
        )


def shots_of_pictures(
    pictures: Mapping[str, Any], levels: Levels
) -> tuple[dict[str, tuple[Shot, ...]], tuple[int, int]]:
    """Return the shots of each role, and the size of all pictures."""
    read: dict[str, list[tuple[Array, float]]] = {}
    for role, given in pictures.items():
        _check_role("source", role)
        several = given if _is_sequence(given) else [given]
        wanted = COUNT if role in SEVERAL else 1
        if len(several) != wanted:
            raise ValueError(
                f"source: {role} has {len(several)} pictures, not {wanted}"
                + "; one for each position" * (wanted > 1)
            )
        read[role] = [_read(f"source: {role}", one, raw=levels.raw) for one in several]
    if not read:
        raise ValueError(f"source: there is no picture; name one of {', '.join(ROLES)}")
    sizes = {values.shape[:2] for several in read.values() for values, _ in several}
    if len(sizes) > 1:
        shown = " and ".join(sorted(f"{width} x {height}" for height, width in sizes))
        raise ValueError(f"source: the pictures have several sizes, {shown}")
    dark = levels.dark
    if "dark_frame" in read:
        if any(dark):
            raise ValueError("dark: the level of the dark_frame is used; leave it out")
        frame = read.pop("dark_frame")[0][0]
        dark = tuple(float(level) for level in frame.mean(axis=(0, 1)))
    height, width = sizes.pop()
    levels = dataclasses.replace(levels, dark=dark)
    shots = {
        role: tuple(_shot(values, role, levels, found) for values, found in several)
        for role, several in read.items()
    }
    return shots, (width, height)


def shots_of_bloom(
    bloom: Bloom,
    chart: FlareChart,
    roles: Sequence[str],
    levels: Levels,
    progress: Callable[[str], None],
) -> dict[str, tuple[Shot, ...]]:
    """Return the shots of a bloom of the charts."""

    def shoot(role: str, name: str, value: float) -> Shot:
        progress(name)
        given = chart.draw(name) * np.float32(value * levels.exposures[role])
        whole = check_result(call(bloom, given), given, given.shape[2])[..., :3]
        if not np.isfinite(whole).all():
            raise ValueError(f"source: the bloom of {name} has values that are not finite")
        values, most = _as_light(whole)
        saturation = most if levels.saturation is None else levels.saturation
        return _shot(np.minimum(values, saturation), role, levels, saturation)

    drawn = {
        "chart": [("chart", _WHITE)],
        "chart_long": [("chart", _WHITE)],
        "black": [("black", _WHITE)],
        "spots": [(f"spot_{index}", _WHITE) for index in range(COUNT)],
        "lights": [(f"light_{index}", 1.0) for index in range(COUNT)],
        "direct": [(f"light_{COUNT // 2}", 1.0)],
        "diffuser": [("diffuser", 1.0)],
    }
    return {
        role: tuple(shoot(role, name, value) for name, value in drawn[role])
        for role in drawn
        if role in roles
    }


def _is_sequence(given: Any) -> bool:
    """Return whether pictures are several: paths, or arrays of which each is an image."""
    if isinstance(given, str | os.PathLike):
        return False
    return isinstance(given, list | tuple) or getattr(given, "ndim", 0) > 3


def _read(name: str, picture: Any, *, raw: bool) -> tuple[Array, float]:
    """Return a picture's linear light, and its largest value; infinity: not known."""
    if isinstance(picture, str | os.PathLike):
        if raw:
            array = read_stored(picture).pixels
        else:
            found = read_picture(picture)
            most = math.inf if found.highlights is Highlights.STORED else 1.0
            return _colours(name, found.pixels).astype(np.float64), most
    else:
        array = native_order(view_image(picture, name))
    if array.dtype.name not in _KINDS:
        raise TypeError(f"{name}: dtype {array.dtype} is not one of {', '.join(_KINDS)}")
    values, most = _as_light(_colours(name, array))
    if not np.isfinite(values).all():
        raise ValueError(f"{name}: a value is not finite")
    return values, most


def _as_light(array: NDArray[Any]) -> tuple[Array, float]:
    if array.dtype.kind == "u":
        return array.astype(np.float64) / np.iinfo(array.dtype).max, 1.0
    return array.astype(np.float64), math.inf


def _colours(name: str, array: NDArray[Any]) -> NDArray[Any]:
    """Return (H, W, 1) of grey or (H, W, 3) of colours."""
    whole = array[..., np.newaxis] if array.ndim == 2 else array
    if whole.ndim != 3 or whole.shape[2] not in (1, 3, 4) or 0 in whole.shape:
        raise ValueError(
            f"{name}: shape {array.shape} is not (H, W), (H, W, 3) or (H, W, 4) with sides of at "
            "least 1"
        )
    return whole[..., :3]


def _shot(values: Array, role: str, levels: Levels, most: float) -> Shot:
    saturation = most if levels.saturation is None else levels.saturation
    is_grey = values.shape[2] == 1
    dark = np.broadcast_to(levels.dark, 3)
    dark = dark[:1] if is_grey else dark
    light = values - dark
    if not is_grey:
        light = np.concatenate([light, light @ np.array(LUMINANCE)[:, np.newaxis]], axis=2)
        dark = np.append(dark, dark @ np.array(LUMINANCE))
    with np.errstate(invalid="ignore"):
        saturated = np.asarray((values >= saturation * (1 - _ROUNDING)).any(axis=2))
    return Shot(
        values=light / levels.exposures[role],
        saturated=saturated,
        exposure=levels.exposures[role],
        dark=tuple(float(level) for level in dark),
        saturation=saturation,
    )
