"""Derivatives by passes on the device: those of the reference, with the same bits in every run."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.device.abilities import has_linear_texels
from tests.exhaustive import EXHAUSTIVE, some
from tests.images import random_image
from tests.methods.cases import METHODS, OTHERS, presets_of_low_levels
from tests.planned import DeviceGradients, Inputs, Passes, device_fields, in_floats, pull_each
from tests.variants import open_variant
from vkbloom import (
    BevyBloom,
    BlenderGlare,
    DualKawase,
    FilamentBloom,
    GodotBloom,
    HdrpBloom,
    KinoBloom,
    PygfxBloom,
    Pyramid,
    Renderer,
    Separable,
    ThreeBloom,
    UrpBloom,
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
BEVY = BevyBloom(max_mip_dimension=16)
STREAKS = vkbloom.Streaks(
    angle=10, directions=3, iterations=2, halvings=1, colour_shift=0.3, threshold=0.2
)
KERNEL = np.random.default_rng(1).random((5, 5)) ** 8
CASES: dict[str, Any] = {
    "separable": Separable(),
    "hard": Separable(threshold=0.5, bloom_scale=1.6),
    "knee": Separable(threshold=0.6, knee=0.5, intensity=0.7, exposure=0.5),
    "between texels": Separable(bloom_scale=0.37, blur_scale=1.7, threshold=0.4, knee=0.3),
    "layers": Separable(loops=2, layers=((1.0, 0.5), (2.5, 0.25)), composite="mix", intensity=0.4),
    "direct": Separable(direct=True, texel="x", composite="screen", intensity=0.4),
    "alpha blur": Separable(alpha="blur", threshold=0.4, knee=0.5),
    "alpha max": Separable(alpha="max", tonemap="reinhard", encoding="srgb"),
    "aces": Pyramid(levels=3, tonemap="aces", encoding="gamma22"),
    "exponential": Pyramid(levels=2, tonemap="exponential", encoding="hlg"),
    "khronos": Separable(tonemap="khronos_neutral"),
    "agx": Separable(tonemap="agx"),
    "pq": Separable(encoding="pq"),
    "off": Separable(bloom=False, tonemap="aces"),
    "pyramid": Pyramid(
        levels=4, threshold=0.3, knee=0.5, radius=1.3, level_weights=(0.5, 0.2, 0.2, 0.1)
    ),
    "firefly": Pyramid(levels=2, firefly_filter=True, scale_x=1.5),
    "bevy": BEVY,
    "bevy threshold": BEVY.replace(threshold=0.4, knee=0.5),
    "kino": KinoBloom(radius=7.0, threshold=0.3, knee=0.5),
    "urp": UrpBloom(threshold=0.3, knee=0.5, clamp=1.5, tint=(1.0, 0.3, 0.6)),
    "urp 12": UrpBloom(version="12", high_quality=True, downscale="quarter", threshold=0.3),
    "tints": ThreeBloom(tints=((1, 0.5, 0.2), (1, 1, 1), (2, 1, 1), (0, 1, 1), (1, 1, 0.5))),
    "unreal": ThreeBloom(threshold=0.3, smooth_width=0.4),
    "r187": ThreeBloom(variant="r187", threshold=0.3, smooth_width=0.4),
    "ppv2": vkbloom.PostProcessingBloom(threshold=0.4, color=(1.0, 0.5, 0.2), clamp=1.2),
    "unreal standard": vkbloom.UnrealBloom(threshold=0.3),
    "halation": vkbloom.Halation(pixel_size=30.0),
    "ppv2 fast": vkbloom.PostProcessingBloom(threshold=None, fast=True),
    "pmndrs": vkbloom.PmndrsBloom(threshold=0.3, smoothing=0.4, levels=3, intensity=0.7),
    "babylon": vkbloom.BabylonBloom(threshold=0.3),
    "playcanvas": vkbloom.PlayCanvasBloom(threshold=0.3),
    "kawase": DualKawase(levels=3, offset=1.3),
    "pygfx": PygfxBloom(levels=3, filter_radius=0.2),
    "pygfx karis": PygfxBloom(levels=2, karis_average=True),
    "filament": FilamentBloom(resolution=40, levels=4),
    "filament threshold": FilamentBloom(resolution=16, levels=2, threshold=0.4, highlight=10.0),
    "filament alpha": FilamentBloom(resolution=16, threshold=0.4, alpha="blur"),
    "streaks": Separable(threshold=0.3, knee=0.5, glare=(STREAKS,)),
    "glare alpha": Pyramid(levels=2, alpha="blur", glare=(STREAKS,)),
    # Kernels of even sides, and larger than the image.
    **{
        f"{boundary} {len(kernel)}": vkbloom.Convolution(
            psf=kernel, boundary=boundary, threshold=0.3, knee=0.5
        )
        for boundary in ("zero", "edge", "wrap", "wrap_x")
        for kernel in (np.random.default_rng(1).random(shape) for shape in ((4, 5, 3), (13, 6, 3)))
    },
    "no kernel": vkbloom.Convolution(psf=np.ones((3, 3)), bloom=False),
    # Its groups below each other would be higher than images may be.
    "high": KinoBloom(radius=1.0),
    "psf": vkbloom.Convolution(psf=KERNEL, threshold=0.3),
    **{
        f"prefilter {boundary}": vkbloom.Convolution(
            psf=vkbloom.psf.unreal(KERNEL, prefilter=(0.5, 1.2, 1.5)), boundary=boundary
        )
        for boundary in ("zero", "edge")
    },
    "hdrp": HdrpBloom(anamorphism=0.3),
    "godot": GodotBloom(
        threshold=0.3, threshold_scale=0.4, luminance_cap=1.2, strength=1.3, exposure=0.4
    ),
    "godot screen": GodotBloom(
        level_weights=(0.5, 0, 0.3, 0, 0, 0, 0), composite="screen", intensity=0.7, threshold=None
    ),
    "godot soft": GodotBloom(
        composite="soft_light", tonemap="reinhard", bicubic=False, threshold=None
    ),
    "godot replace": GodotBloom(composite="replace", encoding="srgb", threshold=0.2),
    "godot mix": GodotBloom(composite="mix", intensity=0.4, exposure=0.5, threshold=0.2),
    "darktable": vkbloom.DarktableBloom(threshold=40.0, blur_size=2.0),
    "darktable aces": vkbloom.DarktableBloom(threshold=None, tonemap="aces"),
    "blender": BlenderGlare(threshold=0.4, smoothness=0.3, saturation=1.7, tint=(1, 0.5, 0.2)),
    "blender low": BlenderGlare(
        quality="low", size=1.0, maximum=0.4, threshold=0.3, saturation=0.4
    ),
    "blender streaks": BlenderGlare(type="streaks", threshold=0.3, streaks=3, streaks_angle=20),
    "blender streaks 5.2": BlenderGlare(
        type="streaks", version="5.2", threshold=0.3, quality="medium", streaks=2
    ),
    "blender fog": BlenderGlare(type="fog_glow", threshold=0.3, quality="medium"),
    "blender kernel": BlenderGlare(type="kernel", kernel=KERNEL, threshold=0.3),
    "blender ghosts": BlenderGlare(type="ghosts", threshold=None),
    "blender star": BlenderGlare(type="simple_star", threshold=None),
    "blender cross": BlenderGlare(type="simple_star", threshold=None, diagonal=False),
    "blender beams": BlenderGlare(type="sun_beams", threshold=None),
    "blender jitter": BlenderGlare(type="sun_beams", threshold=None, jitter=0.4),
    # Highlights that are 0 without a slope have no cotangents.
    "blender dark beams": BlenderGlare(type="sun_beams", threshold=1.2, smoothness=0.2),
    "blender dark blocks": BlenderGlare(
        type="sun_beams", threshold=0.8, smoothness=0.0, quality="low", jitter=0.3
    ),
    "halo": Pyramid(levels=1, glare=(vkbloom.Halo(radius=0.4, width=0.3),)),
    "halo aberration": Pyramid(
        levels=1, glare=(vkbloom.Halo(aberration=0.05, halvings=0, threshold=0.2),)
    ),
    "ghosts": Pyramid(
        levels=1, glare=(vkbloom.Ghosts(halvings=0, threshold=0.1, vignette=0.5, falloff=2.0),)
    ),
    "ghosts aberration": Pyramid(
        levels=1,
        glare=(vkbloom.Ghosts(scales=(0.001, 0.5, -0.9, 1.5), halvings=0, aberration=0.05),),
    ),
    "dirt": Pyramid(levels=1, alpha="blur", glare=(STREAKS, vkbloom.Dirt(seed=1))),
}


PARTS = ("glow", "blur_vertical", "bloom", "final")


def pull(
    renderer: Any, image: Any, settings: Any, names: tuple[str, ...] = PARTS, /, **given: Any
) -> Any:
    frames, pullback = vkbloom.vjp(image, settings, **given, renderer=renderer)
    random = np.random.default_rng(5)
    cotangents = {
        name: random.standard_normal(frames[name].shape).astype(np.float32)
        for name in names
        if name in frames
    }
    return pullback, cotangents, reference.vjp(image, settings, **given)[1](cotangents)


def check(found: Any, expected: Any, name: str, share: float = 1e-5) -> None:
    limit = share * max(np.abs(expected[name]).max(), 1e-3)
    assert np.abs(found[name] - expected[name]).max() <= limit, name


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


#: One preset of each method, and what has none.
ONE_OF_EACH = {
    **{settings.method: settings for settings in vkbloom.presets.values()},
    "darktable": vkbloom.DarktableBloom(),
    "urp": vkbloom.presets["unity_urp"],
    # A share of 0 that changes is left to the reference.
    "bevy": vkbloom.presets["photo"].replace(max_mip_dimension=64),
}


def check_sums(running: Any, expected: Any, fields: tuple[str, ...]) -> None:
    """Their error is relative to the root of the sum of squares, of which a part cancels."""
    found, sums = running.sums(min_share=0.0), running.sums_for(fields)
    squares = np.concatenate([array[1, 0] for array in sums.arrays]).astype(np.float64)
    for field in fields:
        roots = np.sqrt(sums.factors[field] ** 2 @ squares)
        errors = np.abs(found[field] - expected[field])
        assert found[field].shape == np.shape(expected[field])
        assert (errors <= 5e-5 * (roots + np.abs(expected[field]))).all(), field


#: What sets the shares of levels.
BY_SHARES: dict[str, tuple[str, ...]] = {
    "bevy": ("low_frequency_boost", "low_frequency_boost_curvature", "high_pass_frequency"),
    "urp": ("scatter",),
    "hdrp": ("scatter",),
    "pmndrs": ("radius",),
}


@pytest.mark.parametrize("method", ONE_OF_EACH)
def test_fields_of_the_composite_are_sums(renderer: Renderer, method: str) -> None:
    """And those of shares of levels, but not those that other passes read."""
    settings = ONE_OF_EACH[method].replace(**SINGLE, exposure=0.3, tonemap="none", encoding="none")
    image = 4 * random_image(35, 54, channels=3, seed=1).astype(np.float32)
    cotangents = {"final": np.random.default_rng(2).random(image.shape).astype(np.float32)}
    running = Passes(renderer, Inputs(image), settings, cotangents).submit("sums")
    assert running
    expected = reference.vjp(image, settings)[1](cotangents)
    composite = {"intensity", "exposure", "reference_white"} - settings._fields_before_composite
    check_sums(running, expected, (*composite, *BY_SHARES.get(method, ())))


LEARNED: dict[str, Any] = {"threshold": 0.4, "knee": 0.3, "intensity": 0.7}


@pytest.mark.parametrize(
    "curve", [("aces", "srgb"), ("agx", "none"), ("none", "pq"), ("none", "hlg")]
)
def test_sums_behind_a_steep_curve(renderer: Renderer, curve: Any) -> None:
    """They are asked for where the digits of the reference are not needed."""
    tonemap, encoding = curve
    settings = in_floats(Pyramid(tonemap=tonemap, encoding=encoding, **LEARNED))
    image = 4 * random_image(35, 54, channels=4, seed=1).astype(np.float32)
    cotangents = {"final": np.random.default_rng(2).normal(size=image.shape).astype(np.float32)}
    running = Passes(renderer, Inputs(image), settings, cotangents).submit("all", tuple(LEARNED))
    assert running
    assert not running.sums()
    check_sums(running, reference.vjp(image, settings)[1](cotangents), tuple(LEARNED))


#: Settings of published methods, and fields, of those that their thresholds read.
THRESHOLDS: dict[str, tuple[Any, tuple[str, ...]]] = {
    "kino": (vkbloom.KinoBloom(threshold=0.6), ("threshold", "knee")),
    "kino median": (
        vkbloom.KinoBloom(threshold=0.6, knee=0.0, anti_flicker=True),
        ("threshold", "knee"),
    ),
    "bevy": (
        vkbloom.BevyBloom(threshold=0.5, knee=0.4, max_mip_dimension=32),
        ("threshold", "knee"),
    ),
    "urp": (
        vkbloom.UrpBloom(threshold=0.5, knee=0.4, tint=(0.9, 0.4, 0.7)),
        ("threshold", "knee"),
    ),
    "playcanvas": (vkbloom.PlayCanvasBloom(threshold=0.5), ("threshold",)),
    # Its curve has a kink at 1.
    "ppv2": (vkbloom.PostProcessingBloom(threshold=1.0), ("threshold", "knee")),
    "ppv2 dark": (vkbloom.PostProcessingBloom(threshold=0.5), ("threshold", "knee")),
    "three": (vkbloom.ThreeBloom(threshold=0.5, smooth_width=0.7), ("threshold", "smooth_width")),
    "three node": (
        vkbloom.ThreeBloom(variant="node", threshold=0.5, smooth_width=0.7),
        ("threshold", "smooth_width"),
    ),
    "pmndrs": (vkbloom.PmndrsBloom(threshold=0.4, smoothing=0.9), ("threshold", "smoothing")),
    "pmndrs step": (vkbloom.PmndrsBloom(threshold=0.4, smoothing=0.0), ("threshold", "smoothing")),
    "pmndrs narrow": (vkbloom.PmndrsBloom(threshold=0.4, smoothing=1e-4), ("threshold",)),
    "pmndrs one level": (vkbloom.PmndrsBloom(levels=1, radius=0.3), ("threshold", "radius")),
    "urp dual": (vkbloom.UrpBloom(filter="dual", scatter=0.2), ("threshold", "knee")),
    "urp kawase": (vkbloom.UrpBloom(filter="kawase", scatter=0.2), ("threshold", "knee")),
    "unreal": (vkbloom.UnrealBloom(threshold=0.3), ("threshold",)),
    "filament": (
        vkbloom.FilamentBloom(threshold=0.5, highlight=10.0, resolution=24, levels=3),
        ("threshold", "highlight"),
    ),
    "godot": (
        vkbloom.GodotBloom(threshold=0.5, threshold_scale=0.8, glow_bloom=0.2),
        ("threshold", "threshold_scale", "glow_bloom"),
    ),
    "godot step": (
        vkbloom.GodotBloom(threshold=0.5, threshold_scale=0.0, luminance_cap=1.5, exposure=0.4),
        ("threshold", "threshold_scale", "glow_bloom"),
    ),
    "blender": (BlenderGlare(threshold=0.5, smoothness=0.3), ("threshold", "smoothness")),
    "blender ends": (
        BlenderGlare(type="ghosts", threshold=0.2, smoothness=0.7, maximum=0.5, quality="medium"),
        ("threshold", "smoothness"),
    ),
    "blender hard": (
        BlenderGlare(type="streaks", threshold=0.2, smoothness=0.0, maximum=0.5),
        ("threshold", "smoothness"),
    ),
}


@pytest.mark.parametrize("name", THRESHOLDS)
def test_fields_of_published_thresholds_are_sums(renderer: Renderer, name: str) -> None:
    settings, fields = THRESHOLDS[name]
    settings = settings.replace(**SINGLE)
    image = 2 * random_image(45, 70, channels=4, seed=1).astype(np.float32)
    image[3, 4, 1], image[5:9, 6:9], image[9, 9] = np.nan, 0.0, -1.0
    mask = random_image(45, 70, channels=1, seed=3)[..., 0].astype(np.float32)
    for given, alpha in (({}, "keep"), ({"mask": mask}, "blur")):
        chosen = settings.replace(alpha=alpha)
        cotangents = {"final": np.random.default_rng(2).random(image.shape).astype(np.float32)}
        passes = Passes(renderer, Inputs(image, **given), chosen, cotangents)
        running = passes.submit("all", fields)
        assert running
        assert ".by_own_threshold" in [output for output, *_ in running.plan.outputs]
        check_sums(running, reference.vjp(image, chosen, **given)[1](cotangents), fields)


#: Settings, and fields that do not change their bloom.
UNREAD: tuple[tuple[Any, tuple[str, ...]], ...] = (
    (vkbloom.Pyramid(levels=2), ("knee",)),
    (vkbloom.Separable(threshold=0.5), ("threshold", "knee")),
    (vkbloom.KinoBloom(threshold=None), ("knee",)),
    (vkbloom.ThreeBloom(threshold=None), ("smooth_width",)),
    (vkbloom.GodotBloom(threshold=None), ("threshold_scale", "glow_bloom")),
    (BlenderGlare(threshold=None), ("smoothness",)),
    (vkbloom.FilamentBloom(threshold=None), ("highlight",)),
    (vkbloom.UnrealBloom(threshold=-1.0), ("threshold",)),
    (vkbloom.PlayCanvasBloom(threshold=0.0), ("threshold",)),
    (vkbloom.PmndrsBloom(threshold=0.0, smoothing=0.0), ("threshold", "smoothing")),
    (vkbloom.BabylonBloom(threshold=0.5), ("threshold",)),
    (vkbloom.DarktableBloom(threshold=50.0), ("threshold",)),
)


@pytest.mark.parametrize(("settings", "fields"), UNREAD)
def test_fields_that_change_nothing_need_no_sums(
    renderer: Renderer, settings: Any, fields: tuple[str, ...]
) -> None:
    settings = settings.replace(**SINGLE)
    image = 2 * random_image(15, 20, channels=3, seed=1).astype(np.float32)
    passes = Passes(renderer, Inputs(image), settings, {"final": image})
    expected = reference.vjp(image, settings)[1]({"final": image})
    for results in ("all", "sums"):
        running = passes.submit(results, fields)
        assert running
        assert not {output for output, *_ in running.plan.outputs} - {".by_image"}
        found = running.sums()
        for field in fields:
            assert found[field] == expected[field] == 0, field


@pytest.mark.parametrize("names", [("up_1",), ("up_2", "down_1")])
def test_shares_have_sums_of_the_levels_with_cotangents(
    renderer: Renderer, names: tuple[str, ...]
) -> None:
    settings = BevyBloom(max_mip_dimension=48, format="rgba32float")
    image = random_image(45, 70, channels=3, seed=1).astype(np.float32)
    shapes = {name: part.shape for name, part in renderer.apply(image, settings).items()}
    cotangents = {name: np.ones(shapes[name], np.float32) for name in names}
    running = Passes(renderer, Inputs(image), settings, cotangents).submit("all")
    assert running
    check_sums(running, reference.vjp(image, settings)[1](cotangents), BY_SHARES["bevy"])


def test_fields_without_sums_are_left_to_the_reference(renderer: Renderer) -> None:
    """Bevy's intensity has a part in the sum of the composite, and one in those of shares."""
    settings = BevyBloom(max_mip_dimension=16)
    image = random_image(17, 26, channels=3, seed=1).astype(np.float32)
    given, cotangents = Inputs(image), {"final": image}
    expected = reference.vjp(image, in_floats(settings))[1](cotangents)
    for fields in (("low_frequency_boost",), ("exposure",)):
        (found,) = pull_each(renderer, settings, [(given, cotangents)], fields)
        for field in (*fields, "intensity"):
            assert np.isclose(found[field], expected[field], rtol=1e-4), field


