"""A report of flare by the standards: from pictures of charts, or from a bloom."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._argument_types import check_arguments
from vkbloom._numbers import check_above
from vkbloom._psf.base import FRAME_DEGREES
from vkbloom._public import public
from vkbloom._renderer.default import default_renderer
from vkbloom._renderer.renderer import Renderer
from vkbloom._settings.settings import Settings, resolve_settings
from vkbloom._spelling import did_you_mean
from vkbloom._views import markup
from vkbloom._views.markup import Markup, element
from vkbloom._views.pictures import png
from vkbloom._views.plain_values import plain
from vkbloom.testing._blooms import bloom_of, exact
from vkbloom.testing._flare.chart import COUNT, FlareChart
from vkbloom.testing._flare.figures import (
    FIGURES,
    PERCENTILES,
    ROLES_OF,
    FlareFigure,
    Light,
    Missing,
    Shots,
    glare_spread,
    mask_of,
    names_of,
)
from vkbloom.testing._flare.shots import (
    Levels,
    check_dark,
    check_exposures,
    shots_of_bloom,
    shots_of_pictures,
)
from vkbloom.testing._flare.standards import NAMES, STANDARDS
from vkbloom.testing._probe import Bloom

_SIZE: Final = (480, 320)
# Decades of a picture on a logarithmic scale.
_DECADES: Final = 6
_CURVES: Final = (360, 240)


@public("vkbloom.testing")
@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class FlareReport:
    """Flare by the standards.

    Attributes
    ----------
    name : str
        What was measured.
    figures : mapping of str to FlareFigure
        By their names, such as "iso18844.type_a".
    missing : mapping of str to str
        Figures that the pictures do not give, and why.
    glare_spread : mapping or None
        The glare spread function: "radii" in pixels and in "degrees", and for nine positions the
        values "per_pixel" and "per_steradian"; what needs `pixels_per_degree` is None without it.
    conditions : mapping of str to Any
        What a report has to say: dark and saturated levels, exposures, saturated pixels and the
        largest luminance that can be measured by picture; masks, channels, percentiles, and whether
        the light's own size is known.
    chart : FlareChart
        The geometry.
    standards : mapping of str to mapping
        Of each standard its "title", the "sources" of the formulas, and what was "not_seen" of its
        text.
    pictures : mapping of str to ndarray of uint8, shape (H, W, 1) or (H, W, 3)
        What the page shows, by caption.
    """

    name: str
    figures: Mapping[str, FlareFigure]
    missing: Mapping[str, str]
    glare_spread: Mapping[str, Any] | None
    conditions: Mapping[str, Any]
    chart: FlareChart
    standards: Mapping[str, Mapping[str, Any]]
    pictures: Mapping[str, NDArray[np.uint8]] = dataclasses.field(repr=False, default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """Return the report as plain values, as its JSON schema (`flare.schema.json`) says."""
        values: dict[str, Any] = plain(
            {
                "name": self.name,
                "standards": self.standards,
                "chart": json.loads(self.chart.to_json()),
                "conditions": self.conditions,
                "figures": self.figures,
                "missing": self.missing,
                "glare_spread": self.glare_spread,
            }
        )
        return values

    def to_json(self) -> str:
        """Return the report as JSON."""
        return json.dumps(self.to_dict(), indent=2)

    def to_html(self) -> str:
        """Return the report as a page."""
        title = f"Flare of {self.name}"
        return markup.page(title, element("h1", title), self._body())

    def to_markdown(self) -> str:
        """Return the figures as tables for a pull request."""
        name = self.name.replace("`", "'")
        lines = [
            f"### Flare of `{name}`\n",
            "| figure | mean | highest | unit |\n|---|---|---|---|",
        ]
        lines += [f"| {' | '.join(row)} |" for row in self._rows()]
        lines += [f"| {missing} | not measured: {why} | | |" for missing, why in self._absent()]
        return "\n".join((*lines, ""))

    def __str__(self) -> str:
        """Return a table, and below it the notes and what was not seen."""
        width, height = self.chart.size
        lines = [f"Flare of {self.name}, {width} x {height}"]
        lines.append(f"{'figure':<30} {'mean':>10} {'highest':>10}")
        lines += [
            f"{name:<30} {value:>10} {highest:>10} {unit}".rstrip()
            for name, value, highest, unit in self._rows()
        ]
        lines += [f"{name}: not measured: {why}" for name, why in self._absent()]
        for figure in self.figures.values():
            lines += [f"{figure.name}: {note}" for note in figure.notes]
        lines += [f"{about['title']}: {about['not_seen']}" for about in self.standards.values()]
        return "\n".join(lines)

    def _rows(self) -> list[tuple[str, str, str, str]]:
        return [
            (one.name, _words(one.value), _words(one.highest), one.unit.replace("1", ""))
            for one in self.figures.values()
        ]

    def _absent(self) -> list[tuple[str, str]]:
        return [*self.missing.items()]

    def _repr_html_(self) -> str:
        return str(self._body())

    def _body(self) -> Markup:
        left = {"style": "text-align:left"}
        parts = [
            markup.figure(markup.image(png(pixels), name, width=360), name)
            for name, pixels in self.pictures.items()
        ]
        rows = [(*row, self.figures[row[0]].formula) for row in self._rows()]
        rows += [(name, "", "", "", f"not measured: {why}") for name, why in self._absent()]
        parts.append(
            markup.table(rows, ("figure", "mean", "highest", "unit", "formula"), name=left)
        )
        for one in self.figures.values():
            parts.append(_field(one))
            parts += [element("p", note) for note in one.notes]
        parts.append(element("h2", "Conditions"))
        parts.append(markup.table(_flat(self.conditions), name=left, cell=left))
        parts.append(element("h2", "Sources"))
        for about in self.standards.values():
            parts.append(element("h3", about["title"]))
            parts.append(element("p", about["not_seen"]))
            parts.append(element("ul", *(element("li", text) for text in about["sources"])))
        return markup.join(parts)


def _words(value: float) -> str:
    return "none" if math.isnan(value) else f"{value:.4g}"


def _field(figure: FlareFigure) -> Markup:
    """Return the nine positions as a table of three rows, as they stand in the picture."""
    cells = [_words(value) for value in figure.positions]
    rows = [
        (where, *cells[start : start + 3])
        for where, start in (("top", 0), ("middle", 3), ("bottom", 6))
    ]
    unit = f", {figure.unit}" if figure.unit != "1" else ""
    return markup.table(
        rows, ("", "left", "middle", "right"), caption=f"{figure.name}{unit}, over the field"
    )


def _flat(values: Mapping[str, Any], above: str = "") -> list[tuple[str, str]]:
    """Return what was reported in rows, nested names joined by dots."""
    rows = []
    for name, value in plain(values).items():
        if isinstance(value, Mapping):
            rows += _flat(value, f"{above}{name}.")
        else:
            rows.append((f"{above}{name}", "not known" if value is None else str(value)))
    return rows


@public("vkbloom.testing")
@check_arguments
def flare(
    source: Mapping[str, Any] | Bloom | Settings | str,
    *,
    standard: str | Sequence[str] = "all",
    chart: FlareChart | None = None,
    exposures: Mapping[str, float] = {},
    dark: float | Sequence[float] = 0.0,
    saturation: float | None = None,
    raw: bool = False,
    pixels_per_degree: float | None = None,
    diffuser_luminance: float | None = None,
    illuminance: float | None = None,
    name: str = "",
    renderer: Renderer | None = None,
) -> FlareReport:
    """Report the flare of a camera, or of a bloom, by the standards.

    Parameters
    ----------
    source : mapping of str to picture, or callable, Settings or str
        Pictures of the charts, by what they show: "chart" (nine black spots in white),
        "chart_long" (the same at 8 times the exposure), "black" (black without white), "spots"
        (nine pictures of one black spot in white), "lights" (nine pictures of one light in the
        dark), "direct" (a light that is not saturated, for the pictures "lights" in which it is),
        "diffuser" (a white diffuser), "dark_frame" (no light). A figure whose pictures are not
        given is in `FlareReport.missing`. A picture is a path, which `vkbloom.read` decodes, or an
        array of linear light, (H, W) or (H, W, C); integers are divided by their largest value.

        Or a bloom, which is given the charts: a callable that returns the picture with its glare,
        settings, or the name of a preset.
    standard : {"all", "iso18844", "iso9358", "ieee2020"} or a sequence of these
    chart : FlareChart, optional
        The geometry of the charts; it is scaled to the size of the pictures, if they have its
        shape. Default: that of the pictures' size; of 480 x 320 for a bloom.
    exposures : mapping of str to float
        Exposures of the pictures relative to each other, by what they show: of time, gain, light
        level and filters together. Default: 8 for "chart_long" and "black", else 1.
    dark : float or sequence of 3 float
        The dark level in the pictures' values, which is subtracted.
    saturation : float, optional
        The largest value of a pixel. Default: 1 for pictures of integers; for floats it is not
        known. The picture of a bloom is clipped at it.
    raw : bool
        Whether the integers of files are linear, in place of sRGB or what the file says.
    pixels_per_degree : float, optional
        Default: not known for pictures; for a bloom, the picture's longer side spans 50 degrees.
    diffuser_luminance, illuminance : float, optional
        The luminance of the diffuser in its picture in cd/m2, and the illuminance of the source
        at the camera in lux.
    name : str
        The name of what is measured, in the report.
    renderer : Renderer, optional
        For settings. Default: `default_renderer`.

    Returns
    -------
    FlareReport

    Raises
    ------
    ValueError, TypeError, OSError
        An argument is out of range, a picture cannot be read, or the pictures have several sizes.

    Examples
    --------
    >>> from vkbloom import testing
    >>> def veil(picture):
    ...     return 0.96 * picture + 0.04 * picture.mean(axis=(0, 1))
    >>> found = testing.flare(veil, standard="iso18844")
    >>> round(found.figures["iso18844.type_a"].value, 2)
    3.8
    """
    return report_flare(
        source,
        standard=standard,
        chart=chart,
        exposures=exposures,
        dark=dark,
        saturation=saturation,
        raw=raw,
        pixels_per_degree=pixels_per_degree,
        diffuser_luminance=diffuser_luminance,
        illuminance=illuminance,
        name=name,
        renderer=renderer,
    )


def report_flare(
    source: Any,
    *,
    standard: str | Sequence[str],
    chart: FlareChart | None,
    exposures: Mapping[str, float],
    dark: Any,
    saturation: float | None,
    raw: bool = False,
    pixels_per_degree: float | None = None,
    diffuser_luminance: float | None = None,
    illuminance: float | None = None,
    name: str = "",
    renderer: Renderer | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> FlareReport:
    """Return the report of `flare`; `progress` gets the name of each chart of a bloom."""
    standards = _check_standards(standard)
    lights = {
        "pixels_per_degree": pixels_per_degree,
        "diffuser_luminance": diffuser_luminance,
        "illuminance": illuminance,
    }
    for key, value in {"saturation": saturation, **lights}.items():
        if value is not None:
            check_above(key, value)
    levels = Levels(
        exposures=check_exposures(exposures), dark=check_dark(dark), saturation=saturation, raw=raw
    )
    light = Light(**lights)
    if isinstance(source, Mapping):
        shots, size = shots_of_pictures(source, levels)
        chart = FlareChart(size=size) if chart is None else chart.scaled(size)
        return _report(name or "the pictures", standards, shots, chart, light)
    chart = chart or FlareChart(size=_SIZE)
    if isinstance(source, Settings | str):
        settings = exact(resolve_settings(source, "source"))
        name = name or (source if isinstance(source, str) else settings.method)
        bloom = bloom_of(renderer or default_renderer(), settings, "final")
    elif callable(source):
        bloom, name = source, name or getattr(source, "__name__", "a bloom")
    else:
        raise TypeError(
            f"source: {source!r} is not a mapping of pictures, a callable, settings or a preset"
        )
    roles = [role for one in standards for role in ROLES_OF[one]]
    if saturation is not None:
        roles.append("direct")
    shots = shots_of_bloom(bloom, chart, roles, levels, progress)
    return _report(name, standards, shots, chart, _light_of_bloom(light, chart))


def _light_of_bloom(light: Light, chart: FlareChart) -> Light:
    """Return what is known of the light of drawn charts."""
    scale = light.pixels_per_degree or max(chart.size) / FRAME_DEGREES
    # The diffuser is as bright as the light, whose illuminance follows from its size.
    area = float(chart.draw(f"light_{COUNT // 2}")[..., 0].sum(dtype=np.float64))
    known = Light(pixels_per_degree=scale, diffuser_luminance=1.0)
    return dataclasses.replace(known, illuminance=area * float(known.pixel or 0.0))


def _check_standards(standard: str | Sequence[str]) -> tuple[str, ...]:
    if standard == "all":
        return NAMES
    chosen = [standard] if isinstance(standard, str) else standard
    for one in chosen:
        if one not in NAMES:
            raise ValueError(
                f"standard: {one!r} is not one of all, {', '.join(NAMES)}"
                f"{did_you_mean(str(one), NAMES)}"
            )
    return tuple(one for one in NAMES if one in chosen)


def _report(
    name: str, standards: Sequence[str], shots: Shots, chart: FlareChart, light: Light
) -> FlareReport:
    figures, missing = {}, {}
    for key in names_of(standards):
        try:
            figures[key] = FIGURES[key](shots, chart, light)
        except Missing as error:
            missing[key] = str(error)
    spread = None
    if "iso9358" in standards:
        try:
            spread = glare_spread(shots, chart, light)
        except Missing as error:
            missing["iso9358.glare_spread"] = str(error)
    return FlareReport(
        name=name,
        figures=figures,
        missing=missing,
        glare_spread=spread,
        conditions=_conditions(shots, chart, light),
        chart=chart,
        standards={one: dataclasses.asdict(STANDARDS[one]) for one in standards},
        pictures=_pictures(shots, chart, spread),
    )


def _conditions(shots: Shots, chart: FlareChart, light: Light) -> dict[str, Any]:
    """Return what a report has to say of its pictures."""
    grey = next(iter(shots.values()))[0].values.shape[2] == 1
    return {
        "pictures": {
            role: {
                "count": len(several),
                "exposure": several[0].exposure,
                "dark": several[0].dark,
                "saturation": several[0].saturation,
                "saturated_pixels": [int(one.saturated.sum()) for one in several],
                "highest_measurable": several[0].highest,
            }
            for role, several in shots.items()
        },
        "channels": ("Y",) if grey else ("R", "G", "B", "Y"),
        "percentiles": PERCENTILES,
        "mask_pixels": [int((~mask_of(chart, index)).sum()) for index in range(COUNT)],
        "pixels_per_degree": light.pixels_per_degree,
        "diffuser_luminance": light.diffuser_luminance,
        "illuminance": light.illuminance,
    }


def _pictures(
    shots: Shots, chart: FlareChart, spread: Mapping[str, Any] | None
) -> dict[str, NDArray[np.uint8]]:
    """Return the pictures of the page."""
    shown = {}
    if "chart" in shots:
        plane = shots["chart"][0].values[..., -1]
        spots = [plane[round(y), round(x)] for x, y in chart.positions]
        brightest = min(max(*map(float, spots), float(plane.max()) / 1000), float(plane.max()))
        shown["chart, its black brightened"] = _grey(0.7 * plane / max(brightest, 1e-30))
    if "lights" in shots:
        index = COUNT // 2
        plane = shots["lights"][index].values[..., -1]
        scaled = _logarithmic(plane / max(float(plane.max()), 1e-30))
        pixels = np.repeat(_grey(scaled), 3, axis=2)
        # What is left out is red.
        pixels[~mask_of(chart, index)] = (160, 40, 40)
        shown["light in the middle, six decades, mask red"] = pixels
    if spread is not None:
        shown["glare spread function of nine positions, logarithmic in both axes"] = _curves(spread)
    return shown


def _grey(plane: NDArray[Any]) -> NDArray[np.uint8]:
    levels: NDArray[np.uint8] = np.rint(255 * np.clip(plane, 0, 1)).astype(np.uint8)
    return levels[..., np.newaxis]


def _logarithmic(plane: NDArray[Any]) -> NDArray[Any]:
    """Return values of 1 and less on a logarithmic scale of 0 to 1."""
    return np.asarray(1 + np.log10(np.maximum(plane, 10.0**-_DECADES)) / _DECADES)


def _curves(spread: Mapping[str, Any]) -> NDArray[np.uint8]:
    """Return a picture of the glare spread function over the radius, a curve for each position."""
    width, height = _CURVES
    canvas = np.full((height, width, 1), 255, np.uint8)
    radii, values = np.log(spread["radii"]), np.maximum(spread["per_pixel"], 0)
    seen = values[values > 0]
    if not seen.size or len(radii) < 2:
        return canvas
    high = float(np.log(seen.max()))
    low = max(float(np.log(seen.min())), high - _DECADES * np.log(10))
    columns = np.linspace(radii[0], radii[-1], width)
    for row in values:
        known = row > 0
        if known.sum() > 1:
            curve = np.interp(columns, radii[known], np.log(row[known]), np.nan, np.nan)
            chosen = np.flatnonzero(curve >= low)
            places = (height - 1) * (high - curve[chosen]) / max(high - low, 1e-9)
            canvas[np.rint(places).astype(int), chosen] = 40
    return canvas
