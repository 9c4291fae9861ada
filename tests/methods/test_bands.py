"""Images by bands of rows: the same picture as of the whole image, bit by bit."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import vkbloom
from tests.exhaustive import by_turns
from vkbloom import Renderer, Settings
from vkbloom._cli.bands import Band, BloomByBands

WIDTH = 29
# A height that those of all levels divide, and one without a common divisor.
HEIGHTS = (2048, 2053)


def band(dtype: str, *, glows: bool, height: int = HEIGHTS[0]) -> Band:
    random = np.random.default_rng(3)
    image = (4 * random.random((height, WIDTH, 4)) ** 12).astype(dtype)
    mask = random.random((height, WIDTH)).astype(np.float32)
    return Band(image, image[::-1].copy(), mask) if glows else Band(image)


def chunks(image: Band) -> Iterator[Band]:
    for first in range(0, len(image.image), 200):
        yield image.rows(first, first + 200)


SETTINGS: dict[str, Settings] = {
    **vkbloom.presets,
    "alpha": vkbloom.Pyramid(levels=3, alpha="blur", threshold=0.5, radius=3.5),
    "small": vkbloom.Separable(bloom_scale=0.25, loops=2),
    "fixed": vkbloom.Separable(bloom_size=(16, 32)),
    "wide": vkbloom.DualKawase(offset=9),
    "narrow": vkbloom.BevyBloom(max_mip_dimension=64, scale_y=3.0),
}


# Settings with passes whose images need rows that begin at the same place.
ALIGNED = {"small", "fixed", "godot_4_5", "godot_4_6"}


#: Methods that are not made by bands of rows.
WHOLE = ("post_processing", "pmndrs", "babylon", "playcanvas")


@pytest.mark.parametrize(
    ("name", "height", "glows"),
    [
        (name, *other)
        for name, other in by_turns(SETTINGS, turns=zip(HEIGHTS, (False, True), strict=True))
    ],
)
def test_bands_are_the_whole(renderer: Renderer, name: str, height: int, glows: bool) -> None:
    image = band("float32" if name == "narrow" else "float16", glows=glows, height=height)
    settings = SETTINGS[name]
    bloom = BloomByBands.of(renderer._core, settings, image, height, 128)
    # A convolution reaches everywhere, and so do all of Blender's types but one.
    is_far = isinstance(settings, vkbloom.BlenderGlare) and settings.type != "bloom"
    is_far |= settings.method in ("convolution", "unreal", *WHOLE)
    needs_whole = is_far or (height % 2 and name in ALIGNED)
    assert (bloom is None) == bool(needs_whole)
    if bloom is None:
        return
    assert sum(bloom.reduce(chunks(image))) == height
    bands = list(bloom.finals(chunks(image)))
    assert len(bands) > 2
    whole = renderer.apply(
        image.image, settings, mask=image.mask, emission=image.emission, framebuffers=("final",)
    )
    final = np.concatenate(bands)
    if name == "fixed" and renderer.info.type != "cpu":
        # A GPU's sampler rounds positions to a few bits, from coordinates relative to the height of
        # the band. On an H100 two values of 500,000 are the next half float.
        np.testing.assert_array_max_ulp(final, whole["final"])
        assert np.mean(final != whole["final"]) < 1e-4
    else:
        assert np.array_equal(final, whole["final"])


@pytest.mark.parametrize(
    ("settings", "height"),
    [
        (vkbloom.Separable(bloom_scale=0.5), 511),
        (vkbloom.Pyramid(dither=True), 512),
        (vkbloom.Pyramid(glare=(vkbloom.Streaks(),)), 512),
        (vkbloom.Pyramid(glare=(vkbloom.Dirt(),)), 512),
        (vkbloom.Pyramid(format="rg11b10ufloat"), 512),
        (vkbloom.PygfxBloom(filter_radius=1.0, intensity=0.5), 64),
    ],
)
def test_methods_that_need_the_complete_image_have_no_bands(
    renderer: Renderer, settings: Settings, height: int
) -> None:
    image = band("uint8" if settings.dither else "float32", glows=False, height=height)
    assert BloomByBands.of(renderer._core, settings, image, height, 16) is None


def test_no_bloom_is_known(renderer: Renderer) -> None:
    image = band("float32", glows=False)
    for threshold in (0.1, 60000.0):
        settings = vkbloom.Pyramid(threshold=threshold)
        bloom = BloomByBands.of(renderer._core, settings, image, HEIGHTS[0], 128)
        assert bloom is not None
        assert not bloom.is_without
        assert sum(bloom.reduce(chunks(image))) == HEIGHTS[0]
        assert bloom.is_without == (threshold > 1)


def test_wrong_parts_are_refused(renderer: Renderer) -> None:
    core, image = renderer._core, band("float32", glows=False, height=8)
    settings = vkbloom.Pyramid(levels=2)
    level = image.image[:4, : WIDTH // 2].copy()

    def plan(names: tuple[str, ...], part: tuple[int, tuple[str, ...], int]) -> object:
        return core.plan(image.source((level,)), settings, names, part)

    assert plan(("up_0",), (8, ("down_0",), -1))
    with pytest.raises(ValueError, match="there is no image side"):
        plan(("side",), (8, (), 0))
    with pytest.raises(ValueError, match="level_0 is of another size or format"):
        plan(("up_0",), (16, ("down_0",), -1))
    with pytest.raises(ValueError, match="it needs the image"):
        plan(("final",), (8, ("up_0",), -1))
    with pytest.raises(ValueError, match="has no such rows"):
        core.plan(image.rows(0, 1).source(), settings, ("down_0",), (30, (), 1))
    with pytest.raises(ValueError, match="has no such rows"):
        core.plan(image.source(), vkbloom.Separable(bloom_scale=0.5), ("final",), (31, (), 1))
    with pytest.raises(ValueError, match="part: rows 23 to 31 are not within"):
        plan(("down_0",), (30, (), 23))
    with pytest.raises(ValueError, match="8 names are out of range"):
        plan(("final",), (8, ("up_0",) * 8, 0))
    with pytest.raises(ValueError, match="8 levels are out of range"):
        image.source((level,) * 8)
    scene = vkbloom._renderer.sources.scene_source(vkbloom.Scene.ufo(), (8, 8), "forward", 0.0)
    with pytest.raises(ValueError, match="only images have bands"):
        core.bands(scene, settings, 8)
    with pytest.raises(ValueError, match="only images have bands"):
        core.plan(scene, settings, ("final",), (8, (), 0))