#: Settings, and fields that are factors of levels.
FACTORS: dict[str, tuple[Any, tuple[str, ...]]] = {
    "three": (vkbloom.ThreeBloom(radius=0.3), ("radius", "tints", "intensity")),
    "three tinted": (
        vkbloom.ThreeBloom(
            threshold=0.2,
            tints=((1.0, 0.5, 2.0), (1.0,) * 3, (0.2, 0.4, 0.6), (1.0, 1.0, 0.9), (3.0, 1.0, 0.1)),
        ),
        ("radius", "tints", "threshold"),
    ),
    "three node": (
        vkbloom.ThreeBloom(variant="node", resolution_scale=1.0, tonemap="aces"),
        ("radius", "tints"),
    ),
    "godot": (
        vkbloom.GodotBloom(level_weights=(0.5, 0.0, 0.7, 1e-4, 2e-4, 0.0, 0.3)),
        ("level_weights", "intensity"),
    ),
    "godot bilinear": (
        vkbloom.GodotBloom(level_weights=(1.0,) * 7, bicubic=False, composite="screen"),
        ("level_weights", "threshold"),
    ),
    "urp": (vkbloom.UrpBloom(tint=(0.9, 0.03, 1.2)), ("tint", "threshold", "scatter")),
    "urp dual": (vkbloom.UrpBloom(tint=(0.9, 0.4, 0.7), filter="dual"), ("tint", "knee")),
    "urp kawase": (vkbloom.UrpBloom(tint=(0.9, 0.4, 0.7), filter="kawase"), ("tint",)),
    "ppv2": (vkbloom.PostProcessingBloom(color=(0.9, 0.4, 3.0)), ("color", "threshold")),
    "ppv2 fast": (vkbloom.PostProcessingBloom(fast=True, threshold=None), ("color",)),
}


