"""Kernels that depend on the place, against the sum over all pixels."""

from __future__ import annotations

import functools
import pickle
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.planned import Inputs, Passes, in_floats
from tests.psf.fields import (
    FIELDS,
    Array,
    Field,
    as_colours,
    bilinear,
    field_of,
    off_centre,
    round_spot,
    scatter,
    vignetted,
)
from tests.variants import VARIANTS, open_variant
from vkbloom import psf, reference, testing

FRAME = 21, 15
BOUNDARIES = "zero", "edge", "wrap"


def picture(frame: tuple[int, int] = FRAME, seed: int = 5) -> Array:
    """Return a dark picture with some lights, one of them at the edge."""
    draw = np.random.default_rng(seed)
    image = 0.1 * draw.random((frame[1], frame[0], 3))
    image[2, 3] = 5, 3, 1
    image[-1, -4] = 2
    return image


def grid(rows: int = 3, columns: int = 4, colours: bool = False) -> Array:
    """Return kernels that have nothing in common."""
    draw = np.random.default_rng(7)
    kernels = draw.random((rows, columns, 5, 8, *[3] * colours)).astype(np.float32)
    return np.asarray(kernels / kernels.sum(axis=(2, 3), keepdims=True))


POSITIONS = (1.5, 6.0, 14.25, 18.0), (2.0, 7.5, 13.0)
Case = tuple[psf.Varying, Callable[[float, float], Array]]


def of_function(
    function: Field, kind: type[psf.Varying] = psf.Varying, frame: tuple[int, int] = FRAME
) -> Case:
    return kind(function=function), lambda x, y: function(*field_of(x, y, frame))


def of_grid(kernels: Array, kind: type[psf.Varying] = psf.Varying) -> Case:
    return kind(kernels, POSITIONS), bilinear(kernels, *map(np.array, POSITIONS))


@pytest.mark.parametrize("boundary", BOUNDARIES)
@pytest.mark.parametrize(
    "case",
    [
        of_function(off_centre),
        of_function(off_centre, psf.Gathered),
        of_grid(grid()),
        of_grid(grid(colours=True), psf.Gathered),
    ],
    ids=["function", "gathered", "grid", "gathered_grid"],
)
def test_reference_is_the_sum_over_all_pixels(case: Case, boundary: Any) -> None:
    lens, kernel_at = case
    image = picture()
    bloom = reference.apply(image, vkbloom.Convolution(lens, boundary=boundary))["bloom"]
    exact = scatter(image, kernel_at, boundary, gathers=lens.gathers)
    np.testing.assert_allclose(bloom[..., :3], exact, rtol=0, atol=1e-7 * exact.max())


@pytest.mark.parametrize("function", FIELDS)
@pytest.mark.parametrize("frame", [FRAME, (190, 160)], ids=["each_pixel", "between"])
def test_components_are_within_the_tolerance(function: Field, frame: tuple[int, int]) -> None:
    """The error is reported, and the kernels after those of the mean have no flux."""
    lens = psf.Varying(function=function, tolerance=3e-3)
    made = lens.components(frame)
    assert made.error <= 3e-3
    draw = np.random.default_rng(3)
    xs, ys = (draw.integers(0, side, 20).astype(float) for side in frame)
    for x, y, kernel in zip(xs, ys, made.at(xs, ys), strict=True):
        exact = function(*field_of(x, y, frame))
        assert np.abs(kernel - exact).max() <= 3e-3 * exact.max()
    sums = made.kernels.sum(axis=(1, 2)).reshape(len(made.kernels), -1)
    np.testing.assert_allclose(sums[1:], 0, atol=1e-13)


def test_a_grid_is_exact() -> None:
    """A grid needs as many kernels as it has, or fewer if these are alike."""
    kernels = grid()
    assert len(psf.Varying(kernels, POSITIONS).components(FRAME).kernels) == 12
    alike = kernels[:1, :1] * np.linspace(1, 0.5, 12).reshape(3, 4, 1, 1).astype(np.float32)
    made = psf.Varying(alike, POSITIONS).components(FRAME)
    assert len(made.kernels) == 1
    assert made.error <= 1e-7
    same = psf.Varying(np.broadcast_to(kernels[1, 2], kernels.shape)).components(FRAME)
    np.testing.assert_array_equal(same.kernels, kernels[1:2, 2])
    np.testing.assert_array_equal(same.weights, 1)


