"""Derivatives by fields that are sums of the device: those of the reference."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.images import random_image
from tests.methods.adjoints import (
    BEVY,
    SINGLE,
    check,
)
from tests.planned import Inputs, Passes, device_fields, in_floats, pull_each
from tests.variants import open_variant
from vkbloom import (
    BevyBloom,
    BlenderGlare,
    GodotBloom,
    HdrpBloom,
    Pyramid,
    Renderer,
    Separable,
    reference,
)

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
    "separable and still": (
        vkbloom.Separable(blur_scale=0.0, threshold=0.3, knee=0.5),
        ("weights", "blur_strength", "threshold"),
    ),
    # In floats the last tap would be beside a texel's centre, and not at it.
    "separable at a centre": (
        vkbloom.Separable(layers=((1.6, 1.0),), weights=(0.2, 0.1, 0.1, 0.1, 0.1, 0.1)),
        ("blur_scale",),
    ),
    "separable and weights at a centre": (
        vkbloom.Separable(layers=((1.6, 1.0),), weights=(0.2, 0.1, 0.1, 0.1, 0.1, 0.1)),
        ("blur_scale", "weights"),
    ),
    "separable of many taps": (
        vkbloom.Separable(blur_scale=1.37, weights=(*np.linspace(0.1, 0.01, 20).tolist(),)),
        ("blur_scale", "weights"),
    ),
    "kino": (vkbloom.KinoBloom(radius=4.6, bloom_scale=0.8), ("radius", "threshold")),
    # The levels are as large as the image, or larger.
    "kino enlarged": (vkbloom.KinoBloom(radius=4.6, bloom_scale=2.0), ("radius",)),
    "pyramid enlarged": (Pyramid(levels=2, radius=0.83, bloom_scale=4.0), SCALES),
    "pygfx": (vkbloom.PygfxBloom(filter_radius=0.02), ("filter_radius",)),
    "urp dual": (vkbloom.UrpBloom(filter="dual", scatter=0.4), ("scatter", "tint")),
}


@pytest.fixture(scope="module")
def gpu(software: Any) -> Iterator[Renderer]:
    """A renderer with the variants of GPUs."""
    with open_variant("gpu", "software", validation=False) as renderer:
        yield renderer


@pytest.mark.parametrize("variant", ["own", "gpu"])
@pytest.mark.parametrize("name", DISTANCES)
def test_fields_that_are_distances_of_taps_are_sums(
    renderer: Renderer, request: pytest.FixtureRequest, name: str, variant: str
) -> None:
    used = renderer if variant == "own" else request.getfixturevalue("gpu")
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


@pytest.mark.parametrize("name", vkbloom.presets)
def test_which_fields_have_sums_does_not_depend_on_numbers(name: str) -> None:
    """What is known of settings is kept for those with other numbers."""
    settings = in_floats(vkbloom.presets[name])
    fields = device_fields(settings)
    values = {field: np.multiply(settings.value_of(field), 0.75).tolist() for field in fields}
    assert device_fields(settings.replace(**values, bloom_scale=0.5)) == fields


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