@pytest.mark.parametrize("name", FACTORS)
def test_fields_that_are_factors_of_levels_are_sums(renderer: Renderer, name: str) -> None:
    settings, fields = FACTORS[name]
    image = 2 * random_image(45, 70, channels=4, seed=1).astype(np.float32)
    mask = random_image(45, 70, channels=1, seed=3)[..., 0].astype(np.float32)
    for given, alpha in (({}, "keep"), ({"mask": mask}, "blur")):
        chosen = settings.replace(**SINGLE, alpha=alpha)
        cotangents = {"final": np.random.default_rng(2).random(image.shape).astype(np.float32)}
        running = Passes(renderer, Inputs(image, **given), chosen, cotangents).submit("all", fields)
        assert running
        check_sums(running, reference.vjp(image, chosen, **given)[1](cotangents), fields)


def test_factors_without_sums_are_left_to_the_reference(renderer: Renderer) -> None:
    """A factor of 0 leaves nothing of a channel; levels with cotangents have those of others."""
    image = 2 * random_image(17, 26, channels=3, seed=1).astype(np.float32)
    settings = vkbloom.ThreeBloom(tints=((0.0, 1.0, 1.0), *((1.0,) * 3,) * 4))
    shapes = {name: part.shape for name, part in renderer.apply(image, settings).items()}
    for names in (("final",), ("final", "down_1")):
        cotangents = {name: np.ones(shapes[name], np.float32) for name in names}
        found = vkbloom.vjp(image, settings, renderer=renderer)[1](cotangents)
        expected = reference.vjp(image, settings)[1](cotangents)
        for field in ("tints", "radius"):
            assert np.allclose(found[field], expected[field], rtol=1e-4), (names, field)


