"""Point-spread functions against their sources and against mathematical identities."""

from __future__ import annotations

import math
import pickle
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import kn

import vkbloom
from tests.refusals import assert_refused, rows
from vkbloom import psf
from vkbloom._psf.eye import cie_general, cie_total
from vkbloom._psf.radial import bessel
from vkbloom._psf.resampling import box_resample

KERNEL = np.pad(np.full((3, 5), 0.125, np.float32), 2)
KERNEL[3, 4] = 4.0
ALL: list[psf.PSF] = [
    psf.gaussian(1.5),
    psf.spencer("scotopic"),
    psf.cie_general(age=60),
    psf.cie_total(pigment=1),
    psf.harvey_shack(surfaces=8),
    psf.airy(f_number=4),
    psf.aperture(psf.iris(blades=5, size=32), wavelengths=(500, 600)),
    psf.aperture(np.ones((8, 8))),
    psf.fog_glow(16),
    psf.star(rays=3, angle=20, tint=(0.5, 1, 0)),
    psf.unreal(KERNEL, center=(0.5, 0.5), scatter=0.5),
    psf.measured(vkbloom.Separable(blur_strength=0.5), size=(17, 16)),
    psf.samples([[1, 2, 3]]),
]


def by_name(one: psf.PSF) -> str:
    return type(one).__name__


def on_the_plane(values: NDArray[Any], theta: NDArray[Any]) -> float:
    """Integrate a density per steradian over angles in degrees, as if the sphere were a plane."""
    return float(np.trapezoid(2 * math.pi * values * theta, theta)) * math.radians(1) ** 2


