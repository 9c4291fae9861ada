"""Flare reports against the closed forms of point spreads with known integrals.

The charts, the camera and the integrals here are the test's own: light of the chart spreads by
integrals over pixels, then comes a dark level, noise, saturation and 16 bits.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import fftconvolve
from scipy.special import erf

import vkbloom
from tests.refusals import assert_refused, rows
from vkbloom import testing

Array = NDArray[np.float64]

WIDTH, HEIGHT = SIZE = 240, 160
DIAGONAL = math.hypot(*SIZE)
SPOT, LIGHT = DIAGONAL / 35, DIAGONAL / 140
MASK = 2 * LIGHT
POSITIONS = [(x, y) for y in (26.0, 80.0, 133.0) for x in (40.0, 120.0, 200.0)]
#: The share of the light that spreads, of red, green and blue; the rest stays.
SHARES = np.array([0.03, 0.04, 0.06])
WEIGHTS = np.array([0.2126, 0.7152, 0.0722])
WHITE, DARK, NOISE = 0.75, 0.02, 1e-4
#: Exposures of the pictures; that of the lights saturates their own images.
EXPOSURES = {"chart": 1.0, "chart_long": 8.0, "black": 8.0, "spots": 1.0, "lights": 100.0}
EXPOSURES |= {"direct": 0.5, "diffuser": 1.0}
#: Degrees of a pixel, and luminances: of the light and the diffuser 1 at the exposure 1.
SCALE, CANDELAS = 10.0, 250.0
PIXEL = math.radians(1 / SCALE) ** 2


class Radial:
    """A point spread by its integrals: over a rectangle around it, and over circles."""

    def __init__(
        self,
        corner: Callable[[Any, Any], Any],
        encircled: Callable[[Any], Any],
        density: Callable[[Any], Any],
    ) -> None:
        self.corner, self.encircled, self.density = corner, encircled, density

    def rectangle(self, x: Any, y: Any, box: tuple[Any, Any, Any, Any]) -> Any:
        """Integrate over a box (left, top, right, bottom), seen from (x, y)."""
        left, top, right, bottom = box[0] - x, box[1] - y, box[2] - x, box[3] - y
        f = self.corner
        return f(right, bottom) - f(left, bottom) - f(right, top) + f(left, top)

    def disc(self, x: float, y: float, middle: tuple[float, float], radius: float) -> float:
        """Integrate over a disc, seen from (x, y), along all directions."""
        dx, dy = middle[0] - x, middle[1] - y
        distance = math.hypot(dx, dy)
        steps = ((np.arange(96) + 0.5) / 96 - 0.5) * math.pi
        if distance <= radius:
            phi, weights = 2 * steps, np.full(96, 1 / 96)
        else:
            # The directions of the disc alone; this substitution is smooth at its edges.
            half = math.asin(radius / distance)
            phi = math.atan2(dy, dx) + half * np.sin(steps)
            weights = half * np.cos(steps) / 192
        along = dx * np.cos(phi) + dy * np.sin(phi)
        half_chord = np.sqrt(np.maximum(radius**2 - distance**2 + along**2, 0))
        near, far = np.maximum(along - half_chord, 0), np.maximum(along + half_chord, 0)
        return float(((self.encircled(far) - self.encircled(near)) * weights).sum())

    def spread(self, image: Array) -> Array:
        x, y = np.meshgrid(np.arange(1 - WIDTH, WIDTH), np.arange(1 - HEIGHT, HEIGHT))
        kernel = self.rectangle(0, 0, (x - 0.5, y - 0.5, x + 0.5, y + 0.5))
        return np.asarray(fftconvolve(image, kernel))[
            HEIGHT - 1 : 2 * HEIGHT - 1, WIDTH - 1 : 2 * WIDTH - 1
        ]


class Veil(Radial):
    """Light that spreads over the whole picture."""

    def __init__(self) -> None:
        area = WIDTH * HEIGHT
        super().__init__(
            lambda x, y: x * y / area, lambda r: math.pi * r**2 / area, lambda r: 1 / area + 0 * r
        )

    def spread(self, image: Array) -> Array:
        return np.full_like(image, image.mean())


def gaussian(sigma: float) -> Radial:
    def corner(x: Any, y: Any) -> Any:
        return erf(x / (sigma * math.sqrt(2))) * erf(y / (sigma * math.sqrt(2))) / 4

    def encircled(r: Any) -> Any:
        return -np.expm1(-0.5 * (r / sigma) ** 2)

    def density(r: Any) -> Any:
        return np.exp(-0.5 * (r / sigma) ** 2) / (2 * math.pi * sigma**2)

    return Radial(corner, encircled, density)


def harvey(length: float) -> Radial:
    """The scatter (1 + (r / l)^2)^(s / 2) of Harvey and Shack with s = -3, on a plane."""

    def corner(x: Any, y: Any) -> Any:
        return np.arctan(x * y / (length * np.sqrt(length**2 + x**2 + y**2))) / (2 * math.pi)

    def encircled(r: Any) -> Any:
        return 1 - 1 / np.sqrt(1 + (r / length) ** 2)

    def density(r: Any) -> Any:
        return (1 + (r / length) ** 2) ** -1.5 / (2 * math.pi * length**2)

    return Radial(corner, encircled, density)


def both(first: Radial, second: Radial, share: float) -> Radial:
    def mix(name: str) -> Callable[..., Any]:
        one, other = getattr(first, name), getattr(second, name)
        return lambda *at: share * one(*at) + (1 - share) * other(*at)

    return Radial(mix("corner"), mix("encircled"), mix("density"))


SPREADS = {
    "gaussian": gaussian(14.0),
    "two gaussians": both(gaussian(6.0), gaussian(40.0), 0.3),
    "harvey": harvey(8.0),
    "veil": Veil(),
}


def discs(positions: list[tuple[float, float]], radius: float) -> Array:
    """Draw discs: the share of each pixel that they cover."""
    share = np.zeros((HEIGHT, WIDTH))
    offsets = (np.arange(32) + 0.5) / 32 - 0.5
    for x, y in positions:
        for row in range(math.floor(y - radius), math.ceil(y + radius) + 1):
            for column in range(math.floor(x - radius), math.ceil(x + radius) + 1):
                squares = (column - x + offsets) ** 2 + (row - y + offsets[:, np.newaxis]) ** 2
                share[row, column] += (squares <= radius**2).mean()
    return share


def inner(middle: tuple[float, float], radius: float) -> list[tuple[float, float, float]]:
    """Return points of a disc and their weights: the nodes of a mean over it."""
    nodes, weights = np.polynomial.legendre.leggauss(3)
    points: list[tuple[float, float, float]] = []
    for node, weight in zip(nodes, weights, strict=True):
        r = radius * math.sqrt((node + 1) / 2)
        for step in range(6):
            phi = math.pi * step / 3 + node
            x, y = middle[0] + r * math.cos(phi), middle[1] + r * math.sin(phi)
            points.append((x, y, float(weight) / 12))
    return points


FRAME = (-0.5, -0.5, WIDTH - 0.5, HEIGHT - 0.5)


class Lens:
    """A point spread as camera, and its closed forms."""

    def __init__(self, spread: Radial) -> None:
        self.spread = spread
        self.random = np.random.default_rng(3)
        self.chart, self.spots = discs(POSITIONS, SPOT), [discs([at], SPOT) for at in POSITIONS]
        self.lights = [discs([at], LIGHT) for at in POSITIONS]

    def shoot(self, plane: Array, exposure: float, black: float = 0.0) -> NDArray[np.uint16]:
        scene = black + (1 - black) * plane
        tail = self.spread.spread(scene)
        light = exposure * ((1 - SHARES) * scene[..., np.newaxis] + SHARES * tail[..., np.newaxis])
        stored = light + DARK + self.random.normal(0, NOISE, light.shape)
        return np.asarray(np.rint(65535 * np.clip(stored, 0, 1)), np.uint16)

    def pictures(self, black: float = 0.0) -> dict[str, Any]:
        black = black and 1 / black
        chart = 1 - self.chart
        return {
            "chart": self.shoot(chart, WHITE * EXPOSURES["chart"], black),
            "chart_long": self.shoot(chart, WHITE * EXPOSURES["chart_long"], black),
            "black": self.shoot(0 * chart, WHITE * EXPOSURES["black"], black),
            "spots": [self.shoot(1 - spot, WHITE, black) for spot in self.spots],
            "lights": [self.shoot(light, EXPOSURES["lights"]) for light in self.lights],
            "direct": self.shoot(self.lights[4], EXPOSURES["direct"]),
            "diffuser": self.shoot(1 + 0 * chart, 0.9),
        }

    def seen(self, at: tuple[float, float], spots: list[tuple[float, float]]) -> Array:
        """Return the light of a white frame with black spots at a point that is in no edge."""
        x, y = at
        tail = self.spread.rectangle(x, y, FRAME)
        tail -= sum(self.spread.disc(x, y, spot, SPOT) for spot in spots)
        is_black = any(math.dist(at, spot) < SPOT for spot in spots)
        return np.asarray((1 - SHARES) * (not is_black) + SHARES * tail)

    def area(self, middle: tuple[float, float], spots: list[tuple[float, float]]) -> Array:
        points = inner(middle, SPOT / 2)
        return np.asarray(sum(weight * self.seen((x, y), spots) for x, y, weight in points))

    def flare(self, index: int, spots: list[tuple[float, float]]) -> tuple[Array, Array]:
        """Return the black of a spot and the white beside it."""
        x, y = POSITIONS[index]
        steps = [(1, 0), (-1, 0), (0, 1), (0, -1)]
        sides = [self.area((x + 2 * SPOT * dx, y + 2 * SPOT * dy), spots) for dx, dy in steps]
        return self.area((x, y), spots), np.mean(sides, axis=0)

    def beside(self, index: int) -> tuple[Array, Array, Array, int]:
        """Return of a light of 1: flux outside and inside of the mask, its level, pixels outside.

        The mask leaves out pixels whole of which it covers a part.
        """
        middle = POSITIONS[index]
        down, across = np.nonzero(discs([middle], MASK) > 0)
        outside = tail_inside = 0.0
        for x, y, weight in inner(middle, LIGHT):
            boxes = (across - 0.5, down - 0.5, across + 0.5, down + 0.5)
            covered = self.spread.rectangle(x, y, boxes).sum()
            tail_inside += weight * covered
            outside += weight * (self.spread.rectangle(x, y, FRAME) - covered)
        area = math.pi * LIGHT**2
        inside = area * ((1 - SHARES) + SHARES * tail_inside)
        level = (
            1
            - SHARES
            + SHARES
            * sum(
                weight * self.spread.disc(x, y, middle, LIGHT)
                for x, y, weight in inner(middle, LIGHT / 2)
            )
        )
        return area * SHARES * outside, inside, level, WIDTH * HEIGHT - len(down)


def with_luminance(values: Array) -> Array:
    return np.append(values, values @ WEIGHTS)


def expected(lens: Lens) -> dict[str, Array]:
    """Return the closed forms of the figures, by position and channel."""
    found: dict[str, list[Array]] = {}
    direct = lens.beside(4)
    diffuser = lens.area(POSITIONS[4], []) * 0.9
    lux = math.pi * LIGHT**2 * PIXEL * CANDELAS
    for index in range(9):
        black, white = map(with_luminance, lens.flare(index, POSITIONS))
        for kind in "abc":
            found.setdefault(f"iso18844.type_{kind}", []).append(100 * black / white)
        black, white = map(with_luminance, lens.flare(index, [POSITIONS[index]]))
        found.setdefault("iso9358.veiling_glare_index", []).append(100 * black / white)
        outside, _, _, count = lens.beside(index)
        flux, level = with_luminance(outside), with_luminance(direct[2])
        share = 100 * flux / (flux + with_luminance(direct[1]))
        found.setdefault("iso9358.glare_share", []).append(share)
        found.setdefault("ieee2020.normalized_flare", []).append(flux / count / level)
        white = with_luminance(diffuser) * lux / (math.pi * 0.9 * CANDELAS)
        found.setdefault("ieee2020.flare_intensity", []).append(flux / count / white)
    return {name: np.array(values) for name, values in found.items()}


@pytest.mark.parametrize("name", SPREADS)
def test_figures_are_the_closed_forms(name: str) -> None:
    """Within 1 % at each of nine positions, in each channel."""
    lens = Lens(SPREADS[name])
    found = testing.flare(
        lens.pictures(),
        exposures=EXPOSURES,
        dark=DARK,
        pixels_per_degree=SCALE,
        diffuser_luminance=0.9 * CANDELAS,
        illuminance=math.pi * LIGHT**2 * PIXEL * CANDELAS,
        chart=testing.FlareChart(size=SIZE, positions=POSITIONS),
    )
    assert not found.missing
    forms = expected(lens)
    assert {*found.figures} == {*forms}
    for key, wanted in forms.items():
        figure = found.figures[key]
        measured = np.array([figure.channels[channel] for channel in "RGBY"]).T
        np.testing.assert_allclose(measured, wanted, rtol=0.01, err_msg=key)
        assert figure.value == pytest.approx(wanted[:, 3].mean(), rel=0.01)
    spread = found.glare_spread
    assert spread is not None
    radii = np.asarray(spread["radii"])
    chosen = (radii > 8) & (radii < 40)
    inside = lens.beside(4)[1]
    flux = with_luminance(inside)[3]
    form = [lens.spread.disc(radius, 0, (0, 0), LIGHT) for radius in radii[chosen]]
    form = SHARES @ WEIGHTS * np.array(form) / flux
    # On the ring of one position alone, noise is 1 %.
    per_pixel = np.asarray(spread["per_pixel"])[:, chosen].mean(axis=0)
    np.testing.assert_allclose(per_pixel, form, rtol=0.01)
    per_steradian = np.asarray(spread["per_steradian"])[:, chosen].mean(axis=0)
    np.testing.assert_allclose(per_steradian * PIXEL, form, rtol=0.01)
    np.testing.assert_allclose(spread["degrees"], radii / SCALE)


CHART = testing.FlareChart(size=SIZE, positions=POSITIONS)


def measure(pictures: dict[str, Any], **given: Any) -> testing.FlareReport:
    return testing.flare(pictures, **{"exposures": EXPOSURES, "chart": CHART, **given})


def test_the_light_of_black_and_a_dark_frame() -> None:
    """Types A and B are without the light of a chart's black; C and the conditions say it."""
    lens, contrast = Lens(SPREADS["harvey"]), 40.0
    pictures = {
        role: picture
        for role, picture in lens.pictures(black=contrast).items()
        if role in ("chart", "chart_long", "black")
    }
    # Of 16 bits, a mean of the noise.
    pictures["dark_frame"] = lens.shoot(0 * lens.chart, 0)
    chart = testing.FlareChart(size=SIZE, positions=POSITIONS, contrast=contrast)
    found = measure(pictures, chart=chart)
    assert found.conditions["pictures"]["chart"]["dark"] == pytest.approx([DARK] * 4, rel=1e-3)
    black = 1 / contrast
    for index in range(9):
        spot, white = map(with_luminance, lens.flare(index, POSITIONS))
        # All that is white without spots has the light of black.
        beside = white * (1 - black) + black * with_luminance(
            np.mean([lens.area(at, []) for at in [POSITIONS[index]]], axis=0)
        )
        wanted = 100 * (spot * (1 - black) / beside)[3]
        for kind in "ab":
            value = found.figures[f"iso18844.type_{kind}"].positions[index]
            assert value == pytest.approx(wanted, rel=0.01), kind
        value = found.figures["iso18844.type_c"].positions[index]
        assert value == pytest.approx(wanted + 100 * black, rel=0.02)
    (note,) = found.figures["iso18844.type_c"].notes
    assert note == "2.5 % of it is the light of the chart's black"