SCALES = ("radius", "scale_x", "scale_y")
#: Settings, and fields that are distances of taps. Taps that are whole texels apart are at kinks.
DISTANCES: dict[str, tuple[Any, tuple[str, ...]]] = {
    "pyramid": (vkbloom.Pyramid(levels=3), SCALES),
    "pyramid anisotropic": (
        vkbloom.Pyramid(
            levels=4, radius=0.7, scale_x=1.3, scale_y=0.8, tonemap="reinhard", **LEARNED
        ),
        (*SCALES, "threshold", "intensity"),
    ),
    "pyramid of fireflies": (
        vkbloom.Pyramid(levels=2, level_weights=(0.5, -0.2), firefly_filter=True, bloom_scale=0.7),
        ("radius", "level_weights"),
    ),
    "dual": (vkbloom.DualKawase(levels=2, offset=1.7, composite="mix"), ("offset", "intensity")),
    "separable": (vkbloom.Separable(), ("blur_scale", "weights", "blur_strength")),
    "separable loops": (
        vkbloom.Separable(
            blur_scale=1.37, loops=2, layers=((1.0, 0.5), (2.0, 0.7)), bloom_scale=0.5, texel="x"
        ),
        ("blur_scale", "weights", "blur_strength"),
    ),
    "separable direct": (
        vkbloom.Separable(blur_scale=1.37, direct=True, first_tap=0, weights=(0.4, 0.0, 0.2)),
        ("blur_scale", "weights", "blur_strength"),
    ),
    "separable at a point": (
        vkbloom.Separable(layers=((0.0, 1.0), (1.0, 0.5)), bloom_scale=0.5, weights=(0.5, 0.2)),
        ("weights", "blur_strength"),
    ),
    "kino": (vkbloom.KinoBloom(radius=4.6, bloom_scale=0.8), ("radius", "threshold")),
    # The levels are as large as the image, or larger.
    "kino enlarged": (vkbloom.KinoBloom(radius=4.6, bloom_scale=2.0), ("radius",)),
    "pyramid enlarged": (Pyramid(levels=2, radius=0.83, bloom_scale=4.0), SCALES),
    "pygfx": (vkbloom.PygfxBloom(filter_radius=0.02), ("filter_radius",)),
    "urp dual": (vkbloom.UrpBloom(filter="dual", scatter=0.4), ("scatter", "tint")),
}