def test_places() -> None:
    """Positions are spread from edge to edge, and kernels outside of them are the nearest ones."""
    kernels = grid()
    frame = 31, 21
    lens = psf.Varying(kernels)
    np.testing.assert_allclose(lens.at(0, 20, frame)[..., 1], kernels[2, 0])
    between = (kernels[1, 0] + kernels[1, 1]) / 2
    np.testing.assert_allclose(lens.at(5, 10, frame)[..., 0], between, rtol=1e-6)
    lens = psf.Varying(kernels, POSITIONS)
    np.testing.assert_allclose(lens.at(30, -5, frame)[..., 2], kernels[0, 3])
    points = np.stack(np.meshgrid(*POSITIONS), axis=-1)
    assert psf.Varying(kernels, points) == lens == psf.Varying(kernels, points.reshape(-1, 2))
    assert lens != psf.Varying(kernels)
    assert lens != psf.Gathered(kernels, POSITIONS)


def test_arguments_of_functions() -> None:
    """A function may name what it needs."""
    seen: list[tuple[float, ...]] = []

    def spot(radius: float, angle: float, aspect: float) -> Array:
        seen.append((radius, angle, aspect))
        return np.ones((3, 3))

    lens = psf.Varying(function=spot, size=(3, 3))
    lens.at(39.5, 29.5, (40, 30))
    # The corner of the picture, half a pixel outside of the last one's centre.
    np.testing.assert_allclose(seen[-1], (1, np.arctan2(30, 40), 4 / 3))
    assert psf.Varying(function=lambda x, y: [[x, y]]).at(0, 0, (2, 2)).shape == (1, 2, 3)


def test_a_side_of_one_pixel() -> None:
    """A grid from the first pixel to the last shows its middle there."""
    kernels = grid(2, 3)
    made = psf.Varying(kernels).at(0, 0, (1, 1))[..., 0]
    np.testing.assert_allclose(made, kernels[:, 1].mean(axis=0), rtol=1e-6)
    np.testing.assert_array_equal(psf.Varying(kernels).at(3, 0, (7, 5))[..., 0], kernels[0, 1])


def test_chromatic_fields() -> None:
    """Widths are scaled and spots are shifted outwards, channel by channel, with their sums."""
    scales, lateral = (1.2, 1.0, 0.9), (-1.5, 0.0, 2.0)
    lens = psf.Varying(function=round_spot, scales=scales, lateral=lateral)
    frame = 40, 30
    u, v = field_of(36, 25, frame)
    kernel = lens.at(36, 25, frame)
    y, x = np.mgrid[-10:11, -10:11].astype(float)
    deviation = 0.9 * (1 + 2 * np.hypot(u, v))
    for c in range(3):
        width = deviation * scales[c]
        wanted = np.exp(-((x - lateral[c] * u) ** 2 + (y - lateral[c] * v) ** 2) / (2 * width**2))
        np.testing.assert_allclose(kernel[..., c], wanted / wanted.sum(), atol=1e-4 * kernel.max())
    np.testing.assert_allclose(kernel.sum(axis=(0, 1)), 1)


def test_lateral_colour_of_a_grid(renderer: vkbloom.Renderer) -> None:
    """Each place has its own shift, also between the positions of a grid, and of one kernel."""
    y, x = np.mgrid[-7:8, -7:8].astype(float)

    def spot(u: float, v: float) -> Array:
        shifts = (-2.0, 0.0, 2.0)
        spots = [np.exp(-((x - c * u) ** 2 + (y - c * v) ** 2) / 4.5) for c in shifts]
        return np.stack([spot / spot.sum() for spot in spots], axis=-1)

    image = picture().astype(np.float32)
    wanted = scatter(image, lambda x, y: spot(*field_of(x, y, FRAME)), "zero")
    lens = psf.Varying(np.tile(spot(0, 0)[..., 1], (1, 2, 1, 1)), lateral=(-2.0, 0.0, 2.0))
    settings = vkbloom.Convolution(lens, composite="mix", format="rgba32float")
    for made in (renderer.apply(image, settings), reference.apply(image, settings)):
        np.testing.assert_allclose(made["bloom"][..., :3], wanted, atol=2e-3 * wanted.max())
    with pytest.raises(ValueError, match="lateral colour each pixel"):
        settings.kernel(FRAME)


class Gridded:
    """What is used of photutils' GriddedPSFModel, with positions in another order."""

    grid_xypos = (18.0, 2.0), (4.0, 2.0), (4.0, 12.0), (18.0, 12.0)
    oversampling = np.array([2, 2])
    data = np.zeros((4, 13, 13))

    def evaluate(self, x: Array, y: Array, flux: float, x_0: float, y_0: float) -> Array:
        return np.asarray(flux * np.exp(-((x - x_0) ** 2) - (y - y_0) ** 2) * (x_0 + 100 * y_0))


