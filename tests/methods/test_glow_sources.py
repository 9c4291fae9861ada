"""Masks, emissions, and the field `alpha`."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from tests.images import hdr_picture, picture
from tests.methods.cases import GIVEN
from tests.tolerance import assert_matches_reference
from vkbloom import (
    PygfxBloom,
    Pyramid,
    Renderer,
    Scene,
    Separable,
    Settings,
)

Image = NDArray[Any]


def image_of(size: tuple[int, int], dtype: str, seed: int = 0) -> Image:
    """Return a picture whose alpha is 0 to 1, and whose right quarter is transparent black."""
    image = hdr_picture(*size, 4, dtype, seed)
    if dtype != "uint8":
        image[..., 3] = np.clip(image[..., 3] / 8, 0, 1)
    image[:, 3 * size[0] // 4 :] = 0
    return image


# One of each method.
@pytest.mark.parametrize("name", {one.method: name for name, (one, _) in GIVEN.items()}.values())
def test_a_mask_of_one_changes_no_bit_and_one_of_zero_leaves_no_bloom(
    renderer: Renderer, name: str
) -> None:
    settings, _ = GIVEN[name]
    image = image_of((61, 47), "float32")
    ones = np.ones(image.shape[:2], bool)
    plain, full = renderer.apply(image, settings), renderer.apply(image, settings, mask=ones)
    for framebuffer in plain:
        assert_array_equal(full[framebuffer], plain[framebuffer], framebuffer)
    dark = renderer.apply(image, settings, mask=~ones)
    assert not dark["bloom"][..., :3].any()
    assert_array_equal(dark["final"][..., 3], image[..., 3])


# --- Formulas, by hand ---


def flat(*colour: float) -> Image:
    return np.broadcast_to(np.array(colour, np.float32), (8, 12, len(colour))).copy()


@pytest.mark.parametrize(
    "settings", [Pyramid(levels=2), PygfxBloom(levels=1, format="rgba32float")]
)
def test_mix_takes_from_the_scene_what_the_bloom_came_of(
    renderer: Renderer, settings: Settings
) -> None:
    # Flat images stay flat: the bloom is m s or e.
    mixed = settings.replace(composite="mix", intensity=0.25)
    image, mask = flat(0.8, 0.4, 0.2), np.full((8, 12), 0.5, np.float32)
    masked = renderer.apply(image, mixed, mask=mask)
    assert_allclose(masked["bloom"][..., :3], 0.5 * image, rtol=1e-5)
    # s + i (b - m s) with b = m s.
    assert_allclose(masked["final"], image, rtol=1e-5)
    emission = flat(0.0, 1.0, 2.0)
    for white in (None, np.full((8, 12), 255, np.uint8)):
        lit = renderer.apply(image, mixed, emission=emission, mask=white)
        assert_allclose(lit["final"], image + 0.25 * emission, rtol=1e-5)


def test_alpha_blur(renderer: Renderer) -> None:
    image = flat(0.5, 0.25, 0.25, 0.5)
    settings = Pyramid(levels=1, alpha="blur", intensity=0.5)
    frames = renderer.apply(image, settings, mask=np.full((8, 12), 0.5, np.float16))
    assert_allclose(frames["glow"][..., 3], 0.25)
    assert_allclose(frames["bloom"][..., 3], 0.25, rtol=1e-6)
    # 1 - (1 - a)(1 - i b_a)
    assert_allclose(frames["final"][..., 3], 1 - 0.5 * (1 - 0.125), rtol=1e-6)
    # What does not pass the threshold has no alpha either.
    dark = renderer.apply(image, settings.replace(threshold=1.0))
    assert not dark["bloom"].any()
    assert_array_equal(dark["final"], image)


@pytest.mark.parametrize("alpha", ["max", "blur"])
def test_nan_and_infinity_of_an_alpha_stay_in_their_pixels(renderer: Renderer, alpha: Any) -> None:
    image = picture(21, 13, 4)
    image[3, 4, 3], image[5, 6, 3] = np.nan, np.inf
    settings = Pyramid(levels=2, alpha=alpha, intensity=0.2)
    frames = renderer.apply(image, settings)
    assert_matches_reference(frames, image, settings)
    assert np.isnan(frames["final"][3, 4, 3])
    assert np.isposinf(frames["final"][5, 6, 3])
    assert np.isfinite(frames["bloom"]).all()


def test_scenes_ignore_alpha(renderer: Renderer, scene: Scene) -> None:
    plain = renderer.render(scene, Pyramid(levels=2), (48, 32))
    blurred = renderer.render(scene, Pyramid(levels=2, alpha="blur"), (48, 32))
    for name in plain:
        assert_array_equal(blurred[name], plain[name], name)


# --- What is given ---


def test_masks_of_other_types(renderer: Renderer) -> None:
    image, settings = picture(19, 14, 3), Pyramid(levels=2)
    levels = np.arange(14 * 19, dtype=np.uint8).reshape(14, 19)

    def glow(mask: object) -> Image:
        return renderer.apply(image, settings, mask=mask)["glow"]  # type: ignore[arg-type]

    assert_array_equal(glow(levels), glow(levels / np.float32(255)))
    halves = (levels / np.float32(255)).astype(np.float16)
    assert_array_equal(glow(halves), glow(halves.astype(np.float32)))
    assert_array_equal(glow(levels > 99), glow((levels > 99).astype(np.float32)))
    singles = halves.astype(np.float32)
    assert_array_equal(glow(singles.astype(">f4")), glow(singles))
    assert_array_equal(glow(np.asfortranarray(singles)), glow(singles))
    assert_array_equal(glow(np.repeat(singles, 2, axis=1)[:, ::2]), glow(singles))
    assert_array_equal(glow(memoryview(singles.data)), glow(singles))


def test_unchanged_mask_and_emission_run_no_pass(renderer: Renderer) -> None:
    image, emission = picture(24, 16, 4, seed=8), picture(24, 16, 4, seed=9)
    mask = np.random.default_rng(1).random((16, 24), dtype=np.float32)
    settings = Separable(composite="mix")
    renderer.apply(image, settings, mask=mask, emission=emission)
    assert not renderer.apply(image, settings, mask=mask, emission=emission).timings
    mask[15, 23] /= 2
    changed = renderer.apply(image, settings, mask=mask, emission=emission)
    assert next(iter(changed.timings)) == "glow"
    emission[15, 23] /= 2
    changed = renderer.apply(image, settings, mask=mask, emission=emission)
    assert next(iter(changed.timings)) == "glow"
    image[15, 23] /= 2
    changed = renderer.apply(image, settings, mask=mask, emission=emission)
    assert list(changed.timings) == ["final"]
    given: tuple[dict[str, Any], ...] = ({"mask": mask}, {"emission": emission}, {})
    for kwargs in given:
        frames = renderer.apply(image, settings, **kwargs)
        assert_matches_reference(frames, image, settings, **kwargs)


def test_nan_and_infinity_of_an_emission_count(renderer: Renderer) -> None:
    image, emission = picture(9, 7, 3), picture(9, 7, 3, seed=1)
    image[0, 0, 0], emission[1, 2, :2], emission[3, 3] = np.nan, np.nan, np.inf
    settings = Pyramid(levels=2)
    frames = renderer.apply(image, settings, emission=emission)
    assert (frames.info["nan"], frames.info["inf"]) == (3, 3)
    assert_matches_reference(frames, image, settings, emission=emission)
    off = renderer.apply(image, settings.replace(bloom=False), emission=emission)
    assert (off.info["nan"], off.info["inf"]) == (3, 3)
    assert_array_equal(off["final"], image)


# --- Plans, grids, the explorer ---


def test_plans_know_mask_and_emission(renderer: Renderer) -> None:
    image, settings = picture(16, 12, 4), Separable(composite="mix")
    mask = np.ones((12, 16), np.float32)
    plain = renderer.plan(image, settings)
    assert plain == renderer.plan(renderer.upload(image), settings)
    plans = {
        plain,
        renderer.plan(renderer.upload(image, mask=mask), settings),
        renderer.plan(renderer.upload(image, emission=image), settings),
        renderer.plan(renderer.upload(image, mask=mask, emission=image), settings),
    }
    assert len(plans) == 4
    masked = renderer.plan(renderer.upload(image, mask=mask), settings)
    assert masked == renderer.plan(renderer.upload(image, mask=0 * mask), settings)
    reads = {one.name: one.reads for one in masked.passes}
    assert reads["glow"] == ("image", "mask")
    assert reads["final"] == ("image", "bloom", "mask")
    lit = renderer.plan(renderer.upload(image, emission=image), settings)
    reads = {one.name: one.reads for one in lit.passes}
    assert reads["glow"] == ("emission",)
    assert reads["final"] == ("image", "bloom")