@pytest.mark.parametrize("variant", ["own", "gpu"])
@pytest.mark.parametrize("name", DISTANCES)
def test_fields_that_are_distances_of_taps_are_sums(
    renderer: Renderer, request: pytest.FixtureRequest, name: str, variant: str
) -> None:
    used = renderer if variant == "own" else request.getfixturevalue("varied")["gpu"]
    settings, fields = DISTANCES[name]
    image = 2 * random_image(45, 70, channels=4, seed=1).astype(np.float32)
    image[3, 4, 1] = np.nan
    mask = random_image(45, 70, channels=1, seed=3)[..., 0].astype(np.float32)
    given: Any = {"mask": mask} if variant == "gpu" else {}
    chosen = settings.replace(**SINGLE, alpha="blur" if variant == "gpu" else "keep")
    cotangents = {"final": np.random.default_rng(2).random(image.shape).astype(np.float32)}
    running = Passes(used, Inputs(image, **given), chosen, cotangents).submit("all", fields)
    assert running
    expected = reference.vjp(image, chosen, **given)[1](cotangents)
    check_sums(running, expected, fields)
    check(running.images(), expected, "image")


def test_distances_without_sums_are_left_to_the_reference(renderer: Renderer) -> None:
    """Taps at a distance of 0 have no slopes that could be divided by it; glare has other taps."""
    image = random_image(17, 26, channels=3, seed=1).astype(np.float32)
    streaks = vkbloom.Streaks(halvings=1, iterations=1)
    for settings in (Pyramid(radius=0.0), Pyramid(radius=0.7, glare=(streaks,))):
        found = vkbloom.vjp(image, settings, renderer=renderer)[1]({"final": image})
        expected = reference.vjp(image, settings)[1]({"final": image})
        assert np.isclose(found["radius"], expected["radius"], rtol=1e-4)


