"""Convolution on the device against the reference, and that against a plain sum."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.device.abilities import max_side
from tests.exhaustive import some
from tests.planned import image_source
from tests.variants import open_variant
from vkbloom import AdapterInfo, Convolution, Renderer, Settings, psf, reference
from vkbloom.reference._convolution import filter_bright

BOUNDARIES = ("zero", "edge", "wrap", "wrap_x")


def kernel_of(width: int, height: int, channels: int = 3) -> NDArray[np.float32]:
    """Return a kernel without any symmetry."""
    shape = (height, width, 3) if channels == 3 else (height, width)
    return (np.random.default_rng(width * 100 + height).random(shape) ** 4).astype(np.float32)


def image_of(width: int, height: int, channels: int = 3, dtype: str = "float32") -> NDArray[Any]:
    pixels = np.random.default_rng(height).random((height, width, channels)) ** 8 * 10
    if dtype == "uint8":
        pixels = np.minimum(pixels, 1) * 255
    return pixels.astype(dtype)


def assert_close(renderer: Renderer, image: NDArray[Any], settings: Settings) -> None:
    """Compare all framebuffers with the reference: within 1e-5 of the maximum in single floats."""
    steps = {"float32": 1e-5, "float16": 2**-10, "uint8": 1.01 / 255}
    frames, expected = renderer.apply(image, settings), reference.apply(image, settings)
    assert list(frames) == list(expected)
    for name, array in frames.items():
        real = array / 255 if array.dtype == np.uint8 else array.astype(np.float64)
        most = 1.0 if array.dtype == np.uint8 else np.abs(expected[name]).max()
        error = np.abs(real - expected[name]).max()
        assert error <= steps[array.dtype.name] * max(most, 1e-6), (name, error, most)


@pytest.mark.parametrize(
    ("size", "kernel", "channels", "boundary"),
    [
        *(((33, 21), (7, 4), 3, boundary) for boundary in BOUNDARIES),
        *(((33, 21), (90, 55), 1, boundary) for boundary in some(BOUNDARIES, 2)),
        *(((1, 1), (5, 5), 3, boundary) for boundary in some(BOUNDARIES, 2)),
        *(((16, 9), (16, 9), 3, boundary) for boundary in some(BOUNDARIES, 2)),
    ],
    ids=str,
)
def test_convolution(
    renderer: Renderer, boundary: Any, size: tuple[int, int], kernel: tuple[int, int], channels: int
) -> None:
    """Odd sizes, kernels larger than the image, colour and grey."""
    settings = Convolution(kernel_of(*kernel, channels), boundary=boundary)
    assert_close(renderer, image_of(*size), settings)


@pytest.mark.parametrize("boundary", BOUNDARIES)
@pytest.mark.parametrize("border", [((9, 2), (0, 25)), ((8, 8), (31, 30))], ids=str)
def test_a_border_of_zeros_makes_no_line_longer(
    renderer: Renderer, gpu: Renderer, boundary: Any, border: tuple[tuple[int, int], ...]
) -> None:
    """The kernel that is shown has it. Subnormal numbers are zeros, too, for devices."""
    kernel, image = kernel_of(6, 5), image_of(33, 21)
    large = np.pad(kernel, (*border, (0, 0)), constant_values=1e-39)
    settings = Convolution(large, boundary=boundary, format="rgba32float")
    for each in (renderer, gpu):
        assert_close(each, image, settings)
    # Of the numbers around the kernel's point, the furthest that is not 0.
    (top, _), (left, _) = border
    down, across = (
        max(middle - first, first + count - 1 - middle)
        for first, middle, count in (
            (top, large.shape[0] // 2, 5),
            (left, large.shape[1] // 2, 6),
        )
    )
    middle = settings.replace(psf=kernel_of(2 * across + 1, 2 * down + 1))
    shown = 16 * (large.shape[0] * large.shape[1] - (2 * across + 1) * (2 * down + 1))
    for each in (renderer, gpu):
        plans = [each._plan_of(image_source(image), one, None) for one in (settings, middle)]
        sizes = [plan.image_size for plan in plans]
        assert sizes[0] - sizes[1] == shown


def test_long_lines(renderer: Renderer) -> None:
    """Lines of more than 256 elements have three stages, of more than 4096 four."""
    assert_close(renderer, image_of(4201, 3), Convolution(kernel_of(101, 2), boundary="edge"))
    # In colour: the frequencies of the other sign lie elsewhere.
    assert_close(renderer, image_of(4, 1100), Convolution(kernel_of(3, 99)))


@pytest.fixture(scope="module")
def gpu() -> Iterator[Renderer]:
    """A renderer with the variants of GPUs, which transform complete lines."""
    with open_variant("gpu") as renderer:
        yield renderer


def test_complete_lines(gpu: Renderer) -> None:
    """Of several stages and of one; with colours and alpha, and pixels beyond an edge."""
    image = np.clip(image_of(17, 5, 4), 0, 1)
    settings = Convolution(kernel_of(20, 7), boundary="edge", alpha="blur")
    plan = gpu.plan(image, settings)
    assert [each.variant for each in plan.passes].count("lines") == 6
    bloom = gpu.apply(image, settings)["bloom"]
    np.testing.assert_allclose(bloom, reference.apply(image, settings)["bloom"], atol=1e-5)


@pytest.mark.parametrize("boundary", ["edge", "wrap"])
def test_lines_of_many_invocations(gpu: Renderer, boundary: Any) -> None:
    """A line of 4320 elements would have 720 invocations; a longer one has fewer.

    With a period of that length it cannot be longer.
    """
    width = 4320 if boundary == "wrap" else 4201
    settings = Convolution(kernel_of(101, 2), boundary=boundary)
    assert_close(gpu, image_of(width, 3), settings)


@pytest.mark.parametrize("width", [24, 25])
def test_rows_of_a_period_are_lines_of_half_their_length(gpu: Renderer, width: int) -> None:
    """An odd number of pixels has no half, and a period no padding: it runs stage by stage."""
    image, settings = image_of(width, 20), Convolution(kernel_of(7, 5), boundary="wrap")
    variants = [each.variant for each in gpu.plan(image, settings).passes]
    assert ("lines" in variants) == (width % 2 == 0)
    assert_close(gpu, image, settings)


@pytest.mark.parametrize(("size", "limit"), [((30, 40), 2e-7), ((64, 2100), 3e-7)])
def test_transforms_have_the_errors_of_their_roundings(
    gpu: Renderer, renderer: Renderer, size: tuple[int, int], limit: float
) -> None:
    """A kernel of one pixel leaves the image as it is.

    With exact turns lines of 2100 elements are 2.5e-7 off, with powers of one turn 4.1e-7 and more.
    """
    image = np.random.default_rng(0).standard_normal((*size[::-1], 3)).astype(np.float32)
    settings = Convolution(np.array([[0, 0, 0], [0, 1, 0], [0, 0, 1e-9]]), format="rgba32float")
    for each in (gpu, renderer):
        error = each.apply(image, settings)["bloom"][..., :3] - image
        assert error.std() <= limit


def test_lines_that_shared_memory_cannot_hold(gpu: Renderer) -> None:
    """They run stage by stage, which needs more images."""
    image = np.zeros((1, max_side(gpu) - 384, 3), np.float32)
    passes = gpu.plan(image, Convolution(kernel_of(3, 1))).passes
    assert "lines" not in [each.variant for each in passes]


def test_prefilter(renderer: Renderer) -> None:
    """Of Unreal Engine: luminances above 7 become 15 (L - 7) + 7."""
    image = np.full((8, 8, 3), 8.0, np.float32)
    filtered = filter_bright(image[:1, :1].astype(float), (7, 15000, 15))
    np.testing.assert_allclose(filtered, 22)
    np.testing.assert_allclose(filter_bright(image[:1, :1] / 2, (7, 15000, 15)), 4)
    kernel = np.pad(np.ones((3, 3), np.float32), 3)
    kernel[4, 4] = 9
    for prefilter in ((7, 15000, 15), (7, 1, 15)):
        spread = psf.unreal(kernel, prefilter=prefilter)
        assert_close(renderer, image, Convolution(spread, normalize=False, boundary="wrap"))


def test_kernels_are_made_once(renderer: Renderer, software: AdapterInfo) -> None:
    """A kernel's spectrum runs again only when the kernel or a size changes."""
    settings, image = Convolution(kernel_of(5, 5)), image_of(32, 18)
    with Renderer(software.name, validation=True) as own:
        assert list(own.apply(image, settings).timings) == [
            "glow",
            "kernel",
            "spectrum",
            "bloom",
            "final",
        ]
        assert list(own.apply(image, settings.replace(intensity=0.5)).timings) == ["final"]
        assert list(own.apply(image * 2, settings).timings) == [
            "glow",
            "spectrum",
            "bloom",
            "final",
        ]
        other = own.apply(image, settings.replace(psf=kernel_of(5, 5) + 1))
        assert "kernel" in other.timings
        again = own.apply(image, settings)
        kernel = reference.apply(image, settings)["kernel"]
        np.testing.assert_array_equal(again["kernel"], kernel.astype(np.float32))