def test_models_of_photutils() -> None:
    lens = psf.Varying(Gridded())
    assert lens.positions == ((4.0, 18.0), (2.0, 12.0))
    assert lens.kernel_size == (7, 7)
    for x, y in Gridded.grid_xypos:
        peak = lens.at(x, y, FRAME)[3, 3, 0]
        assert peak == np.float32(x + 100 * y)


def test_storage(tmp_path: Any) -> None:
    """A grid is stored as JSON, and in a Zarr array; a function is known to its process."""
    zarr = pytest.importorskip("zarr", reason="the extra grid is not installed")
    patches = zarr.create_array(tmp_path / "patches", data=grid())
    lens = psf.Varying(patches, POSITIONS, scales=(1, 1, 0.9))
    assert lens == psf.Varying(grid(), POSITIONS, scales=(1, 1, 0.9))
    assert psf.PSF.from_json(lens.to_json()) == lens
    assert hash(psf.PSF.from_dict(lens.to_dict())) == hash(lens)
    assert pickle.loads(pickle.dumps(lens)) == lens
    of_function = psf.Varying(function=round_spot)
    assert pickle.loads(pickle.dumps(of_function)) == of_function
    text = of_function.to_json()
    assert psf.PSF.from_json(text) == of_function
    other = psf.Varying(function=functools.partial(round_spot))
    assert psf.PSF.from_dict(other.to_dict()) == other != of_function
    unknown = text.replace("round_spot", "square_spot")
    with pytest.raises(ValueError, match=r"of another process; .* sampled\(frame, places\)"):
        psf.PSF.from_json(unknown)
    lens = weighted()
    assert psf.PSF.from_json(lens.to_json()) == lens != weighted(seed=10)
    stored = of_function.sampled(FRAME, (5, 4))
    np.testing.assert_allclose(stored.at(20, 14, FRAME), of_function.at(20, 14, FRAME), atol=1e-8)


def test_facts() -> None:
    """Energies are means over the field, and the atlas shows kernels at their places."""
    lens = psf.Varying(grid(), POSITIONS)
    np.testing.assert_allclose(lens.energy(), 1, rtol=1e-6)
    np.testing.assert_allclose(lens.encircled_energy([0, 100])[1], 1, rtol=1e-6)
    np.testing.assert_allclose(lens.mtf([0.0]), 1)
    assert 0.75 < psf.Varying(function=vignetted).energy()[0] < 0.9
    drawn = lens.array((40, 30))
    assert drawn.shape == (30, 40, 3)
    # 5 x 6 kernels, each of a sum of 1.
    np.testing.assert_allclose(drawn.sum(axis=(0, 1)), 30, rtol=1e-5)
    np.testing.assert_allclose(lens.array((7, 3)).shape, (3, 7, 3))
    with pytest.raises(ValueError, match="not one kernel"):
        lens.kernel(FRAME)


@pytest.fixture(scope="module", params=VARIANTS)
def any_renderer(request: pytest.FixtureRequest) -> Iterator[vkbloom.Renderer]:
    with open_variant(request.param) as opened:
        yield opened


def weighted(kind: type[psf.Varying] = psf.Varying, seed: int = 9) -> psf.Varying:
    """Return five kernels, each with weights at the places of a grid."""
    weights = np.random.default_rng(seed).random((5, 3, 4)) - 0.2
    return kind(grid(1, 5, colours=True)[0], POSITIONS, weights=weights)


def of_weights(kind: type[psf.Varying] = psf.Varying) -> Case:
    lens = weighted(kind)
    kernels = np.tensordot(lens.weights.array, lens.kernels.array, (0, 0))
    return lens, bilinear(kernels, *map(np.array, POSITIONS))


SMALL = 17, 12
#: Each field with the function of a place in pixels of a picture of SMALL.
CASES: dict[str, Case] = {
    **{function.__name__: of_function(function, frame=SMALL) for function in FIELDS},
    "grid": of_grid(grid()),
    "coloured_grid": of_grid(grid(colours=True)),
    "vignetted_grid": of_grid(grid() * np.linspace(1, 0.3, 12).reshape(3, 4, 1, 1)),
    "gathered": of_grid(grid(colours=True), psf.Gathered),
    "weighted": of_weights(),
}


