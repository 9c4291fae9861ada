"""The figures of a flare report: what each standard measures, by its formula.

`standards.py` has their sources.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from vkbloom._public import public
from vkbloom.testing._flare.chart import COUNT, INNER, WHITE_AT, FlareChart, disc
from vkbloom.testing._flare.shots import Shot

Array = NDArray[np.float64]
Shots = Mapping[str, Sequence[Shot]]
#: Percentiles of the light beside a source.
PERCENTILES: Final = (50.0, 95.0, 99.0)
# Radii of the glare spread function. Rings have a width of 1 pixel, or of 2 % of the radius on each
# side: the mean of a wide one is not the value in its middle.
_RINGS: Final = 48
_RING: Final = 1.0
_RING_SHARE: Final = 0.02
_DEGREE: Final = math.pi / 180


@public("vkbloom.testing")
@dataclasses.dataclass(frozen=True, kw_only=True)
class FlareFigure:
    """A figure of a flare report.

    Attributes
    ----------
    name, standard, unit : str
    value : float
        Mean of Y over the nine positions; NaN if none could be measured.
    highest : float
        The largest of the positions.
    positions : tuple of float
        Y at the nine positions; NaN where an area that is needed is saturated.
    channels : mapping of str to tuple of float
        The same for "R", "G", "B" and "Y"; of grey pictures, for "Y" alone.
    statistics : mapping of str to tuple of float
        Further values of Y at the nine positions: "black" and "white" of spots; of the light beside
        a source, summaries, its "normalization", what it is divided by, and the
        "maximum_measurable" value of the figure.
    formula : str
    notes : tuple of str
        What is to be known about this measurement.
    """

    name: str
    standard: str
    unit: str
    value: float
    highest: float
    positions: tuple[float, ...]
    channels: Mapping[str, tuple[float, ...]]
    statistics: Mapping[str, tuple[float, ...]]
    formula: str
    notes: tuple[str, ...] = ()


@dataclasses.dataclass(frozen=True, kw_only=True)
class Light:
    """What is known of the light of the pictures.

    - `pixels_per_degree`: None: not known.
    - `diffuser_luminance`: Of the diffuser in its picture, in cd/m2.
    - `illuminance`: Of the source at the camera, in lux.
    """

    pixels_per_degree: float | None = None
    diffuser_luminance: float | None = None
    illuminance: float | None = None

    @property
    def pixel(self) -> float | None:
        """The solid angle of a pixel in sr."""
        return self.pixels_per_degree and (_DEGREE / self.pixels_per_degree) ** 2


#: Measures a figure, or raises `Missing`.
Measure: TypeAlias = "Callable[[Shots, FlareChart, Light], FlareFigure]"


class Missing(Exception):
    """A figure cannot be measured; the text says why."""


def mean_of_disc(shot: Shot, position: tuple[float, float], radius: float) -> tuple[Array, bool]:
    """Return the mean of each channel in a disc, and whether a pixel of it is saturated."""
    window, share = disc(shot.size, position, radius)
    if not share.sum() > 0:
        raise Missing("an area that is measured has no pixel; the picture is too small")
    values = shot.values[window]
    mean = np.einsum("yx,yxc->c", share, values) / share.sum()
    return mean, bool((shot.saturated[window] & (share > 0)).any())


def _figure(
    name: str,
    unit: str,
    values: Array,
    formula: str,
    *,
    statistics: Mapping[str, Array] = MappingProxyType({}),
    notes: Sequence[str] = (),
) -> FlareFigure:
    """Return the figure of values by position and channel, (9, C)."""
    names = ("Y",) if values.shape[1] == 1 else ("R", "G", "B", "Y")
    luminance = values[:, -1]
    is_known = bool(np.isfinite(luminance).any())
    return FlareFigure(
        name=name,
        standard=name.partition(".")[0],
        unit=unit,
        value=float(np.nanmean(luminance)) if is_known else math.nan,
        highest=float(np.nanmax(luminance)) if is_known else math.nan,
        positions=_floats(luminance),
        channels={channel: _floats(values[:, index]) for index, channel in enumerate(names)},
        statistics={key: _floats(one) for key, one in statistics.items()},
        formula=formula,
        notes=tuple(notes),
    )


def _floats(values: Array) -> tuple[float, ...]:
    return tuple(float(value) for value in values)


def _need(shots: Shots, *roles: str) -> None:
    lacking = [role for role in roles if role not in shots]
    if lacking:
        raise Missing(f"it needs the picture{'s' * (len(lacking) > 1)} {' and '.join(lacking)}")


def _areas(
    chart: FlareChart, black: Shot, white: Shot, index: int
) -> tuple[Array, Array, list[str]]:
    """Return the means of a black spot and of the white beside it, and what is saturated."""
    x, y = chart.positions[index]
    radius, inner = chart.spot_radius, chart.spot_radius * INNER
    dark, is_dark_cut = mean_of_disc(black, (x, y), inner)
    steps = ((1, 0), (-1, 0), (0, 1), (0, -1))
    sides = [
        mean_of_disc(white, (x + WHITE_AT * radius * dx, y + WHITE_AT * radius * dy), inner)
        for dx, dy in steps
    ]
    cut = ["black"] * is_dark_cut + ["white"] * any(is_cut for _, is_cut in sides)
    return dark, np.mean([mean for mean, _ in sides], axis=0), cut


@dataclasses.dataclass(frozen=True)
class _Spots:
    """What is measured of black spots, (9, C); NaN where an area is saturated."""

    black: Array
    white: Array
    notes: list[str]

    @property
    def percent(self) -> Array:
        """Black as a share of white."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.where(self.white > 0, 100 * self.black / self.white, math.nan))

    @property
    def statistics(self) -> dict[str, Array]:
        """The levels of Y."""
        return {"black": self.black[:, -1], "white": self.white[:, -1]}