RAYS = vkbloom.Streaks(halvings=1, iterations=1, intensity=0.4)
GHOSTS = vkbloom.Ghosts(halvings=2, intensity=1.7, threshold=0.2)
PICTURE = random_image(8, 10, channels=3, seed=7).astype(np.float32)
#: Settings with glare, and fields that are intensities, beside others.
STAGES: dict[str, tuple[Any, tuple[str, ...]]] = {
    "separable": (
        Separable(glare=(RAYS, GHOSTS), intensity=0.6, threshold=0.3, knee=0.2),
        ("intensity", "threshold", "glare.0.intensity", "glare.1.intensity", "exposure"),
    ),
    "dirt": (
        Pyramid(levels=2, glare=(vkbloom.Dirt(image=PICTURE), GHOSTS), composite="screen"),
        ("glare.1.intensity", "intensity"),
    ),
    "three": (
        vkbloom.ThreeBloom(glare=(RAYS,), intensity=0.6),
        ("tints", "radius", "intensity", "glare.0.intensity"),
    ),
    "bevy": (
        BEVY.replace(glare=(RAYS,), composite="add"),
        ("intensity", "low_frequency_boost"),
    ),
    "mix": (Separable(glare=(RAYS,), composite="mix"), ("glare.0.intensity",)),
}


