"""Derivatives by passes on the device: those of the reference, with the same bits in every run."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.exhaustive import EXHAUSTIVE, some
from tests.images import random_image
from tests.methods.adjoints import (
    BEVY,
    CASES,
    KERNEL,
    SINGLE,
    check,
    pull,
)
from tests.methods.cases import METHODS, OTHERS, presets_of_low_levels
from tests.planned import DeviceGradients, Inputs
from vkbloom import (
    BlenderGlare,
    FilamentBloom,
    GodotBloom,
    HdrpBloom,
    KinoBloom,
    PygfxBloom,
    Pyramid,
    Renderer,
    Separable,
    _core,
    reference,
)

SIZES = ((11, 14), (16, 32), (7, 1), (1, 9), (1, 1))
#: Those whose fields are checked, too, and those that are checked in all sizes.
FIELDS = (
    *("knee", "pyramid", "streaks", "firefly", "alpha blur", "aces", "exponential", "agx", "pq"),
    *("bevy", "kino", "filament", "urp", "unreal", "psf", "kawase", "blender"),
)
COMPLETE = (
    *FIELDS[:2],
    *("pygfx karis", "filament", "filament threshold", "unreal standard", "halation"),
    *("hdrp", "godot", "darktable", "blender low", "blender streaks 5.2", "blender ghosts"),
    *("blender star", "blender jitter", "halo aberration", "ghosts aberration"),
)
#: Those whose weights count negative luminances.
NEGATIVE = ("pygfx karis",)


@pytest.mark.parametrize("name", CASES)
def test_passes_are_the_transposes_of_the_reference(renderer: Renderer, name: str) -> None:
    settings = CASES[name]
    channels = 4 if settings.alpha != "keep" else 3
    sizes = SIZES if name in COMPLETE else SIZES[:1]
    # A pass of Filament that is linear comes after the first one.
    sizes = (*sizes, (36, 50)) if name == "filament threshold" else sizes
    for size in ((4000, 2),) if name == "high" else sizes:
        image = random_image(*size, channels=channels, seed=1).astype(np.float32)
        image -= 0.4 * (name in NEGATIVE)
        pullback, cotangents, expected = pull(renderer, image, settings)
        found = pullback(cotangents)
        assert isinstance(found, DeviceGradients)
        assert [*found] == [*expected]
        for part in expected if name in FIELDS and size == SIZES[0] else ("image",):
            check(found, expected, part)
            assert found[part].dtype == np.float32
        again = pullback(cotangents)
        assert np.array_equal(found["image"], again["image"])


@pytest.mark.parametrize("name", CASES)
def test_derivatives_of_a_lamp_on_black_are_finite(renderer: Renderer, name: str) -> None:
    settings = CASES[name]
    image = np.zeros((11, 14, 3 if settings.alpha == "keep" else 4), np.float32)
    image[5, 7], image[..., 3:] = 4, 1
    pullback, cotangents, expected = pull(renderer, image, settings)
    found = pullback(cotangents)
    assert np.isfinite(found["image"]).all()
    # A beam that ends between the lamp and black is one of these by rounding: a kink of saturation.
    # PQ's exponent of 78.84 makes 4.7e-6 of half a unit in the last place of its base.
    if name != "blender beams":
        check(found, expected, "image", 2e-5 if name == "pq" else 1e-5)


def test_infinite_weights_have_no_derivative(renderer: Renderer) -> None:
    """A luminance of -1 makes the divisor 0."""
    image = -np.ones((6, 7, 3), np.float32)
    pullback, cotangents, expected = pull(renderer, image, CASES["pygfx karis"])
    check(pullback(cotangents), expected, "image")


BLENDER = BlenderGlare()
#: All that the package has: each method in each of its ways, each preset and each stage of glare.
BUILT_IN: dict[str, Any] = {
    **METHODS,
    **OTHERS,
    **{f"case {name}": settings for name, settings in CASES.items()},
    **{
        f"blender {type} {version}": BLENDER.replace(type=type, version=version)
        for type in ("bloom", "ghosts", "streaks", "fog_glow", "simple_star", "sun_beams")
        for version in ("4.3", "5.0", "5.2")
    },
    **{f"preset {name}": settings for name, settings in vkbloom.presets.items()},
    **{f"glare {name}": Pyramid(glare=stages) for name, stages in vkbloom.glares.items()},
}


@pytest.mark.parametrize("name", BUILT_IN)
def test_nothing_built_in_is_left_to_the_reference(renderer: Renderer, name: str) -> None:
    settings = BUILT_IN[name].replace(**SINGLE)
    image = np.zeros((64, 80, 4), np.float32)
    source = Inputs(image).source((image,))
    assert renderer._core.plan(source, settings, None, ("final",), "images") is not None


def test_all_methods_and_stages_are_among_them() -> None:
    methods = {settings.method for settings in BUILT_IN.values()}
    assert methods == {*_core.METHODS} - {"custom"}
    stages = {stage.stage for settings in BUILT_IN.values() for stage in settings.glare}
    assert stages == {*_core.STAGES}


@pytest.mark.parametrize("size", [(41, 9), (9, 47)])
@pytest.mark.parametrize("type", ["bloom", "streaks"])
def test_blender_5_2_reads_the_next_texels(renderer: Renderer, size: Any, type: Any) -> None:
    """Where its positions are rounded, at sides of these lengths."""
    height, width = size
    image = random_image(height, width).astype(np.float32)
    settings = BlenderGlare(type=type, version="5.2", threshold=0.3, streaks=2)
    pullback, cotangents, expected = pull(renderer, image, settings)
    other = pull(renderer, image, settings.replace(version="5.0"))[2]["image"]
    check(pullback(cotangents), expected, "image")
    assert np.abs(other - expected["image"]).max() > 0.1


@pytest.mark.parametrize(
    ("settings", "name", "passes"),
    [
        (BlenderGlare(type="sun_beams", size=0.02, threshold=None), "bloom", 2),
        (
            Pyramid(
                levels=1,
                glare=(vkbloom.Halo(halvings=0, aberration=0.1, radius=0.2, width=0.2),),
            ),
            "halo",
            2,
        ),
    ],
)
def test_groups_of_pixels_are_added_up(
    renderer: Renderer, settings: Any, name: str, passes: int
) -> None:
    """Of more pixels than an invocation may go through, about a centre. Both are linear.

    The places of samples in such an image are rounded, so that the device's own framebuffer is
    what these are the derivatives of.
    """
    image = random_image(2400, 4, channels=3, seed=1).astype(np.float32)
    frames, pullback = vkbloom.vjp(image, settings, renderer=renderer)
    cotangent = np.random.default_rng(5).standard_normal(frames[name].shape).astype(np.float32)
    cotangent[..., 3:] = 0
    found = pullback({name: cotangent})["image"]
    products = frames[name].astype(np.float64) * cotangent
    off = products.sum() - (found.astype(np.float64) * image).sum()
    assert abs(off) <= 1e-7 * np.abs(products).sum()
    source = Inputs(image).source((cotangent,))
    plan = renderer._core.plan(source, settings.replace(**SINGLE), None, (name,), "images")
    assert plan
    shaders = [shader for _, shader, *_ in plan.passes]
    gathering = sum(shader.startswith(("adjoint_beams", "adjoint_moved")) for shader in shaders)
    assert gathering == passes


# More levels than the picture needs take most of the time.
PRESETS: dict[str, Any] = {
    **vkbloom.presets,
    **({} if EXHAUSTIVE else presets_of_low_levels(64)),
    **{f"glare {name}": Pyramid(levels=2, glare=stages) for name, stages in vkbloom.glares.items()},
}


@pytest.mark.parametrize("name", some(PRESETS, 5))
def test_presets_are_differentiated(renderer: Renderer, name: str) -> None:
    image = random_image(33, 48, channels=3, seed=1).astype(np.float32)
    both = {
        "mask": np.random.default_rng(3).random((33, 48), np.float32),
        "emission": random_image(33, 48, channels=3, seed=2).astype(np.float32),
    }
    for given in ({}, both):
        pullback, cotangents, expected = pull(renderer, image, PRESETS[name], **given)
        found = pullback(cotangents)
        assert isinstance(found, DeviceGradients)
        for part in ("image", *given):
            check(found, expected, part)


@pytest.mark.parametrize("name", ["blender dark beams", "blender dark blocks"])
def test_sun_beams_pass_over_dark_highlights_behind_a_mask(renderer: Renderer, name: str) -> None:
    """Of the emission, which then is what glows. A mask of 0 has a derivative where there is light.

    The pass reads what the highlights are made of, of which it knows that they are dark.
    """
    image, emission = (random_image(24, 32, channels=3, seed=seed) for seed in (1, 2))
    mask = np.random.default_rng(3).random((24, 32), np.float32)
    mask[4:14, 6:20] = 0
    given = {"mask": mask, "emission": emission.astype(np.float32)}
    pullback, cotangents, expected = pull(renderer, image.astype(np.float32), CASES[name], **given)
    found = pullback(cotangents)
    for part in ("image", *given):
        check(found, expected, part)
    source = Inputs(given["emission"], mask=mask).source((emission.astype(np.float32),))
    plan = renderer._core.plan(source, CASES[name].replace(**SINGLE), None, ("bloom",), "images")
    assert plan
    reads = {shader: names for _, shader, names, *_ in plan.passes}
    assert "frame" in reads["adjoint_beams_comp"]


def test_a_mask_of_what_is_mixed_is_a_small_difference(renderer: Renderer) -> None:
    """Film keeps most light where it is, so that the parts by scene and by bloom nearly cancel."""
    image = random_image(97, 131, channels=3, seed=1).astype(np.float32)
    mask = np.random.default_rng(3).random((97, 131), np.float32)
    pullback, cotangents, expected = pull(
        renderer, image, vkbloom.presets["halation"], ("final",), mask=mask
    )
    check(pullback(cotangents), expected, "mask")


def test_the_alpha_gets_nothing_of_the_bloom(renderer: Renderer) -> None:
    """Also where the image itself is the source, and cotangents of the bloom go to it directly."""
    image = random_image(9, 14, channels=4, seed=1).astype(np.float32)
    cotangents = {"final": random_image(9, 14, channels=4, seed=2).astype(np.float32)}
    streaks = vkbloom.Streaks(halvings=0, iterations=1)
    for settings in (
        Separable(glare=(streaks, streaks)),
        Separable(glare=(vkbloom.Streaks(halvings=1, iterations=1),)),
        vkbloom.Convolution(psf=KERNEL),
    ):
        found = vkbloom.vjp(image, settings, renderer=renderer)[1](cotangents)
        assert isinstance(found, DeviceGradients)
        check(found, reference.vjp(image, settings)[1](cotangents), "image")


#: Methods whose first passes read the mask.
MASKED = (
    BEVY,
    KinoBloom(radius=1.0, bloom_scale=0.5),
    PygfxBloom(levels=1, karis_average=True),
    FilamentBloom(resolution=16, levels=1),
    FilamentBloom(resolution=16, levels=1, threshold=0.3),
    HdrpBloom(),
    GodotBloom(threshold=0.2, level_weights=(1.0, 0.5, 0, 0, 0, 0, 0)),
    vkbloom.DarktableBloom(threshold=40.0, blur_size=2.0),
    BlenderGlare(threshold=0.3, quality="medium"),
)


@pytest.mark.parametrize("dtype", [np.float32, np.float16, np.uint8])
def test_all_inputs_have_derivatives(renderer: Renderer, dtype: Any) -> None:
    random = np.random.default_rng(3)
    image, emission = (
        (random_image(13, 9, seed=seed).clip(0, 1) * (255 if dtype == np.uint8 else 1)).astype(
            dtype
        )
        for seed in (1, 2)
    )
    mask = random.random((13, 9), np.float32)
    separable = Separable(threshold=0.3, knee=0.5, composite="mix", intensity=0.3, bloom_scale=0.5)
    both = {"mask": mask, "emission": emission}
    cases = [(separable, {"mask": mask}), *((settings, both) for settings in (separable, *MASKED))]
    for settings, given in cases:
        pullback, cotangents, expected = pull(renderer, image, settings, **given)
        found = pullback(cotangents)
        assert isinstance(found, DeviceGradients)
        for name in ("image", *given):
            check(found, expected, name)


def test_only_what_is_read_is_computed(renderer: Renderer) -> None:
    """Derivatives by images run no sums, and those of a closed renderer come from the reference."""
    image = random_image(9, 8, seed=1).astype(np.float32)
    with vkbloom.Renderer(renderer.info.name) as own:
        pullback, cotangents, expected = pull(own, image, Separable(threshold=0.2, knee=0.5))
        found = pullback(cotangents)
    assert isinstance(found, DeviceGradients)
    assert [*found._known] == ["image"]
    check(found, expected, "knee")
    assert "blur_scale" in found
    assert found.keys() == expected.keys()
    assert not isinstance(pullback(cotangents), DeviceGradients)