def test_batches(renderer: Renderer) -> None:
    """Each request has its own kernel."""
    image = image_of(24, 17)
    sequence = [Convolution(psf.gaussian(sigma), kernel_size=(9, 9)) for sigma in (0.5, 1, 2)]
    for frames, settings in zip(renderer.sweep(image, sequence), sequence, strict=True):
        expected = reference.apply(image, settings)
        np.testing.assert_allclose(frames["bloom"], expected["bloom"], atol=1e-5 * 10)
        np.testing.assert_allclose(frames["kernel"], expected["kernel"], atol=1e-7)


def test_settings() -> None:
    array = kernel_of(3, 4)
    settings = Convolution(array)
    assert settings.psf == psf.samples(array)
    array[:] = 0
    assert np.asarray(settings.psf).max() > 0
    assert settings == Convolution(kernel_of(3, 4))
    assert hash(settings) == hash(Convolution(kernel_of(3, 4)))
    for one in (settings, Convolution(psf.aperture(psf.iris(size=16)), boundary="wrap_x")):
        again: Settings = Settings.from_json(one.to_json())
        assert again == one
        assert hash(again) == hash(one)
    assert Convolution() == Convolution(psf.spencer())


def test_kernels() -> None:
    frame = (40, 20)
    assert Convolution(psf.spencer()).kernel(frame).shape == (39, 79, 3)
    assert Convolution(psf.spencer(), kernel_size=(9, 7)).kernel(frame).shape == (7, 9, 3)
    assert Convolution(kernel_of(5, 6)).kernel(frame).shape == (6, 5, 3)
    np.testing.assert_allclose(Convolution(kernel_of(5, 6)).kernel(frame).sum(axis=(0, 1)), 1)
    raw = Convolution(kernel_of(5, 6), normalize=False)
    np.testing.assert_array_equal(raw.kernel(frame), kernel_of(5, 6))
    half = Convolution(psf.gaussian(2), kernel_size=(21, 21)).kernel(frame, (20, 5))
    assert half.shape == (7, 11, 3)
    # 40 pixels in 50 degrees, or as many as are given.
    assert (
        Convolution(psf.spencer(), kernel_size=(5, 5), pixels_per_degree=0.8).kernel(frame)
        == Convolution(psf.spencer(), kernel_size=(5, 5)).kernel(frame)
    ).all()


@pytest.mark.parametrize(
    "spread", [kernel_of(5, 6), psf.spencer(), psf.fog_glow(8), psf.unreal(kernel_of(5, 6))]
)
def test_the_size_of_a_kernel_is_known_without_it(spread: Any) -> None:
    """It is checked first, so that a kernel too large for the adapter takes no memory."""
    frame = (40, 20)
    for size in (None, (9, 7)):
        settings = Convolution(spread, kernel_size=size)
        width, height = settings.core_kernel_size(frame, frame)
        assert settings.kernel(frame).shape[:2] == (height, width)


def test_gain() -> None:
    gains = reference.gain(Convolution([[[1, 2, 3]]], normalize=False))
    np.testing.assert_allclose(gains, [1, 2, 3])
    np.testing.assert_allclose(reference.gain(Convolution(kernel_of(3, 3))), 1)


def test_a_kernel_without_a_sum(renderer: Renderer) -> None:
    settings = Convolution([[1, -1]])
    assert_close(renderer, image_of(4, 4), settings.replace(normalize=False))
