"""Variants of adjoint passes: their derivatives, and which passes run."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.device.abilities import has_linear_texels
from tests.exhaustive import EXHAUSTIVE
from tests.images import random_image
from tests.methods.adjoints import (
    BEVY,
    CASES,
    KERNEL,
    SINGLE,
    check,
    pull,
)
from tests.planned import DeviceGradients, Inputs, Passes
from tests.variants import open_variant
from vkbloom import (
    BevyBloom,
    BlenderGlare,
    Convolution,
    DualKawase,
    KinoBloom,
    PygfxBloom,
    Pyramid,
    Renderer,
    Separable,
    ThreeBloom,
    reference,
)

TILES = ("tile_mixed_comp", "tile_transposed_comp")
STRIPS = ("strip_mixed_linear_rgba32float", "strip_transposed_linear_rgba32float")
LEVELS = "adjoint_filter_tile_comp"
TAPS = "adjoint_taps_linear_rgba32float"
#: By variant: settings, sizes and dtypes with the passes of the variant's own among those that make
#: the derivative by the image. A composite that is no sum, and a curve, need the bloom.
TRANSPOSED: tuple[tuple[str, Any, tuple[int, ...], str, tuple[str, ...]], ...] = (
    # Several tiles, and kernels of all lengths that tiles have.
    ("gpu", Separable(threshold=0.5, knee=0.5, tonemap="reinhard"), (35, 61, 4), "f4", TILES),
    ("gpu", Separable(threshold=0.5, blur_scale=2, intensity=0.7), (70, 50, 4), "f4", TILES[1:]),
    ("gpu", Separable(blur_scale=4, tonemap="aces"), (9, 40, 4), "f2", TILES),
    ("gpu", Separable(blur_scale=4, composite="screen"), (9, 40, 4), "f2", ()),
    ("gpu", Separable(alpha="max", threshold=0.2, knee=0.3), (1, 70, 4), "f4", (LEVELS,)),
    ("gpu", Separable(composite="mix", encoding="srgb", exposure=0.5), (7, 1, 4), "u1", TILES),
    # Levels of which all, some or none have exactly half the size: several tiles, less than one,
    # and sides of one texel.
    ("gpu", Pyramid(levels=4), (64, 288, 3), "f4", (LEVELS,) * 8),
    ("gpu", Pyramid(levels=1, radius=0.5), (36, 140, 3), "f4", (LEVELS,) * 2),
    ("gpu", Pyramid(levels=2, radius=0, tonemap="aces"), (20, 252, 3), "f4", (LEVELS,) * 4),
    (
        "gpu",
        Pyramid(levels=2, alpha="blur", level_weights=(0.3, 0.9), threshold=0.4, knee=0.5),
        (34, 250, 4),
        "f4",
        (LEVELS,) * 5,
    ),
    ("gpu", Pyramid(levels=3, composite="mix", intensity=0.4), (4, 8, 3), "f4", (LEVELS,) * 4),
    ("gpu", Pyramid(levels=1), (2, 2, 4), "f4", (LEVELS,) * 2),
    ("gpu", Pyramid(levels=2), (2, 70, 3), "f4", (LEVELS,) * 4),
    ("gpu", Pyramid(levels=2), (35, 65, 3), "f4", (LEVELS,) * 4),
    ("gpu", Pyramid(levels=2, composite="mix", exposure=0.5), (35, 62, 3), "f4", (LEVELS,) * 4),
    # Windows of many texels: along one axis, and along both in another ratio.
    ("gpu", Separable(bloom_scale=0.5), (66, 134, 3), "f4", (LEVELS,) * 4),
    ("gpu", Separable(bloom_scale=0.25, blur_scale=2), (66, 135, 3), "f4", (LEVELS,)),
    ("gpu", ThreeBloom(), (72, 140, 4), "f4", (LEVELS,) * 18),
    # Short kernels along one axis, of a filter with two rows.
    ("gpu", vkbloom.presets["unreal"], (40, 60, 3), "f4", (TILES[1], *(LEVELS,) * 7)),
    ("cpu", vkbloom.presets["unreal"], (40, 60, 3), "f4", (TAPS,) * 17),
    # Pictures of groups of taps, in one pass.
    ("gpu", Pyramid(levels=1, firefly_filter=True), (34, 70, 3), "f4", (LEVELS,) * 2),
    ("gpu", KinoBloom(radius=1.0), (20, 36, 3), "f4", (LEVELS,) * 3),
    ("gpu", BevyBloom(max_mip_dimension=16), (33, 67, 4), "f4", (LEVELS,) * 8),
    # Several strips, less than one, and less than a kernel.
    ("cpu", Separable(threshold=0.5, knee=0.5), (35, 261, 3), "f4", STRIPS[1:]),
    ("cpu", Separable(threshold=0.5, intensity=0.7, exposure=0.5), (70, 50, 4), "f4", STRIPS[1:]),
    ("cpu", Separable(threshold=0.5, tonemap="reinhard", exposure=0.5), (70, 50, 4), "f4", STRIPS),
    ("cpu", Separable(composite="mix", intensity=0.4), (3, 9, 3), "f4", STRIPS[1:]),
    ("cpu", Separable(composite="mix", intensity=0.4, tonemap="aces"), (3, 9, 3), "f4", STRIPS),
    ("cpu", Separable(threshold=0.2, knee=0.3), (1, 70, 4), "f4", STRIPS[1:]),
    ("cpu", Separable(), (7, 1, 3), "f4", STRIPS[1:]),
    (
        "cpu",
        Pyramid(levels=1, threshold=0.5, tonemap="aces"),
        (8, 32, 3),
        "f4",
        (TAPS,) * 3,
    ),
    (
        "cpu",
        DualKawase(levels=1, threshold=0.5, tonemap="aces"),
        (8, 32, 3),
        "f4",
        (TAPS, TAPS),
    ),
    ("cpu", Pyramid(levels=2, composite="mix", exposure=0.5), (35, 62, 3), "f4", (TAPS,) * 6),
)


@pytest.fixture(scope="module")
def varied(software: Any) -> Iterator[dict[str, Renderer]]:
    renderers = {
        variant: open_variant(variant, "software", validation=False) for variant in ("cpu", "gpu")
    }
    yield renderers
    for renderer in renderers.values():
        renderer.close()


@pytest.mark.parametrize("case", TRANSPOSED)
def test_variants_are_transposed(varied: dict[str, Renderer], case: tuple[Any, ...]) -> None:
    """Derivatives by an image, their bits from run to run, and the passes that make them."""
    variant, settings, size, dtype, passes = case
    renderer, random = varied[variant], np.random.default_rng(1)
    pixels = random.random(size) ** 2 * (255 if dtype == "u1" else 1.5)
    cotangents = {"final": random.standard_normal(size).astype(np.float32)}
    floats = settings.replace(**SINGLE)
    # A finite image has another pipeline.
    for values in ((0.5, 0.5), (np.nan, np.inf))[: 1 + (dtype == "f4")]:
        pixels[0, 0, :2] = values
        image = pixels.astype(dtype)
        found = vkbloom.vjp(image, settings, renderer=renderer)[1](cotangents)
        expected = reference.vjp(image, settings)[1](cotangents)
        check(found, expected, "image")
        # The sums need the images between; the other derivatives keep their bits.
        running = Passes(renderer, Inputs(image), floats, cotangents).submit("all")
        assert running
        assert np.allclose(running.images()["image"], found["image"], rtol=0, atol=1e-5)
        for name, value in running.sums().items():
            # Taps on both sides of texel centres leave only rounding errors of the reference.
            assert np.allclose(value, expected[name], rtol=1e-4, atol=1e-15), name
        again = vkbloom.vjp(image, settings, renderer=renderer)[1](cotangents)
        assert np.array_equal(again["image"], found["image"])
    source = Inputs(image).source((cotangents["final"],))
    plan = renderer._core.plan(source, floats, None, ("final",), "images")
    assert plan
    shaders = [shader for _, shader, *_ in plan.passes]
    if variant == "gpu" or has_linear_texels(renderer):
        special = (*TILES, *STRIPS, LEVELS, TAPS)
        assert tuple(shader for shader in shaders if shader in special) == passes


#: Settings that mix with a mask, the image's sides, and how many passes of the composite the
#: derivatives by image and mask have. Filters take the cotangents of its bloom, and those of its
#: scene where they are the first to add to these: of one kernel, of pictures, and of kernels.
MIXED: tuple[tuple[Any, tuple[int, int], int], ...] = (
    (BEVY.replace(exposure=0.5), (33, 67), 1),
    (BEVY.replace(intensity=0.7), (9, 14), 1),
    (PygfxBloom(levels=2, exposure=-0.5), (33, 66), 1),
    # A pass before the filters adds to the scene's, and a curve needs the bloom.
    (Separable(composite="mix", intensity=0.4, threshold=0.3), (20, 35), 2),
    (BEVY.replace(tonemap="aces"), (33, 67), 3),
)


@pytest.mark.parametrize("variant", ["cpu", "gpu"])
@pytest.mark.parametrize("case", MIXED)
def test_filters_take_a_composite_with_a_mask(
    varied: dict[str, Renderer], variant: str, case: tuple[Any, ...]
) -> None:
    settings, size, passes = case
    image = random_image(size[0], size[1], 4).astype(np.float32)
    image[0, 0, 0], image[1, 2, 1] = np.nan, np.inf
    mask = np.random.default_rng(3).random(size, np.float32)
    settings = settings.replace(**SINGLE)
    renderer = varied[variant]
    pullback, cotangents, expected = pull(renderer, image, settings, ("final",), mask=mask)
    found = pullback(cotangents)
    for name in ("image", "mask"):
        check(found, expected, name)
    source = Inputs(image, mask=mask).source((cotangents["final"],))
    plan = renderer._core.plan(source, settings, None, ("final",), "images")
    assert plan
    shaders = [shader for _, shader, *_ in plan.passes]
    # Of pixels the composite is a pass of its own, as with a curve.
    is_own = variant == "cpu" and not has_linear_texels(renderer)
    count = sum(shader.startswith("adjoint_composite") for shader in shaders)
    assert count == min(passes + is_own, 3)
    if variant == "cpu" and passes == 1 and has_linear_texels(renderer):
        assert not any(shader.startswith("adjoint_filter") for shader in shaders)


TRANSFORM = ["spectrum", "bloom"]
#: Settings, the passes from the glow to the bloom that run on a GPU for "final" alone, and those
#: beside filters that run for its derivative by the image. Passes read the image itself, or the
#: composite's cotangents, or add what a pass after them would.
FUSED: dict[str, tuple[Any, list[str], list[str]]] = {
    "glare": (BlenderGlare(threshold=0.3, size=0.3), ["glow", "bloom"], []),
    "exposed": (
        BlenderGlare(type="streaks", threshold=0.3, exposure=0.5),
        ["glow", "bloom"],
        [],
    ),
    "low": (
        BlenderGlare(type="streaks", threshold=0.3, quality="low"),
        ["frame", "bloom"],
        [],
    ),
    "convolution": (Convolution(psf=KERNEL), TRANSFORM, TRANSFORM),
    "mixed": (
        Convolution(psf=KERNEL, composite="mix", intensity=0.4, exposure=0.5),
        TRANSFORM,
        TRANSFORM,
    ),
    "halation": (vkbloom.Halation(pixel_size=30.0), TRANSFORM, TRANSFORM),
    "edge": (Convolution(psf=KERNEL, boundary="edge"), TRANSFORM, TRANSFORM),
    "bright": (
        Convolution(psf=vkbloom.psf.unreal(KERNEL, prefilter=(0.5, 1.2, 1.5))),
        TRANSFORM,
        TRANSFORM,
    ),
    "threshold": (Convolution(psf=KERNEL, threshold=0.3), ["glow", *TRANSFORM], TRANSFORM),
}


@pytest.mark.parametrize("variant", ["cpu", "gpu"])
@pytest.mark.parametrize("name", FUSED)
def test_passes_that_others_replace(varied: Any, name: str, variant: str) -> None:
    """Of an image with values of 0 and below; then of one with some that are not finite."""
    settings, forward, backward = FUSED[name]
    settings, renderer = settings.replace(**SINGLE), varied[variant]
    image = random_image(29, 38, channels=3, seed=1).astype(np.float32)
    image[2, 3], image[4, 5, 1] = -0.7, 0.0
    for seed, values in enumerate(((0.5, 0.5), (np.nan, np.inf))):
        cotangent = random_image(29, 38, channels=3, seed=seed).astype(np.float32) - 0.5
        image[0, 0, 0], image[1, 2, 1] = values
        expected, pullback = reference.vjp(image, settings)
        frames = renderer.apply(image, settings, framebuffers="final")
        assert np.allclose(frames["final"], expected["final"], rtol=0, atol=1e-5, equal_nan=True)
        running = Passes(renderer, Inputs(image), settings, {"final": cotangent}).submit()
        assert running
        assert running.submission
        check(running.images(), pullback({"final": cotangent}), "image")
        (timings,), _ = running.submission.wait()
        if variant == "gpu":
            assert [
                one for one in frames.timings if one in ("frame", "glow", *TRANSFORM)
            ] == forward
            ran = [one for one in timings if not one.startswith("adjoint") and one != "kernel"]
            assert ran == backward


@pytest.mark.parametrize("name", CASES if EXHAUSTIVE else ("blender ghosts", "prefilter edge"))
def test_tiles_have_the_derivatives_of_the_reference(varied: Any, name: str) -> None:
    """Among them ghosts, whose weights differ from texel to texel in a window of the usual size."""
    image = random_image(9, 41, channels=4, seed=1).astype(np.float32)
    pullback, cotangents, expected = pull(varied["gpu"], image, CASES[name])
    found = pullback(cotangents)
    assert isinstance(found, DeviceGradients)
    check(found, expected, "image")


@pytest.mark.parametrize("size", [(150, 11), (11, 150), (61, 90)])
def test_long_lines_have_the_derivatives_of_the_reference(varied: Any, size: Any) -> None:
    """Of several workgroups, of which some are far from edges, and blocks that are cut off."""
    weights = np.exp(-0.5 * (np.arange(25) / 9.0) ** 2)
    settings = Separable(weights=tuple(weights / (2 * weights.sum() - weights[0])), threshold=0.2)
    image = random_image(size[0], size[1], channels=4, seed=1).astype(np.float32)
    pullback, cotangents, expected = pull(varied["gpu"], image, settings)
    found = pullback(cotangents)
    check(found, expected, "image")
    source = Inputs(image).source((cotangents["final"],))
    plan = varied["gpu"]._core.plan(source, settings.replace(**SINGLE), None, ("final",), "images")
    assert plan
    assert "adjoint_line_comp" in [shader for _, shader, *_ in plan.passes]