def _measure_spots(
    chart: FlareChart, spots: Sequence[Shot], whites: Sequence[Shot], zero: Shot | None
) -> _Spots:
    """Measure the spots of each position, less the light that black has without white."""
    levels: list[tuple[Array, Array]] = []
    saturated: dict[str, list[int]] = {}
    for index in range(COUNT):
        dark, beside, cut = _areas(chart, spots[index], whites[index], index)
        if zero is not None:
            inner = chart.spot_radius * INNER
            own, is_cut = mean_of_disc(zero, chart.positions[index], inner)
            dark, cut = dark - own, cut + ["picture of black"] * is_cut
        for area in cut:
            saturated.setdefault(area, []).append(index)
        unknown = math.nan if cut else 0.0
        levels.append((dark + unknown, beside + unknown))
    notes = [f"{positions(where)}: the {area} is saturated" for area, where in saturated.items()]
    if zero is None and math.isfinite(chart.contrast):
        notes.insert(0, f"{100 / chart.contrast:.3g} % of it is the light of the chart's black")
    black, white = (np.array(one) for one in zip(*levels, strict=True))
    return _Spots(black, white, notes)


def positions(numbers: Iterable[int]) -> str:
    """Return positions in words."""
    shown = ", ".join(map(str, numbers))
    return f"position{'s' * (',' in shown)} {shown}"


def _flare_type(name: str, black_role: str, zero_role: str | None, formula: str) -> Measure:
    """Return the function of a type of ISO 18844: (black - zero) / white."""

    def measure(shots: Shots, chart: FlareChart, _: Light) -> FlareFigure:
        _need(shots, *dict.fromkeys(("chart", black_role, *((zero_role,) if zero_role else ()))))
        black, white = shots[black_role][0], shots["chart"][0]
        zero = None if zero_role is None else shots[zero_role][0]
        found = _measure_spots(chart, [black] * COUNT, [white] * COUNT, zero)
        return _figure(
            name, "%", found.percent, formula, statistics=found.statistics, notes=found.notes
        )

    return measure


def veiling_glare_index(shots: Shots, chart: FlareChart, _: Light) -> FlareFigure:
    """Measure the index of ISO 9358 by its integral method, with one black spot at a time."""
    notes = []
    if "spots" in shots:
        several = shots["spots"]
    else:
        _need(shots, "chart")
        several = [shots["chart"][0]] * COUNT
        notes.append("there are no pictures of one spot each; nine spots have less white")
    zero = shots["black"][0] if "black" in shots and math.isfinite(chart.contrast) else None
    found = _measure_spots(chart, several, several, zero)
    return _figure(
        "iso9358.veiling_glare_index",
        "%",
        found.percent,
        "100 E(black spot) / E(white beside it)",
        statistics=found.statistics,
        notes=notes + found.notes,
    )


@dataclasses.dataclass(frozen=True)
class _Source:
    """The image of a light by itself: mean of its inside, and flux inside the mask, by channel."""

    level: Array
    flux: Array