@functools.cache
def exact_sum(name: str, boundary: str) -> Array:
    lens, kernel_at = CASES[name]
    image = picture(SMALL).astype(np.float32)
    return scatter(image, kernel_at, boundary, gathers=lens.gathers)


@functools.cache
def exact_derivative(name: str, boundary: Any) -> Array:
    settings = vkbloom.Convolution(CASES[name][0], boundary=boundary, composite="mix", intensity=1)
    _, pullback = reference.vjp(picture(SMALL).astype(np.float32).astype(np.float64), settings)
    cotangents = picture(SMALL, seed=8).astype(np.float32)
    return pullback({"final": cotangents.astype(np.float64)})["image"]


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("boundary", BOUNDARIES)
def test_the_device_computes_the_sum_over_all_pixels(
    any_renderer: vkbloom.Renderer, name: str, boundary: Any
) -> None:
    """A grid is exact, a function within its tolerance; "wrap" has kernels larger than the picture.

    The flux of each light is that of its own kernel.
    """
    lens, _ = CASES[name]
    image = picture(SMALL).astype(np.float32)
    settings = vkbloom.Convolution(lens, boundary=boundary, format="rgba32float")
    frames = any_renderer.apply(image, settings)
    exact = exact_sum(name, boundary)
    limit = 1e-6 if lens.function is None else lens.tolerance
    off = np.abs(frames["bloom"][..., :3] - exact).max() / exact.max()
    assert off <= limit
    assert frames.info["psf_error"] <= limit
    if boundary == "wrap":
        flux = frames["bloom"][..., :3].sum(axis=(0, 1), dtype=np.float64)
        np.testing.assert_allclose(flux, exact.sum(axis=(0, 1)), rtol=1e-6)


@pytest.mark.parametrize("name", ["coma", "chromatic", "coloured_grid", "gathered"])
@pytest.mark.parametrize("boundary", BOUNDARIES)
def test_the_adjoint_is_the_transpose(
    any_renderer: vkbloom.Renderer, name: str, boundary: Any
) -> None:
    lens, _ = CASES[name]
    image = picture(SMALL).astype(np.float32)
    cotangents = picture(SMALL, seed=8).astype(np.float32)
    settings = vkbloom.Convolution(lens, boundary=boundary, composite="mix", intensity=1)
    frames, pullback = vkbloom.vjp(image, settings, renderer=any_renderer)
    derivative = pullback({"final": cotangents})["image"]
    forth = np.vdot(frames["final"].astype(np.float64), cotangents)
    assert np.vdot(image.astype(np.float64), derivative) == pytest.approx(forth, rel=1e-6)
    wanted = exact_derivative(name, boundary)
    limit = 1e-5 if lens.function is None else 10 * lens.tolerance
    np.testing.assert_allclose(derivative, wanted, rtol=0, atol=limit * np.abs(wanted).max())


@pytest.mark.parametrize("boundary", BOUNDARIES)
@pytest.mark.parametrize("kind", [psf.Varying, psf.Gathered])
def test_derivatives_by_weights(
    any_renderer: vkbloom.Renderer, kind: type[psf.Varying], boundary: Any
) -> None:
    """The bloom is linear in the weights, so that each derivative is the bloom of others."""
    image, cotangents = (picture(SMALL, seed=seed).astype(np.float32) for seed in (5, 8))
    settings, others = (
        vkbloom.Convolution(
            weighted(kind, seed), boundary=boundary, composite="mix", intensity=1, threshold=0.05
        )
        for seed in (9, 10)
    )
    pullback = reference.vjp(image, settings)[1]
    exact = pullback({"final": cotangents})["psf.weights"]
    of_others = np.vdot(reference.apply(image, others)["final"], cotangents)
    weights = others.value_of("psf.weights").array
    assert np.vdot(exact, weights) == pytest.approx(of_others, rel=1e-9)
    derivatives = vkbloom.vjp(image, settings, renderer=any_renderer)[1]({"final": cotangents})
    made = derivatives["psf.weights"]
    assert made.shape == weights.shape == exact.shape
    np.testing.assert_allclose(made, exact, rtol=0, atol=1e-5 * np.abs(exact).max())


