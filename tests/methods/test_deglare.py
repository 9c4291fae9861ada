"""`vkbloom.deglare` finds the image whose glare is the picture."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import vkbloom

POINTS = np.random.default_rng(0).random((24, 32, 3)) ** 16 * 20
KERNEL = np.outer([1, 2, 1], [1, 2, 1]) / 40


def with_glare(image: Any, psf: Any, share: float) -> Any:
    """Return a picture of the reference."""
    lens = vkbloom.Convolution(psf, composite="mix", intensity=share)
    return vkbloom.reference.apply(image, lens)["final"]


@pytest.mark.parametrize(
    ("psf", "share", "spread"),
    [
        (vkbloom.psf.gaussian(sigma=3), 0.3, 0.3),
        # By the energy of the function.
        (vkbloom.psf.harvey_shack(), None, float(vkbloom.psf.harvey_shack().energy().mean())),
        (vkbloom.psf.spencer(), None, float(vkbloom.psf.spencer().energy().mean())),
        (KERNEL, None, 0.4),
        (np.stack([KERNEL, np.eye(3), KERNEL], axis=2), 0.4, 0.4),
    ],
)
@pytest.mark.parametrize("channels", [3, 4])
def test_the_image_is_found(
    renderer: vkbloom.Renderer, psf: Any, share: float | None, spread: float, channels: int
) -> None:
    truth = np.concatenate([POINTS, np.full((24, 32, 1), 0.5)], axis=2)[..., :channels]
    picture = with_glare(truth, psf, spread).astype(np.float32)
    found = vkbloom.deglare(picture, psf, share=share, renderer=renderer)
    assert found.dtype.name == "float32"
    assert found.shape == truth.shape
    glare, left = (np.linalg.norm(one - truth) for one in (picture, found))
    assert left < 1e-4 * glare, (left, glare)


def test_a_scale_in_degrees(renderer: vkbloom.Renderer) -> None:
    """A function of the angle is as wide in pixels as in the picture's own lens."""
    psf, scale = vkbloom.psf.harvey_shack(), 20.0
    lens = vkbloom.Convolution(psf, composite="mix", intensity=0.3, pixels_per_degree=scale)
    picture = vkbloom.reference.apply(POINTS, lens)["final"].astype(np.float32)
    given: dict[str, Any] = {"share": 0.3, "renderer": renderer}
    right = vkbloom.deglare(picture, psf, pixels_per_degree=scale, **given)
    other = vkbloom.deglare(picture, psf, **given)
    glare, left, wrong = (np.linalg.norm(one - POINTS) for one in (picture, right, other))
    assert left < 1e-4 * glare
    assert wrong > 0.1 * glare


def test_no_value_is_negative(renderer: vkbloom.Renderer) -> None:
    psf = vkbloom.psf.gaussian(sigma=3)
    truth = np.where(POINTS > 1, POINTS, 0)
    noise = np.random.default_rng(0).normal(scale=0.02, size=truth.shape)
    picture = (with_glare(truth, psf, 0.4) + noise).astype(np.float16)
    found = vkbloom.deglare(picture, psf, share=0.4, renderer=renderer)
    assert found.min() == 0
    glare, left = (np.abs(one - truth).mean() for one in (picture, found))
    assert left < 0.2 * glare


def test_bytes_are_read_as_shares_of_255(renderer: vkbloom.Renderer) -> None:
    psf = vkbloom.psf.gaussian(sigma=2)
    levels = np.round(255 * np.clip(with_glare(np.minimum(POINTS, 1), psf, 0.2), 0, 1))
    one = vkbloom.deglare(levels.astype(np.uint8), psf, share=0.2, renderer=renderer)
    other = vkbloom.deglare((levels / 255).astype(np.float32), psf, share=0.2, renderer=renderer)
    np.testing.assert_array_equal(one, other)
