"""Kernels that are recovered from pairs of pictures, with their errors."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.exhaustive import EXHAUSTIVE
from tests.refusals import assert_refused, rows

scipy_signal = pytest.importorskip("scipy.signal")

Array = NDArray[Any]


def photograph(width: int, height: int, seed: int = 1) -> Array:
    """A picture with the spectrum of a photograph, and some lamps: grey, (H, W)."""
    generator = np.random.default_rng(seed)
    frequency = np.hypot(np.fft.fftfreq(height)[:, None], np.fft.fftfreq(width))
    frequency[0, 0] = np.inf
    noise = np.fft.fft2(generator.standard_normal((height, width)))
    values = np.fft.ifft2(noise / frequency).real
    image: Array = np.clip(0.3 * np.exp(0.6 * values / values.std()), 0, 1)
    for _ in range(width * height // 1000):
        y, x = generator.integers(0, height - 2), generator.integers(0, width - 2)
        image[y : y + 2, x : x + 2] += generator.uniform(0.5, 3)
    return image


def kernels(side: int) -> dict[str, Array]:
    """Kernels of lenses: glare around a sharp core, blur, a star."""
    y, x = np.indices((side, side)) - side // 2
    radius = np.hypot(x, y)
    found = {
        "glare": 20.0 * (radius == 0) + 1 / (1 + radius) ** 2,
        "blur": np.exp(-(radius**2) / 8),
        "star": 3 * (radius == 0) + 0.3 * (abs(x) == abs(y)) * np.exp(-radius / 5),
    }
    return {name: one / one.sum() for name, one in found.items()}


def rgb(values: Array) -> Array:
    return np.repeat(values[..., np.newaxis], 3, axis=2)


def glare(image: Array, kernel: Array, seed: int = 0, noise: float = 0.01) -> Array:
    """The picture through a lens, with noise."""
    made: Array = scipy_signal.fftconvolve(image, kernel, mode="same")
    return made + noise * np.random.default_rng([seed, 7]).standard_normal(image.shape)


def covered(found: Any, kernel: Array) -> Array:
    """Which values are within 1.96 deviations."""
    values = np.asarray(found.psf.values.array)
    within: Array = np.abs(values - kernel) <= 1.96 * found.error
    return within


def test_kernels_and_their_errors() -> None:
    """With noise of 1 %: within 2 % of the peak, and 93 to 97 % of the values in their intervals.

    An exhaustive run has kernels of 31 x 31. A small picture tells less of a kernel.
    """
    side, shape, limit = (31, (480, 360), 0.02) if EXHAUSTIVE else (11, (128, 96), 0.04)
    image, shares = photograph(*shape), []
    for name, kernel in kernels(side).items():
        for seed in range(2):
            found: Any = vkbloom.recover_psf(
                rgb(image), rgb(glare(image, kernel, seed)), size=(side, side)
            )
            error = np.abs(found.psf.values.array - kernel).max() / kernel.max()
            assert error < limit, (name, error)
            assert found.noise == pytest.approx(0.01, rel=0.05)
            assert found.residual.std() == pytest.approx(0.01, rel=0.2)
            assert (found.psf.values.array >= 0).all()
            shares.append(covered(found, kernel).mean())
    assert 0.93 <= np.mean(shares) <= 0.97, shares


def test_a_field_of_kernels() -> None:
    """A light shows the kernel of its own place, bilinear between 3 x 3 positions."""
    side, (width, height) = (15, (320, 240)) if EXHAUSTIVE else (5, (96, 72))
    places = np.linspace(10, width - 11, 3), np.linspace(8, height - 9, 3)
    y, x = np.indices((side, side)) - side // 2
    wide = [0.7 + 0.15 * i for i in range(9)]
    truth = np.array([np.exp(-(x**2 + y**2) / (2 * s**2)) for s in wide])
    truth /= truth.sum(axis=(1, 2), keepdims=True)
    image = photograph(width, height, 3)
    hats = [
        np.array([np.interp(np.arange(count), nodes, row) for row in np.eye(3)])
        for count, nodes in zip((width, height), places, strict=True)
    ]
    shares = np.einsum("iy,jx->ijyx", hats[1], hats[0]).reshape(9, height, width)
    clean = sum(
        scipy_signal.fftconvolve(share * image, kernel, mode="same")
        for share, kernel in zip(shares, truth, strict=True)
    )
    within = []
    for seed in range(4):
        noisy = clean + 0.01 * np.random.default_rng([seed, 5]).standard_normal(image.shape)
        found: Any = vkbloom.recover_psf(
            rgb(image), rgb(noisy), size=(side, side), positions=places, noise=0.01
        )
        assert found.kernels.shape == found.error.shape == (3, 3, side, side)
        assert found.positions == tuple(tuple(map(float, one)) for one in places)
        assert found.psf == vkbloom.psf.Varying(found.kernels, places)
        errors = np.abs(found.kernels.reshape(9, side, side) - truth)
        assert errors.max() < 0.1 * truth.max()
        # Each position has its own kernel, not the mean of all.
        assert errors.mean() < 0.4 * np.abs(truth - truth.mean(axis=0)).mean()
        within.append(errors <= 1.96 * found.error.reshape(errors.shape))
    assert 0.92 <= np.mean(within) <= 0.98


def test_lights_in_the_dark() -> None:
    """Parts of a picture without light say nothing, and are no error."""
    image = np.zeros((90, 160))
    image[20, 30] = 5
    kernel = np.random.default_rng(0).random((3, 5))
    found = vkbloom.recover_psf(rgb(image), rgb(glare(image, kernel, noise=0.0)), size=(5, 3))
    np.testing.assert_allclose(found.kernels[0, 0], kernel, atol=1e-4)


def test_ignored_pixels_and_channels() -> None:
    """Masked and non-finite pixels have no effect; each channel has its own kernel.

    Its orientation and centre are those of `Convolution`.
    """
    image = np.stack([photograph(64, 48, seed) for seed in (1, 2, 3)], axis=2)
    truth = np.random.default_rng(2).random((4, 5, 3)) ** 4
    lens = vkbloom.Convolution(truth, normalize=False, composite="mix", intensity=1.0)
    picture = vkbloom.reference.apply(image.astype(np.float32), lens)["final"]
    exact: Any = vkbloom.recover_psf(image, picture, size=(5, 4))
    np.testing.assert_allclose(exact.psf.values.array, np.asarray(truth), atol=1e-3)
    picture += 1e-3 * np.random.default_rng(4).standard_normal(picture.shape)
    mask = np.zeros(image.shape[:2], np.bool_)
    mask[10:14, 20:30] = True
    picture[mask] = 100
    picture[30, 30] = np.nan
    found: Any = vkbloom.recover_psf(image, picture, size=(5, 4), mask=mask)
    np.testing.assert_allclose(found.psf.values.array, np.asarray(truth), atol=0.02)
    assert found.error.shape == truth.shape
    assert not found.residual[mask].any()
    assert found.noise == pytest.approx(1e-3, rel=0.1)


@pytest.mark.parametrize(("call", "error"), rows(__file__, "recover_psf"))
def test_a_wrong_value_is_refused(call: str, error: str) -> None:
    image = rgb(photograph(32, 24))
    names = {"recover_psf": vkbloom.recover_psf, "image": image, "np": np}
    assert_refused(call, error, names)