LARGER = 67, 45
#: Grids of weights: the kind of field, the frame, the places' x and y, and settings. Between two
#: places are up to three parts of the pixels; some are beyond all places, or fewer than these.
GRIDS: dict[str, tuple[type[psf.Varying], tuple[int, int], Any, dict[str, Any]]] = {
    "parts": (psf.Varying, LARGER, ((3.0, 8.5, 60.0), (-5.0, 39.0)), {}),
    "one_row": (psf.Gathered, LARGER, ((3.0, 8.5, 60.0), (7.0,)), {"alpha": "blur"}),
    "one_column": (psf.Varying, LARGER, ((7.0,), (0.0, 30.25, 44.0)), {"alpha": "blur"}),
    "one_place": (psf.Varying, LARGER, ((7.0,), (4.0,)), {}),
    "outside": (psf.Varying, LARGER, ((-9.0, -4.0), (70.0, 80.0, 90.0)), {}),
    "fine": (psf.Gathered, (4, 3), (tuple(np.linspace(-1, 4, 9)), (0.0, 0.4, 0.8, 2.0)), {}),
    "one_pixel": (psf.Varying, (1, 1), ((-1.0, 0.5), (0.0, 3.0)), {}),
    "smaller": (psf.Varying, LARGER, ((3.0, 8.5, 60.0), (5.0, 39.0)), {"bloom_scale": 0.5}),
}


@functools.cache
def weights_of_grid(name: str) -> tuple[Any, Any, Any, Array]:
    """Return settings, an image, cotangents, and the reference's derivative by seven weights."""
    kind, (width, height), positions, more = GRIDS[name]
    draw = np.random.default_rng(11)
    weights = 0.2 * draw.random((7, len(positions[1]), len(positions[0]))) - 0.04
    lens = kind(grid(1, 7)[0], positions, weights=weights)
    settings = vkbloom.Convolution(lens, composite="mix", intensity=1, **more)
    shape = height, width, 4 if "alpha" in more else 3
    image, cotangents = (draw.random(shape).astype(np.float32) for _ in range(2))
    pullback = reference.vjp(image, settings)[1]
    return settings, image, cotangents, pullback({"final": cotangents})["psf.weights"]


def check_weights(renderer: vkbloom.Renderer, name: str) -> None:
    settings, image, cotangents, exact = weights_of_grid(name)
    passes = Passes(renderer, Inputs(image), in_floats(settings), {"final": cotangents})
    running = passes.submit("weights")
    assert running
    made = running.by_name()
    assert list(made) == [".by_weights_0", ".by_weights_1"]
    # The device adds up the pixels: the host gets four weights of the grid's places in each.
    assert {array.shape for array in made.values()} == {(*exact.shape[1:], 4)}
    weights = running.weights()["psf.weights"]
    np.testing.assert_allclose(weights, exact, rtol=0, atol=1e-5 * np.abs(exact).max())
    pullback = vkbloom.vjp(image, settings, renderer=renderer)[1]
    np.testing.assert_array_equal(pullback({"final": cotangents})["psf.weights"], weights)


@pytest.mark.parametrize("name", GRIDS)
def test_weights_of_any_grid_have_derivatives(renderer: vkbloom.Renderer, name: str) -> None:
    check_weights(renderer, name)


@pytest.mark.parametrize("name", ["parts", "one_row"])
def test_variants_add_up_the_pixels_of_a_grid(any_renderer: vkbloom.Renderer, name: str) -> None:
    check_weights(any_renderer, name)


def test_grids_beyond_the_largest_image_are_left_to_the_reference(
    renderer: vkbloom.Renderer,
) -> None:
    """The picture of the sums between places would be twice as high as the grid."""
    lens = psf.Varying([np.eye(3)], ([0.0], np.arange(9000.0)), weights=np.ones((1, 9000, 1)))
    image = picture(SMALL).astype(np.float32)
    settings = vkbloom.Convolution(lens, format="rgba32float")
    running = Passes(renderer, Inputs(image), settings, {"final": image}).submit("weights")
    assert running
    assert not running.by_name()


@pytest.mark.parametrize("place", [(0, 0), (16, 3), (8, 11)])
@pytest.mark.parametrize("name", ["chromatic", "vignetted", "grid"])
def test_a_light_shows_the_kernel_of_its_place(
    renderer: vkbloom.Renderer, name: str, place: tuple[int, int]
) -> None:
    lens, kernel_at = CASES[name]
    image = np.zeros((SMALL[1], SMALL[0], 3), np.float32)
    image[place[1], place[0]] = 1
    settings = vkbloom.Convolution(lens, format="rgba32float", boundary="wrap")
    bloom = renderer.apply(image, settings)["bloom"][..., :3]
    kernel = as_colours(kernel_at(*place))
    np.testing.assert_allclose(
        bloom.sum(axis=(0, 1), dtype=np.float64), kernel.sum(axis=(0, 1)), rtol=1e-6
    )
    alone = scatter(image, kernel_at, "wrap")
    np.testing.assert_allclose(bloom, alone, rtol=0, atol=1e-3 * kernel.max())