def test_what_is_saturated_is_no_figure() -> None:
    lens = Lens(SPREADS["gaussian"])
    pictures = lens.pictures()
    del pictures["direct"]
    pictures["chart"][105:, :, 1] = 65535
    found = measure(pictures, dark=DARK)
    type_c = found.figures["iso18844.type_c"]
    assert np.isnan(type_c.positions).tolist() == [False] * 6 + [True] * 3
    assert type_c.value == pytest.approx(np.mean(type_c.positions[:6]))
    assert type_c.notes == (
        "positions 6, 7, 8: the black is saturated",
        "positions 6, 7, 8: the white is saturated",
    )
    told = "the direct image of the light is saturated; give a shorter exposure, direct"
    assert found.missing["ieee2020.normalized_flare"] == told
    assert found.missing["iso9358.glare_spread"] == told
    said = found.conditions["pictures"]
    assert said["chart"]["saturated_pixels"] == [55 * WIDTH]
    assert min(said["lights"]["saturated_pixels"]) > 5
    white = np.array(type_c.statistics["white"])
    np.testing.assert_allclose(type_c.statistics["black"] / white, np.array(type_c.positions) / 100)
    # What a pixel can hold above its dark level, by the exposure.
    assert said["lights"]["highest_measurable"] == pytest.approx((1 - DARK) / 100, rel=1e-6)