def _direct(shots: Shots, chart: FlareChart, index: int) -> _Source:
    """Return the direct image of the light: of the picture `direct`, else of the light's own."""
    if "direct" in shots:
        shot = shots["direct"][0]
        position = _brightest(shot, chart)
    else:
        _need(shots, "lights")
        shot, position = shots["lights"][index], chart.positions[index]
    level, is_cut = mean_of_disc(shot, position, chart.source_radius * INNER)
    window, share = disc(shot.size, position, chart.left_out_radius)
    if is_cut or (shot.saturated[window] & (share > 0)).any():
        raise Missing("the direct image of the light is saturated; give a shorter exposure, direct")
    # Pixels that the mask leaves out are whole.
    return _Source(level, shot.values[window][share > 0].sum(axis=0))


def _brightest(shot: Shot, chart: FlareChart) -> tuple[float, float]:
    """Return the position whose light a picture shows."""
    levels = [mean_of_disc(shot, one, chart.source_radius)[0][-1] for one in chart.positions]
    return chart.positions[int(np.argmax(levels))]  # type: ignore[no-any-return]


def mask_of(chart: FlareChart, index: int) -> NDArray[np.bool_]:
    """Return where the light's own image is not: what is measured beside it."""
    window, share = disc(chart.size, chart.positions[index], chart.left_out_radius)
    mask = np.ones((chart.size[1], chart.size[0]), np.bool_)
    mask[window] &= share == 0
    return mask


def _beside_lights(
    shots: Shots, chart: FlareChart, factors: Sequence[Array]
) -> tuple[Array, dict[str, Array], list[str]]:
    """Return the mean light beside each source as a share of its factor, summaries, and notes."""
    means, rows, cuts = [], [], {}
    for index, shot in enumerate(shots["lights"]):
        mask, scale = mask_of(chart, index), factors[index]
        light = np.maximum(shot.values[mask], 0) / scale
        # The mean is not clipped: noise around the dark level would become light.
        means.append(shot.values[mask].mean(axis=0) / scale)
        percentiles = np.percentile(light[:, -1], PERCENTILES)
        with np.errstate(divide="ignore", invalid="ignore"):
            attenuation = -10 * np.log10(max(float(means[-1][-1]), 0.0))
        most = shot.highest / float(scale[-1])
        rows.append([*percentiles, light[:, -1].max(), attenuation, float(scale[-1]), most])
        cut = int((shot.saturated & mask).sum())
        if cut:
            cuts[index] = cut
    names = ("median", *(f"percentile_{rank:g}" for rank in PERCENTILES[1:]), "maximum")
    names += ("attenuation_db", "normalization", "maximum_measurable")
    statistics = dict(zip(names, np.array(rows).T, strict=True))
    notes = [
        f"{positions(cuts)}: {sum(cuts.values())} pixels beside the light are saturated; the "
        "figure is at least this"
    ]
    return np.array(means), statistics, notes if cuts else []


def normalized_flare(shots: Shots, chart: FlareChart, _: Light) -> FlareFigure:
    """Measure the normalized flare of IEEE 2020: the light beside a source, by its own image's."""
    _need(shots, "lights")
    levels = [_direct(shots, chart, index).level for index in range(COUNT)]
    values, statistics, notes = _beside_lights(shots, chart, levels)
    return _figure(
        "ieee2020.normalized_flare",
        "1",
        values,
        "mean of (value - dark) / (t mean of the light's direct image) outside of the mask; t: "
        "ratio of the exposures",
        statistics=statistics,
        notes=notes,
    )