def test_the_law_of_a_field(renderer: vkbloom.Renderer) -> None:
    """Lights at nine places show their kernels; those of another field do not."""
    lens = psf.Varying(function=off_centre)
    settings = vkbloom.Convolution(lens, format="rgba32float")
    law: dict[str, Any] = {"size": (48, 40), "field": lens}
    testing.assert_laws(lambda a: renderer.apply(a, settings)["bloom"][..., :3], "field", **law)
    others = settings.replace(psf=psf.Varying(function=round_spot))
    with pytest.raises(AssertionError, match="in place of its kernel's"):
        testing.assert_laws(lambda a: renderer.apply(a, others)["bloom"][..., :3], "field", **law)


def test_a_constant_field_is_a_convolution(any_renderer: vkbloom.Renderer) -> None:
    kernel = grid()[1, 2]
    image = picture().astype(np.float32)
    plain, *fields = (
        any_renderer.apply(image, vkbloom.Convolution(lens, normalize=False), framebuffers="final")
        for lens in (
            kernel,
            psf.Varying(np.broadcast_to(kernel, (2, 3, 5, 8))),
            psf.Varying(function=lambda u, v: kernel),
        )
    )
    for field in fields:
        np.testing.assert_array_equal(field["final"], plain["final"])


def test_bloom_buffers_of_another_size_and_format(renderer: vkbloom.Renderer) -> None:
    """Places are those of the frame's pixels, and kernels are resampled."""
    image = picture((40, 30)).astype(np.float32)
    for lens in (psf.Varying(grid(), POSITIONS), psf.Varying(function=vignetted)):
        settings = vkbloom.Convolution(
            lens, bloom_scale=0.5, threshold=0.3, boundary="edge", format="rgba16float"
        )
        bloom = renderer.apply(image, settings)["bloom"].astype(np.float64)
        exact = reference.apply(image, settings)["bloom"]
        np.testing.assert_allclose(bloom, exact, rtol=0, atol=2e-3 * exact.max())


def test_batches_masks_and_emission(renderer: vkbloom.Renderer) -> None:
    settings = vkbloom.Convolution(psf.Varying(grid(), POSITIONS), composite="mix", intensity=0.5)
    images = np.stack([picture(seed=seed) for seed in (1, 2, 3)]).astype(np.float32)
    mask, emission = images[1, ..., 0] * 5, images[2]
    for image, frames in zip(images, renderer.map(images, settings), strict=True):
        alone = renderer.apply(image, settings)["final"]
        np.testing.assert_array_equal(frames["final"], alone)
    frames = renderer.apply(images[0], settings, mask=mask.clip(0, 1), emission=emission)
    exact = reference.apply(images[0], settings, mask=mask.clip(0, 1), emission=emission)
    np.testing.assert_allclose(frames["final"], exact["final"], rtol=0, atol=1e-5)


def test_plans_say_what_is_not_exact(renderer: vkbloom.Renderer) -> None:
    image = picture().astype(np.float32)
    lens = psf.Varying(function=vignetted, tolerance=0.01)
    made = lens.components(FRAME)
    count = len(made.kernels)
    plan = renderer.plan(image, vkbloom.Convolution(lens))
    assert plan.notes == (f"psf: {count} kernels, with an error of {made.error:.2g}",)
    info = renderer.apply(image, vkbloom.Convolution(lens)).info
    assert (info["psf_kernels"], info["psf_error"]) == (count, made.error)
    assert renderer.plan(image, vkbloom.Convolution()).notes == ()


def test_a_lens_is_removed(renderer: vkbloom.Renderer) -> None:
    """The error of what is found is below a tenth of that of the picture."""

    def lens_of(u: float, v: float) -> Array:
        kernel = 0.4 * vignetted(u, v)
        kernel[10, 10] += 0.6 * (1 - 0.5 * (u * u + v * v))
        return kernel

    truth = picture((30, 20))
    kernel_at = lambda x, y: lens_of(*field_of(x, y, (30, 20)))  # noqa: E731
    glared = scatter(truth, kernel_at, "zero").astype(np.float32)
    found = vkbloom.deglare(glared, psf.Varying(function=lens_of), renderer=renderer)
    assert np.linalg.norm(found - truth) < 0.1 * np.linalg.norm(glared - truth)