def test_light_beside_a_source_that_is_saturated_is_at_least_this() -> None:
    lens = Lens(SPREADS["gaussian"])
    pictures = lens.pictures()
    for index in (2, 5):
        pictures["lights"][index][:3, :4] = 65535
    figure = measure(pictures, dark=DARK).figures["ieee2020.normalized_flare"]
    level = with_luminance(lens.beside(4)[2])[3]
    assert figure.statistics["normalization"] == pytest.approx([level] * 9, rel=0.01)
    most = (1 - DARK) / 100 / level
    assert figure.statistics["maximum_measurable"] == pytest.approx([most] * 9, rel=0.01)
    assert figure.statistics["maximum"][2] == pytest.approx(most, rel=0.01)
    decibels = -10 * np.log10(figure.positions)
    assert figure.statistics["attenuation_db"] == pytest.approx(decibels)
    (note,) = figure.notes
    told = "24 pixels beside the light are saturated; the figure is at least this"
    assert note == f"positions 2, 5: {told}"


def test_a_bloom_has_the_figures_of_its_point_spread(renderer: vkbloom.Renderer) -> None:
    """The charts that a bloom is given, and its own kernel, give the same closed forms."""
    lens = Lens(SPREADS["gaussian"])
    settings = vkbloom.Convolution(
        vkbloom.psf.gaussian(14.0), composite="mix", intensity=SHARES[1], normalize=False
    )
    found = testing.flare(settings, chart=CHART, pixels_per_degree=SCALE, renderer=renderer)
    assert not found.missing
    for name, wanted in expected(lens).items():
        measured = found.figures[name].channels["G"]
        np.testing.assert_allclose(measured, wanted[:, 1], rtol=0.01, err_msg=name)
    assert found.conditions["illuminance"] == pytest.approx(math.pi * LIGHT**2 * PIXEL, rel=0.01)
    grey = testing.flare({"chart": CHART.draw("chart")[..., 0]}, standard="iso18844")
    assert grey.conditions["channels"] == ("Y",)
    assert grey.figures["iso18844.type_c"].value == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(("call", "error"), rows(__file__, "flare reports"))
def test_a_wrong_value_is_refused(call: str, error: str) -> None:
    names = {"flare": testing.flare, "FlareChart": testing.FlareChart, "np": np, "math": math}
    assert_refused(call, error, names)