def flare_intensity(shots: Shots, chart: FlareChart, light: Light) -> FlareFigure:
    """Measure the flare intensity of IEEE 2020: by a white diffuser in the light of the source."""
    _need(shots, "lights")
    notes = []
    lux, luminance, pixel = light.illuminance, light.diffuser_luminance, light.pixel
    factors: list[Array]
    if "diffuser" in shots and lux is not None and luminance is not None:
        level, is_cut = mean_of_disc(
            shots["diffuser"][0], chart.positions[COUNT // 2], chart.spot_radius
        )
        if is_cut:
            raise Missing("the picture of the diffuser is saturated")
        factors = [level * lux / (math.pi * luminance)] * COUNT
    elif pixel is not None:
        notes.append(
            "the illuminance is that of the light's direct image, for want of a diffuser with its "
            "luminance and of the illuminance at the camera"
        )
        factors = [_direct(shots, chart, index).flux * pixel / math.pi for index in range(COUNT)]
    else:
        raise Missing(
            "it needs the picture diffuser with diffuser_luminance and illuminance, or "
            "pixels_per_degree"
        )
    values, statistics, found = _beside_lights(shots, chart, factors)
    return _figure(
        "ieee2020.flare_intensity",
        "1",
        values,
        "mean of pi (L_d / E) (value - dark) / (t mean of the diffuser) outside of the mask; L_d: "
        "the diffuser's luminance, E: illuminance at the camera, t: ratio of the exposures",
        statistics=statistics,
        notes=notes + found,
    )


def glare_share(shots: Shots, chart: FlareChart, _: Light) -> FlareFigure:
    """Measure which share of a light's light is outside of the mask, in the picture."""
    _need(shots, "lights")
    rows, cuts = [], []
    for index, shot in enumerate(shots["lights"]):
        mask = mask_of(chart, index)
        outside = shot.values[mask].sum(axis=0)
        rows.append(100 * outside / (outside + _direct(shots, chart, index).flux))
        if (shot.saturated & mask).any():
            cuts.append(index)
    notes = [f"{positions(cuts)}: pixels beside the light are saturated"] if cuts else []
    formula = "100 (flux outside of the mask) / (flux in the picture) of a light"
    return _figure("iso9358.glare_share", "%", np.array(rows), formula, notes=notes)


def glare_spread(shots: Shots, chart: FlareChart, light: Light) -> dict[str, Any]:
    """Return the glare spread function at each position: mean of Y on rings around the light.

    The value of a pixel divided by the flux of the light's direct image, per pixel or per sr.
    """
    _need(shots, "lights")
    first, last = chart.left_out_radius + 1.5, math.hypot(*chart.size)
    wanted = np.geomspace(first, last, _RINGS) if first < last else np.array([first])
    found = [_rings(shot, chart, index, wanted) for index, shot in enumerate(shots["lights"])]
    flux = [_direct(shots, chart, index).flux[-1] for index in range(COUNT)]
    values = np.array([values for values, _ in found]) / np.array(flux)[:, np.newaxis]
    distances = np.array([distance for _, distance in found])
    known = np.isfinite(distances).any(axis=0)
    values, radii = values[:, known], np.nanmean(distances[:, known], axis=0)
    scale, pixel = light.pixels_per_degree, light.pixel
    return {
        "radii": radii,
        "degrees": None if scale is None else radii / scale,
        "per_pixel": values,
        "per_steradian": None if pixel is None else values / pixel,
    }


def _rings(shot: Shot, chart: FlareChart, index: int, radii: Array) -> tuple[Array, Array]:
    """Return the means of Y and of the distance on rings around a light.

    They are NaN where the picture has no pixel of a ring.
    """
    x, y = chart.positions[index]
    mask = mask_of(chart, index) & ~shot.saturated
    columns, rows = (np.arange(side) for side in shot.size)
    distance = np.hypot(columns - x, rows[:, np.newaxis] - y)[mask]
    order = np.argsort(distance)
    half = np.maximum(_RING / 2, _RING_SHARE * radii)
    starts = np.searchsorted(distance[order], radii - half)
    ends = np.searchsorted(distance[order], radii + half)
    counts = np.where(ends > starts, ends - starts, math.nan)

    def means(values: Array) -> Array:
        sums = np.concatenate([[0.0], values[order].cumsum()])
        return np.asarray((sums[ends] - sums[starts]) / counts)

    return means(shot.values[..., -1][mask]), means(distance)


#: The functions of the figures, by name; their roles follow from the pictures that are given.
FIGURES: Final[Mapping[str, Measure]] = {
    "iso18844.type_a": _flare_type(
        "iso18844.type_a",
        "chart_long",
        "black",
        "100 (YB3 / H2 - YB2 / H2) / (YW1 / H1); YB3: black spots of the chart at the exposure H2, "
        "YB2: black alone at H2, YW1: white beside the spots at H1, H2 = 8 H1",
    ),
    "iso18844.type_b": _flare_type(
        "iso18844.type_b",
        "chart",
        "black",
        "100 (YB1 / H1 - YB2 / H2) / (YW1 / H1); YB1 and YW1: black and white of the chart at the "
        "exposure H1, YB2: black alone at H2",
    ),
    "iso18844.type_c": _flare_type(
        "iso18844.type_c", "chart", None, "100 YB1 / YW1; black and white of one picture"
    ),
    "iso9358.veiling_glare_index": veiling_glare_index,
    "iso9358.glare_share": glare_share,
    "ieee2020.flare_intensity": flare_intensity,
    "ieee2020.normalized_flare": normalized_flare,
}
#: The roles that a bloom is asked for, by standard.
ROLES_OF: Final[Mapping[str, tuple[str, ...]]] = {
    "iso18844": ("chart", "chart_long", "black"),
    "iso9358": ("spots", "lights"),
    "ieee2020": ("lights", "diffuser"),
}


def names_of(standards: Sequence[str]) -> Iterator[str]:
    """Yield the figures of standards."""
    for name in FIGURES:
        if name.partition(".")[0] in standards:
            yield name