@pytest.mark.parametrize("name", STAGES)
def test_intensities_of_glare_are_sums(renderer: Renderer, name: str) -> None:
    settings, fields = STAGES[name]
    settings = settings.replace(**SINGLE)
    image = 2 * random_image(45, 70, channels=4, seed=1).astype(np.float32)
    shapes = {name: part.shape for name, part in renderer.apply(image, settings).items()}
    cotangents = {"final": np.random.default_rng(2).random(image.shape).astype(np.float32)}
    running = Passes(renderer, Inputs(image), settings, cotangents).submit("all", fields)
    assert running
    check_sums(running, reference.vjp(image, settings)[1](cotangents), fields)
    # With cotangents of its own, the bloom has no sum of those of the stages' sum.
    cotangents["bloom"] = np.ones(shapes["bloom"], np.float32)
    found = vkbloom.vjp(image, settings, renderer=renderer)[1](cotangents)
    expected = reference.vjp(image, settings)[1](cotangents)
    for field in fields:
        assert np.allclose(found[field], expected[field], rtol=1e-4), field


@pytest.mark.parametrize("alpha", ["keep", "blur"])
@pytest.mark.parametrize("name", ["hdrp", "pyramid", "godot"])
def test_sums_leave_out_an_alpha_that_is_not_blurred(
    renderer: Renderer, name: str, alpha: str
) -> None:
    """The bloom's cotangents have one, and its levels, too."""
    known: dict[str, tuple[Any, tuple[str, ...]]] = {
        "hdrp": (HdrpBloom(), ("scatter",)),
        "pyramid": (Pyramid(levels=3, level_weights=(0.5, 0.2, 0.1)), ("level_weights", "radius")),
        "godot": (GodotBloom(), ("level_weights",)),
    }
    settings, fields = known[name]
    settings = settings.replace(**SINGLE, alpha=alpha)
    image = random_image(27, 38, channels=4, seed=1).astype(np.float32)
    cotangents = {"bloom": random_image(27, 38, channels=4, seed=2).astype(np.float32)}
    running = Passes(renderer, Inputs(image), settings, cotangents).submit("sums", fields)
    assert running
    check_sums(running, reference.vjp(image, settings)[1](cotangents), fields)