@pytest.mark.parametrize("one", ALL, ids=by_name)
@pytest.mark.parametrize("size", [(1, 1), (12, 7), (7, 12)])
def test_arrays(one: psf.PSF, size: tuple[int, int]) -> None:
    """The peak is at [h // 2, w // 2], and a larger array has a smaller one in its middle."""
    array = one.array(size, 3.0)
    assert array.shape == (size[1], size[0], 3)
    assert array.dtype == np.float64
    if isinstance(one, psf.unreal | psf.star):
        return  # resized with the frame
    large = one.array((41, 41), 3.0)
    top, left = 20 - size[1] // 2, 20 - size[0] // 2
    np.testing.assert_allclose(
        array, large[top : top + size[1], left : left + size[0]], rtol=1e-9, atol=1e-15
    )
    if not isinstance(one, psf.samples):
        assert array[..., 1].max() == array[size[1] // 2, size[0] // 2, 1]


@pytest.mark.parametrize("one", ALL, ids=by_name)
def test_energy(one: psf.PSF) -> None:
    """Circles grow to the whole energy, and the MTF starts at 1."""
    radii = [0.0, 1.0, 10.0, 90.0 if one.unit == "degree" else 1e6]
    inside = one.encircled_energy(radii)
    assert inside.shape == (4, 3)
    assert (np.diff(inside, axis=0) >= -1e-7).all()
    np.testing.assert_allclose(inside[-1], one.energy(), rtol=1e-5)
    mtf = one.mtf([0.0, 0.25])
    assert mtf.shape == (2, 3)
    np.testing.assert_allclose(mtf[0], 1, rtol=1e-9)
    assert (mtf[1] < 1).all()


@pytest.mark.parametrize("one", ALL, ids=by_name)
def test_values(one: psf.PSF) -> None:
    """Equal, and with the same hash, by name and parameters."""
    again: psf.PSF = psf.PSF.from_json(one.to_json())
    assert again == one
    assert hash(again) == hash(one)
    assert type(again) is type(one)
    assert pickle.loads(pickle.dumps(one)) == one
    assert one != psf.gaussian(7)
    assert len(repr(one)) < 600


class TestStar:
    def test_it_is_the_same_in_pictures_of_all_sizes(self) -> None:
        one = psf.star(rays=4, angle=30, length=0.2, width=0.01, surround=1.2)
        small, large = (
            one.kernel((side, side * 2 // 3), (side - 1, side - 1)) for side in (80, 240)
        )
        reduced = box_resample(large, (large.shape[0] // 2, large.shape[1] // 2), (1 / 3, 1 / 3))
        reduced = reduced[1:-1, 1:-1]
        # A coarse grid samples the fall of the rays otherwise.
        assert np.abs(reduced - small).max() < 0.05 * np.abs(small).max()
        np.testing.assert_allclose(small.sum(axis=(0, 1)), -0.2, atol=1e-9)

    def test_formula(self) -> None:
        """One ray to the right: p(d) along it, a Gaussian across it."""
        values = psf.star(1, length=0.5, width=0.02).kernel((200, 200))[..., 0]
        assert values.sum() == pytest.approx(1)
        row, column = (side // 2 for side in values.shape)
        distances = np.array([5, 20, 60, 90])
        along = values[:, column + distances].sum(axis=0)
        np.testing.assert_allclose(along / along[0], ((100 - distances) / 95) ** 2, rtol=1e-3)
        across = values[row - 8 : row + 9, column + 20]
        expected = np.exp(-(np.arange(-8, 9) ** 2) / 32)
        np.testing.assert_allclose(across / across.max(), expected, rtol=1e-3)

    @pytest.mark.parametrize("name", ["star4", "star6", "anamorphic"])
    def test_large_areas_have_no_rays(self, name: str, renderer: vkbloom.Renderer) -> None:
        image = np.full((120, 180, 3), 0.01, np.float32)
        image[:60] = 1.0
        sky = renderer.apply(image, vkbloom.presets[name], framebuffers="final")["final"]
        assert np.abs(sky[66:, 20:-20, :3] - 0.01).max() < 0.02
        image[:] = 0.01
        image[60:62, 90:92] = 1.0
        light = renderer.apply(image, vkbloom.presets[name], framebuffers="final")["final"]
        assert (light[..., 2] > 0.03).sum() > 30


def test_spencer_terms() -> None:
    """Each term distributes 1: f0, f1, f3 over the plane, f2 over the hemisphere."""
    theta = np.concatenate([[0], np.geomspace(1e-6, 89, 40000)])
    f0 = 2.61e6 * np.exp(-((theta / 0.02) ** 2))
    f1 = 20.91 / (theta + 0.02) ** 3
    f3 = 436.9 * np.exp(-19.75 * (theta - 3) ** 2)
    for term in (f0, f1, f3):
        assert on_the_plane(term, theta) == pytest.approx(1, abs=2e-3)
    f2 = 72.37 / (theta + 0.02) ** 2
    ring = 2 * math.pi * np.sin(np.radians(theta)) * math.radians(1)
    assert float(np.trapezoid(f2 * ring, theta)) == pytest.approx(1, abs=2e-3)
    density = psf.spencer().density(theta)[:, 0]
    np.testing.assert_allclose(density, 0.384 * f0 + 0.478 * f1 + 0.138 * f2, rtol=1e-12)
    halo = psf.spencer("scotopic", (568, 568, 568)).density(theta)[:, 2]
    expected = 0.282 * f0 + 0.478 * f1 + 0.207 * f2 + 0.033 * f3
    np.testing.assert_allclose(halo, expected, rtol=1e-12)


@pytest.mark.parametrize("state", ["photopic", "mesopic", "scotopic"])
def test_spencer_distributes_one(state: Any) -> None:
    np.testing.assert_allclose(psf.spencer(state).energy(), 1, atol=1e-3)


@pytest.mark.parametrize(("age", "pigment"), [(0, 0), (35, 0.5), (70, 0.5), (80, 1.2)])
def test_cie(age: float, pigment: float) -> None:
    """The total glare distributes 1, and follows the general one where both apply."""
    total = cie_total(age, pigment)
    np.testing.assert_allclose(total.energy(), 1, atol=0.032)
    theta = np.array([1.0, 3.0, 10.0, 30.0])
    # The formula's last division is the share that the veil leaves.
    share = 1 + pigment * (0.0417 + 0.055 * (age / 70) ** 4)
    ratio = total.density(theta)[:, 0] * share / cie_general(age, pigment).density(theta)[:, 0]
    low, high = np.array([1.1, 0.94, 0.85, 0.83]), np.array([1.26, 1.07, 0.91, 0.86])
    assert (ratio > low - 0.005).all()
    assert (ratio < high + 0.005).all()


def hdrvdp_transforms(rho: Any, age: float, pigment: float) -> tuple[Any, Any]:
    """Transform the constants that HDR-VDP 3.0.7 has for CIE 135/1, utils/hdrvdp_otf_cie99.m.

    The first result is its own formula, the transform along a line, without the terms that have a
    part at 0 alone. The second one is that of the plane (Hankel), in sr, of the same constants.
    """
    c1, c2, c3, c4, c5, c6, c7 = 9.2e6, 0.08, 0.0046, 1.5e5, 0.045, 1.6, 400
    c8, c10, c11, c13, c14 = 0.1, 1300, 0.8, 0.0417, 0.055
    w, old, p = 2 * math.pi * np.asarray(rho), (age / 70) ** 4, pigment
    share = 1 + p * (c13 + c14 * old)
    line = (1 - c2 * old) * 2 * w * (c1 * c3**2 * kn(1, c3 * w) + c4 * c5**2 * kn(1, c5 * w))
    veil = c7 * c8 * math.pi * np.exp(-c8 * w)
    veil += p * 2 * (c8 * c11 * kn(0, c8 * w) + c8**2 * c10 * w * kn(1, c8 * w))
    core = c1 * c3**2 * np.exp(-c3 * w) + c4 * c5**2 * np.exp(-c5 * w)
    wide = c7 * c8**2 * kn(0, c8 * w)
    wide += p * np.exp(-c8 * w) * (c10 * c8**2 + c11 * c8 / w)
    plane = 2 * math.pi * ((1 - c2 * old) * core + (1 + c6 * old) * wide)
    return (line + (1 + c6 * old) * veil) / share, plane * math.radians(1) ** 2 / share


@pytest.mark.parametrize(("age", "pigment"), [(24, 0.5), (0, 0), (70, 1.2)])
def test_the_second_witness_of_cie_total(age: float, pigment: float) -> None:
    total, rho = psf.cie_total(age, pigment), np.array([1.0, 5.0, 20.0])
    line, plane = hdrvdp_transforms(rho, age, pigment)
    theta = np.concatenate([[0], np.geomspace(1e-6, 2000, 200_001)])
    old = (age / 70) ** 4
    at_0 = ((1 + 1.6 * old) * 3e-8 * theta**2 + 0.0025 * pigment) / (
        1 + pigment * (0.0417 + 0.055 * old)
    )
    density = total.density(theta)[:, 0] - at_0
    found = [2 * np.trapezoid(density * np.cos(2 * math.pi * one * theta), theta) for one in rho]
    np.testing.assert_allclose(found, line, rtol=1e-5)
    # The MTF is that of the plane; as that of a plane, the one along a line would be another.
    mtf = total.mtf(rho)[:, 0] * total.energy()[0]
    np.testing.assert_allclose(mtf, plane, rtol=1e-4)
    assert abs(line[2] / line[0] / (plane[2] / plane[0]) - 1) > 0.2


def test_the_eye_beside_a_fitted_mtf() -> None:
    """HDR-VDP 2.2 and 3 fit four exponentials to measurements: within 0.04 of age 24."""
    first, second = 0.061466549455263, 0.99727370023777070
    shares = [0.426 * second, 0.574 * second, (1 - second) * first, (1 - second) * (1 - first)]
    rho = np.array([0.5, 1, 2, 4, 8, 16, 30])
    fitted = np.exp(-np.outer(rho, [0.028, 0.37, 37, 360])) @ shares
    np.testing.assert_allclose(psf.cie_total(24, 0.5).mtf(rho)[:, 0], fitted, atol=0.04)


def test_cie_general() -> None:
    """At 10 degrees, age 62.5 and p = 1: 10 / 1000 + (5 / 100 + 0.1 / 10) 2 + 0.0025."""
    glare = cie_general(age=62.5, pigment=1)
    np.testing.assert_allclose(glare.density(10.0), 0.01 + 0.06 * 2 + 0.0025)
    np.testing.assert_array_equal(glare.density(0.0), glare.density(0.1))


def test_harvey_shack() -> None:
    """At the centre N b0; half of the slope's roll-off at sin theta = l; 0 at the horizon."""
    veil = psf.harvey_shack()
    peak = 14 * 0.36 * 0.204**-1.86
    np.testing.assert_allclose(veil.density(0.0), peak)
    angle = math.degrees(math.asin(0.00204))
    np.testing.assert_allclose(veil.density(angle), peak * 2**-0.93 * math.cos(math.radians(angle)))
    np.testing.assert_allclose(veil.density(90.0), 0, atol=1e-15)
    np.testing.assert_allclose(veil.energy(), 0.025, rtol=1e-3)


@pytest.mark.parametrize("scale", [0.01, 0.4, 3.0, 25.0])
def test_pixels_add_up(scale: float) -> None:
    """However narrow the peak is: the pixels hold what the circles around them do."""
    side = 2 * int(2 * scale) + 1
    for one in (psf.spencer("mesopic"), psf.cie_total(), psf.harvey_shack()):
        total = one.array((side, side), scale).sum(axis=(0, 1))
        inner, outer = one.encircled_energy([side / scale / 2, side / scale / math.sqrt(2)])
        assert (inner - 1e-4 <= total).all()
        assert (total <= outer + 1e-4).all()


def test_pixels_of_a_disc() -> None:
    """Against the mean of many samples, off the centre too."""
    one = psf.spencer("scotopic")
    array = one.array((9, 9), 1.0)
    fine = (np.arange(400) + 0.5) / 400 - 0.5
    for row, column in ((4, 6), (1, 4), (0, 0)):
        theta = np.hypot(fine + column - 4, fine[:, np.newaxis] + row - 4)
        samples = one.density(theta) * (np.sinc(theta / 180) * math.radians(1) ** 2)[..., None]
        np.testing.assert_allclose(array[row, column], samples.mean(axis=(0, 1)), rtol=2e-5)


def test_gaussian() -> None:
    """Variances add up, a pixel's own being 1 / 12."""
    lines = psf.gaussian(2.5).array((65, 65))[..., 0]
    assert lines.sum() == pytest.approx(1, abs=1e-12)
    distance = np.arange(65) - 32
    variance = (lines.sum(axis=0) * distance**2).sum()
    assert variance == pytest.approx(2.5**2 + 1 / 12, rel=1e-6)
    sampled = psf.samples(psf.gaussian(2.5).array((65, 65)))
    cycles = np.array([0.02, 0.1, 0.2])
    # A pixel integrates: a sinc.
    expected = psf.gaussian(2.5).mtf(cycles)[:, 0] * np.sinc(cycles)
    np.testing.assert_allclose(sampled.mtf(cycles)[:, 0], expected, atol=1e-6)


def test_bessel() -> None:
    """Tables: Abramowitz and Stegun, 9.1; the asymptotic series joins on."""
    x = np.array([0.0, 1.0, 10.0, 2.404825557695773])
    j0 = [1.0, 0.7651976865579666, -0.2459357644513483, 0.0]
    j1 = [0.0, 0.4400505857449335, 0.0434727461688614, 0.5191474972894669]
    np.testing.assert_allclose(bessel(0, x), j0, atol=1e-14)
    np.testing.assert_allclose(bessel(1, x), j1, atol=1e-14)
    for order in (0, 1):
        near, far = bessel(order, np.array([25 - 1e-9, 25 + 1e-9]))
        assert near == pytest.approx(far, abs=1e-9)


def test_airy() -> None:
    """The first dark ring is at 1.22 wavelength f_number; a square holds what its circles do."""
    rings = psf.airy(f_number=8, wavelength=550, pixel_pitch=1)
    dark = 1.2196698912665045 * 0.55 * 8
    assert rings.encircled_energy([dark])[0, 0] == pytest.approx(0.8378, abs=1e-4)
    array = rings.array((33, 33))[..., 0]
    inner, outer = rings.encircled_energy([16.5, 16.5 * math.sqrt(2)])[:, 0]
    assert inner < array.sum() < outer
    # The whole circle up to the dark ring, of pixels that are a tenth as large.
    fine = psf.airy(f_number=8, wavelength=550, pixel_pitch=0.1).array((121, 121))[..., 0]
    place = np.arange(121) - 60
    inside = np.hypot(place, place[:, np.newaxis]) <= 10 * dark
    assert fine[inside].sum() == pytest.approx(0.8378, abs=1e-3)
    np.testing.assert_allclose(rings.mtf([0, 1 / 8.8, 1])[:, 0], [1, 0.391, 0], atol=1e-3)


def test_a_circular_aperture_gives_the_airy_pattern() -> None:
    circle = psf.iris(blades=64, roundness=1, size=128)
    array = psf.aperture(circle, wavelengths=(550,)).array((33, 33))
    expected = psf.airy(f_number=8, wavelength=550, pixel_pitch=4).array((33, 33))
    np.testing.assert_allclose(array, expected, atol=0.004 * expected.max())


@pytest.mark.parametrize(("blades", "rays"), [(5, 10), (6, 6), (7, 14), (8, 8)])
def test_rays(blades: int, rays: int) -> None:
    """As many as blades where these are even, else twice as many, square to the edges."""
    mask = psf.iris(blades=blades, size=256, rotation=5)
    star = psf.aperture(mask, f_number=16, wavelengths=(550,)).array((161, 161))[..., 0]
    angles = np.arange(720) / 720 * 2 * np.pi
    along = np.zeros(720)
    for radius in np.linspace(40, 75, 141):
        rows = np.round(80 - radius * np.sin(angles)).astype(int)
        along += star[rows, np.round(80 + radius * np.cos(angles)).astype(int)]
    smooth = np.fft.ifft(np.fft.fft(along) * (np.abs(np.fft.fftfreq(720) * 720) < 60)).real
    peaks = (smooth > np.roll(smooth, 1)) & (smooth > np.roll(smooth, -1))
    bright = angles[peaks & (smooth > 0.35 * smooth.max())]
    assert len(bright) == rays
    first = np.radians(5 + 180 / blades)
    step = 2 * np.pi / rays
    off = (bright - first + step / 2) % step - step / 2
    assert np.abs(off).max() < np.radians(2)


def test_the_colours_of_a_star() -> None:
    """Red reaches farther than blue by the wavelengths, and the sum is white."""
    star = psf.aperture(psf.iris(blades=4, size=64), f_number=22, pixel_pitch=2)
    np.testing.assert_allclose(star.energy(), 1)
    reach = [
        np.interp(0.9, star.encircled_energy(np.arange(60))[:, i], np.arange(60)) for i in (0, 2)
    ]
    assert 1.1 < reach[0] / reach[1] < 1.6


def test_iris() -> None:
    """Area of polygons, the circle; what dust and scratches take; the seed."""
    side = 128
    areas = {n: n / 2 * math.sin(2 * math.pi / n) for n in (3, 6, 9)}
    for blades, area in areas.items():
        mask = np.asarray(psf.iris(blades=blades, size=side))
        assert mask.sum() / (side / 2) ** 2 == pytest.approx(area, rel=2e-3)
    circle = np.asarray(psf.iris(roundness=1, size=side))
    assert circle.sum() / (side / 2) ** 2 == pytest.approx(math.pi, rel=1e-3)
    clean = np.asarray(psf.iris(size=side))
    dirty = np.asarray(psf.iris(size=side, dust=20, scratches=5, seed=1))
    assert (dirty <= clean).all()
    assert 0.5 < dirty.sum() / clean.sum() < 0.999
    assert (dirty == np.asarray(psf.iris(size=side, dust=20, scratches=5, seed=1))).all()
    assert (dirty != np.asarray(psf.iris(size=side, dust=20, scratches=5, seed=2))).any()
    # A corner on the right, none on the left of a triangle.
    triangle = np.asarray(psf.iris(blades=3, size=side))
    assert triangle[side // 2, -4] == 1
    assert triangle[side // 2, 8] == 0


def test_fog_glow() -> None:
    kernel = psf.fog_glow(32).array((32, 32))[..., 0]
    assert kernel[16, 16] == 1
    assert kernel[:, 0].max() == 0
    # u = 0.5, v = 0: r = 0.25 * 8.
    assert kernel[16, 24] == pytest.approx(math.exp(-9 * 2**0.125) * 0.5)


def test_unreal() -> None:
    """The centre's light stays; the rest is scattered; both tinted."""
    image = np.zeros((16, 16, 3), np.float32)
    image[8, 8] = (9, 5, 5)
    image[8] += 0.5
    spread = psf.unreal(image, scatter=1.0)
    # M = 0.5, C = 9 or 5, S = 16 * 0.5.
    total = np.array([17.0, 13.0, 13.0])
    np.testing.assert_allclose(spread.energy(), total / 17)
    array = spread.array((16, 16))
    np.testing.assert_allclose(array[8, 3], total / 17 * (8 / total) / 16)
    np.testing.assert_allclose(array[8, 8], total / 17 * ((total - 8) / total + 8 / total / 16))
    # Nothing but the light that stays.
    alone = psf.unreal(image, scatter=0).array((16, 16))
    np.testing.assert_allclose(alone[8, 8], total / 17)
    assert np.count_nonzero(alone[..., 0]) == 1
    # All of it scattered.
    np.testing.assert_allclose(
        psf.unreal(image, scatter=100).array((16, 16))[8, 8], total / 17 / 16
    )
    wide = psf.unreal(image, size=2).array((16, 16))
    assert wide[8, 3, 0] < array[8, 3, 0]
    assert psf.unreal(image).kernel((16, 9)).shape == (17, 31, 3)


def test_the_kernel_of_a_thin_frame_has_no_hidden_rows() -> None:
    spread = psf.unreal(np.random.default_rng(1).random((33, 33)))
    whole = spread.kernel((200, 200))
    np.testing.assert_allclose(spread.kernel((200, 1))[0], whole[199], atol=1e-15)
    np.testing.assert_allclose(spread.kernel((1, 200))[:, 0], whole[:, 199], atol=1e-15)
    tracemalloc.start()
    try:
        spread.kernel((2000, 1))
        spread.kernel((1, 2000))
        # 2000 x 2000 pixels would be 96 MB.
        assert tracemalloc.get_traced_memory()[1] < 4e6
    finally:
        tracemalloc.stop()


def test_a_pattern_is_computed_as_far_as_it_is_wanted() -> None:
    pattern = psf.aperture(psf.iris(size=64), f_number=64)
    whole = pattern.native_array()
    middle = len(whole) // 2
    part = whole[middle - 20 : middle + 21, middle - 4 : middle + 4]
    np.testing.assert_allclose(pattern.array((8, 41)), part, atol=1e-14)
    # The complete pattern would have 23,361 x 23,361 pixels.
    large = psf.aperture(psf.iris(size=64), f_number=2000)
    assert large.array((8, 41)).shape == (41, 8, 3)


def test_measured() -> None:
    settings = vkbloom.Separable(weights=(0.5, 0.25), blur_strength=1.0)
    spread = psf.measured(settings, size=(9, 8))
    np.testing.assert_allclose(
        spread.array((3, 3))[..., 0],
        [[0.0625, 0.125, 0.0625], [0.125, 0.25, 0.125], [0.0625, 0.125, 0.0625]],
    )


@pytest.mark.parametrize("scale", [(0.5, 0.25), (1.0, 1.0), (3.0, 1.7), (0.01, 0.01)])
def test_resampling(scale: tuple[float, float]) -> None:
    """Sums and centroids are kept."""
    kernel = np.random.default_rng(0).random((7, 10, 3))
    made = box_resample(kernel, (3, 5), scale)
    assert all(side % 2 for side in made.shape[:2])
    np.testing.assert_allclose(made.sum(axis=(0, 1)), kernel.sum(axis=(0, 1)))
    rows = np.arange(made.shape[0]) - made.shape[0] // 2
    expected = (kernel.sum(axis=1)[:, 0] * (np.arange(7) - 3)).sum() * scale[0]
    if scale[0] >= 1:
        assert (made.sum(axis=1)[:, 0] * rows).sum() == pytest.approx(expected, rel=1e-6, abs=1e-9)
    if scale == (1.0, 1.0):
        np.testing.assert_allclose(made[:, :10], kernel, atol=1e-12)


def test_save(tmp_path: Path) -> None:
    one = psf.spencer()
    path = one.save(tmp_path / "kernel.exr", (33, 32), 10.0)
    np.testing.assert_array_equal(vkbloom.read(path), one.array((33, 32), 10.0).astype(np.float32))


def test_picture() -> None:
    assert psf.gaussian(4)._repr_png_()[:8] == b"\x89PNG\r\n\x1a\n"


@pytest.mark.parametrize(("call", "error"), rows(__file__, "point spread functions"))
def test_a_wrong_value_is_refused(call: str, error: str) -> None:
    assert_refused(call, error, {"psf": psf, "np": np, "math": math, "vkbloom": vkbloom})
