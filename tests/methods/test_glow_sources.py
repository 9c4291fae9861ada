"""Masks, emissions, and the field `alpha`."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from tests.images import make_cut_out, picture
from tests.methods.cases import GIVEN
from tests.tolerance import assert_matches_reference
from vkbloom import Pyramid, Renderer, Scene, Separable

Image = NDArray[Any]


# One of each method.
@pytest.mark.parametrize("name", {one.method: name for name, (one, _) in GIVEN.items()}.values())
def test_a_mask_of_one_changes_no_bit_and_one_of_zero_leaves_no_bloom(
    renderer: Renderer, name: str
) -> None:
    settings, _ = GIVEN[name]
    image = make_cut_out(61, 47, "float32")
    ones = np.ones(image.shape[:2], bool)
    plain, full = renderer.apply(image, settings), renderer.apply(image, settings, mask=ones)
    for framebuffer in plain:
        assert_array_equal(full[framebuffer], plain[framebuffer], framebuffer)
    dark = renderer.apply(image, settings, mask=~ones)
    assert not dark["bloom"][..., :3].any()
    assert_array_equal(dark["final"][..., 3], image[..., 3])


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