def test_shares_of_other_filters_are_not_those_of_a_chain() -> None:
    known = {name: device_fields(in_floats(settings)) for name, (settings, _) in THRESHOLDS.items()}
    assert "scatter" in known["urp"]
    assert "scatter" not in known["urp kawase"]


@pytest.mark.parametrize("method", ONE_OF_EACH)
def test_sums_of_large_images_have_plans(renderer: Renderer, method: str) -> None:
    """With the images of several passes that add up, and of all levels."""
    image = np.zeros((700, 1100, 3), np.float32)
    settings = in_floats(ONE_OF_EACH[method])
    assert Passes(renderer, Inputs(image), settings, {"final": image}).submit("all") is not None


EXPOSED = ("threshold", "intensity", "exposure")
#: Settings, fields that are learned, and the sums that these need. Light is what is above the
#: threshold: where the bloom is linear in it, the derivative by the intensity needs no bloom.
SUMS_OF: dict[str, tuple[Any, tuple[str, ...], tuple[str, ...]]] = {
    "separable": (vkbloom.Separable(**LEARNED), tuple(LEARNED), ("light",)),
    "pyramid": (vkbloom.Pyramid(levels=3, exposure=1.0, **LEARNED), ("intensity",), ("light",)),
    "dual": (vkbloom.DualKawase(**LEARNED), EXPOSED, ("composite", "light")),
    "kernel": (
        vkbloom.Convolution(vkbloom.psf.gaussian(sigma=3), **LEARNED),
        tuple(LEARNED),
        ("light",),
    ),
    "zero": (
        vkbloom.Pyramid(levels=2, **LEARNED | {"intensity": 0.0}),
        tuple(LEARNED),
        ("composite", "light"),
    ),
    "mix": (
        vkbloom.Pyramid(levels=2, composite="mix", **LEARNED),
        tuple(LEARNED),
        ("composite", "threshold"),
    ),
    "firefly": (
        vkbloom.Pyramid(levels=2, firefly_filter=True, **LEARNED),
        ("intensity",),
        ("composite",),
    ),
    "curve": (
        vkbloom.Pyramid(levels=2, tonemap="reinhard", **LEARNED),
        tuple(LEARNED),
        ("composite", "threshold"),
    ),
    "threshold": (vkbloom.Pyramid(levels=2, **LEARNED), ("knee",), ("light",)),
    "published": (vkbloom.presets["kino"], ("intensity",), ("composite",)),
}


@pytest.mark.parametrize("name", SUMS_OF)
def test_only_the_sums_that_fields_need_are_computed(renderer: Renderer, name: str) -> None:
    settings, fields, kinds = SUMS_OF[name]
    settings = in_floats(settings)
    image = 2 * random_image(29, 38, channels=3, seed=1).astype(np.float32)
    cotangents = {"final": random_image(29, 38, channels=3, seed=2).astype(np.float32) - 0.3}
    mask = random_image(29, 38, channels=1, seed=3)[..., 0].astype(np.float32)
    given: Any = {"mask": mask} if name in ("pyramid", "dual") else {}
    passes = Passes(renderer, Inputs(image, **given), settings, cotangents)
    running = passes.submit("all", fields)
    assert running
    outputs = [output for output, *_ in running.plan.outputs if "image" not in output]
    assert sorted(outputs) == sorted(f".by_{part}" for part in (*kinds, *given))
    found = running.sums(min_share=0.0)
    expected = reference.vjp(image, settings, **given)[1](cotangents)
    for field in fields:
        assert np.allclose(found[field], expected[field], rtol=1e-5), field


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


SINGLE: Any = {"format": "rgba32float"}
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
