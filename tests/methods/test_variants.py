"""All variants of passes give the same picture: each is compared with the reference and the
others."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import pytest

from tests.exhaustive import EXHAUSTIVE, by_turns
from tests.framebuffers import assert_same
from tests.images import hdr_picture
from tests.methods.cases import DTYPES, METHODS
from tests.tolerance import assert_matches_reference, real, tolerance
from vkbloom import (
    BevyBloom,
    Convolution,
    DualKawase,
    FilamentBloom,
    Frames,
    HdrpBloom,
    Pyramid,
    Renderer,
    Scene,
    Separable,
    Settings,
    UnrealBloom,
    UrpBloom,
    gaussian_weights,
    presets,
)
from vkbloom.psf import gaussian
from vkbloom.reference import apply as reference_apply

VARIANTS = ("fragment", "cpu", "gpu")

# Sides that are multiples of the variants' strips and tiles, and some that are not; levels of
# exactly half the size, and others.
SIZES = ((97, 61), (136, 144))

# A pass of N x N taps has no variants except as a compute shader, and is slow.
TWO_PASSES = [name for name in METHODS if not name.startswith("direct")]

# For these a fused pass may replace several if only `final` is requested.
WHOLE: dict[str, Settings] = {
    "tutorial": Separable(),
    "threshold": Separable(threshold=0.3, knee=0.5, composite="screen", intensity=0.7),
    # (Without encoding: near black, the curve turns one level of the bloom into many.)
    "hard": Separable(threshold=0.30001, tonemap="aces"),
    "fractional": Separable(blur_scale=0.63, composite="mix", intensity=0.4),
    "wide": Separable(weights=gaussian_weights(4.0, 12), blur_strength=1.0, exposure=-1.0),
    "outline": Separable(first_tap=0, blur_strength=0.4, texel="x", dither=True, dither_seed=3),
    "pyramid": Pyramid(levels=4, threshold=0.2, tonemap="reinhard", encoding="gamma22"),
    "pyramid-radius": Pyramid(levels=3, radius=0.6, exposure=0.5),
}

# Methods with the same bits in every variant: all but blurs into another size, for which some
# variants add the taps before the filter.
BIT_EQUAL = {
    **WHOLE,
    "layers": METHODS["layers"],
    "loops": Separable(loops=3, blur_scale=1.1),
    "long": METHODS["longest"],
    "still": METHODS["still"],
    "kawase": METHODS["dual-kawase-offset"],
    "kawase-near": DualKawase(levels=2, threshold=0.3, knee=0.5),
    "kawase-far": DualKawase(levels=2, threshold=0.3, offset=3.5),
    # Levels that are smaller than the images here.
    "bevy": BevyBloom(max_mip_dimension=32),
    "filament": FilamentBloom(resolution=32),
    "hdrp": HdrpBloom(),
    # Taps that are in a window, and some that are too far apart for one.
    "urp-kawase": UrpBloom(filter="kawase", format=None),
    "urp-dual": UrpBloom(filter="dual", scatter=0.9, format=None),
}

# Methods with a blur into another size, and Fourier transforms, whose stages differ.
NEARLY_EQUAL: dict[str, Settings] = {
    "unity_urp": presets["unity_urp"],
    "threejs_unreal": presets["threejs_unreal"],
    "node": UnrealBloom(node=True, intensity=1.0),
    "convolution": Convolution(np.random.default_rng(2).random((4, 5, 3)), boundary="edge"),
}


# Convolutions, and Blender's fog glow, have the same passes but for the kernel.
PRESETS = [
    *(
        presets[name]
        for name in presets
        if not isinstance(presets[name], Convolution)
        and name not in (*NEARLY_EQUAL, "blender_fog_glow")
    ),
    presets["godot_4_6"].replace(bloom_size=(50, 31)),
    presets["blender_bloom"].replace(maximum=4.0),
    presets["pygfx"].replace(karis_average=True, bloom_scale=0.7),
]


def opened(variant: str) -> Renderer:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("VKBLOOM_VARIANT", variant)
        return Renderer(validation=True)


@pytest.fixture(scope="module", params=VARIANTS)
def variant(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def unfused() -> Iterator[Renderer]:
    """A renderer that runs every pass as its method defines it."""
    with opened("fragment") as renderer:
        yield renderer


@pytest.fixture(scope="module")
def varied(variant: str, unfused: Renderer) -> Iterator[Renderer]:
    """A renderer that uses one column of the table of variants."""
    if variant == "fragment":
        yield unfused
        return
    with opened(variant) as renderer:
        yield renderer


# The variant of the fixture `renderer` has the same comparison in test_apply.py.
@pytest.mark.parametrize("variant", ["fragment", "gpu"], indirect=True, scope="module")
@pytest.mark.parametrize(
    ("method", "other"), by_turns(TWO_PASSES, turns=itertools.product(DTYPES, SIZES))
)
def test_every_variant_against_the_reference(
    varied: Renderer, method: str, other: tuple[str, tuple[int, int]]
) -> None:
    dtype, size = other
    image = hdr_picture(*size, 4, dtype)
    settings = METHODS[method]
    assert_matches_reference(varied.apply(image, settings), image, settings)


# The others have the same bits in every variant, and test_presets.py has their references.
@pytest.mark.parametrize("name", NEARLY_EQUAL)
def test_presets_whose_variants_round_differently(varied: Renderer, name: str) -> None:
    image, settings = hdr_picture(48, 32, 4, "float32"), NEARLY_EQUAL[name]
    frames = varied.apply(image, settings)
    assert_matches_reference(frames, image, settings)
    # Another image in between, so that no result of the first call is cached.
    varied.apply(image[::-1], settings)
    alone = varied.apply(image, settings, framebuffers=("final",))
    np.testing.assert_array_equal(alone["final"], frames["final"])


FIRST = pytest.mark.parametrize("variant", VARIANTS[:1], indirect=True, scope="module")
OTHERS = pytest.mark.parametrize("variant", VARIANTS[1:], indirect=True, scope="module")


@FIRST
@pytest.mark.parametrize(
    ("name", "other"),
    by_turns(WHOLE, turns=itertools.product(DTYPES, [(1, 1), (61, 97), (520, 48)])),
)
def test_final_alone_is_the_final_of_all(
    varied: Renderer, name: str, other: tuple[str, tuple[int, int]]
) -> None:
    dtype, size = other
    image = hdr_picture(*size, 4, dtype)
    settings = WHOLE[name]
    all_at_once = varied.apply(image, settings)
    # Another image in between, so that no result of the first call is cached.
    varied.apply(image[::-1], settings)
    alone = varied.apply(image, settings, framebuffers=("final",))
    assert list(alone) == ["final"]
    np.testing.assert_array_equal(alone["final"], all_at_once["final"])
    if not settings.dither:
        # (Dithering makes two levels of a value that differs in its last bit.)
        assert_matches_reference(all_at_once, image, settings)


@OTHERS
@pytest.mark.parametrize(
    ("name", "other"),
    by_turns(
        BIT_EQUAL,
        turns=itertools.product([(256, 160), (61, 97), (520, 48), (1, 1)], DTYPES),
    ),
)
def test_every_variant_gives_the_same_bits(
    varied: Renderer, unfused: Renderer, name: str, other: tuple[tuple[int, int], str]
) -> None:
    size, dtype = other
    image = hdr_picture(*size, 4, dtype)
    expected = unfused.apply(image, BIT_EQUAL[name])
    alone = varied.apply(image, BIT_EQUAL[name], framebuffers=("final",))
    np.testing.assert_array_equal(alone["final"], expected["final"])
    varied.apply(image[::-1], BIT_EQUAL[name])
    frames = varied.apply(image, BIT_EQUAL[name])
    for framebuffer in expected:
        np.testing.assert_array_equal(frames[framebuffer], expected[framebuffer], framebuffer)


@OTHERS
@pytest.mark.parametrize(
    ("settings", "shape"),
    by_turns(PRESETS, turns=[("uint8", 136, 144), ("float16", 97, 61), ("float32", 136, 144)]),
)
def test_presets_have_the_same_bits_in_every_variant(
    varied: Renderer, unfused: Renderer, settings: Settings, shape: tuple[str, int, int]
) -> None:
    dtype, width, height = shape
    image = hdr_picture(width, height, 4, dtype)
    expected = unfused.apply(image, settings)
    alone = varied.apply(image, settings, framebuffers=("final",))
    np.testing.assert_array_equal(alone["final"], expected["final"])
    varied.apply(image[::-1], settings)
    frames = varied.apply(image, settings)
    for framebuffer in expected:
        np.testing.assert_array_equal(frames[framebuffer], expected[framebuffer], framebuffer)


@OTHERS
@pytest.mark.parametrize(
    ("name", "other"),
    by_turns(
        ["tutorial", "threshold", "outline", "pyramid", "long"],
        turns=itertools.product([(256, 160), (61, 97), (33, 5), (1, 1)], DTYPES),
    ),
)
def test_three_channels_have_the_bits_of_four(
    varied: Renderer, unfused: Renderer, name: str, other: tuple[tuple[int, int], str]
) -> None:
    size, dtype = other
    image = hdr_picture(*size, 4, dtype)
    image[..., 3] = 255 if dtype == "uint8" else 1
    expected = unfused.apply(image, BIT_EQUAL[name])
    image = np.ascontiguousarray(image[..., :3])
    alone = varied.apply(image, BIT_EQUAL[name], framebuffers=("final",))
    np.testing.assert_array_equal(alone["final"], expected["final"][..., :3])
    varied.apply(image[::-1], BIT_EQUAL[name])
    frames = varied.apply(image, BIT_EQUAL[name])
    for framebuffer in expected:
        right = expected[framebuffer][..., : frames[framebuffer].shape[2]]
        np.testing.assert_array_equal(frames[framebuffer], right, framebuffer)


@pytest.mark.parametrize("name", ["pygfx", "blender_bloom"])
def test_levels_of_another_format_than_the_frame(varied: Renderer, scene: Scene, name: str) -> None:
    """Half floats, where a deferred frame has 8 bits: the fused last pass is for one format."""
    alone = varied.render(
        scene, presets[name], (128, 96), shading="deferred", framebuffers=("final",)
    )
    frames = varied.render(scene, presets[name], (128, 96), shading="deferred", time=0.5)
    frames = varied.render(scene, presets[name], (128, 96), shading="deferred")
    np.testing.assert_array_equal(alone["final"], frames["final"])


@pytest.mark.parametrize("dtype", ["float16", "float32"])
def test_values_that_are_not_finite(varied: Renderer, dtype: str) -> None:
    image = hdr_picture(70, 50, 4, dtype)
    image[20, 30, 1] = np.nan
    image[21, 40, 0] = np.inf
    image[49, 69, 2] = -np.inf
    # (Also passes that read the image itself: into half of its size and into other sizes.)
    reading = [BIT_EQUAL[name] for name in ("kawase-near", "bevy", "filament", "hdrp")]
    every = [*WHOLE.values(), *reading]
    for settings in every if EXHAUSTIVE else every[dtype == "float16" :: 2]:
        frames = varied.apply(image, settings)
        # Another image in between, so that no result of the first call is cached.
        varied.apply(image[::-1], settings, framebuffers=("final",))
        alone = varied.apply(image, settings, framebuffers=("final",))
        np.testing.assert_array_equal(alone["final"], frames["final"])
        np.testing.assert_array_equal(np.isfinite(alone["final"]), np.isfinite(image))
        if not settings.dither and settings.tonemap == "none" and settings.encoding == "none":
            assert_matches_reference(frames, image, settings)


@pytest.mark.parametrize("threshold", [None, 0.5])
def test_the_largest_halves_stay_finite(varied: Renderer, threshold: float | None) -> None:
    image = np.full((20, 30, 4), 65504, np.float16)
    for settings in (Separable(threshold=threshold), Pyramid(levels=2, threshold=threshold)):
        alone = varied.apply(image, settings, framebuffers=("final",))["final"]
        np.testing.assert_array_equal(alone, image)


def test_lines_of_a_large_image(monkeypatch: pytest.MonkeyPatch, unfused: Renderer) -> None:
    # On a CPU, lines are unrolled only for more than 2^18 pixels.
    monkeypatch.setenv("VKBLOOM_VARIANT", "cpu")
    image = hdr_picture(257, 1028, 4, "uint8")
    with Renderer(validation=True) as renderer:
        frames = renderer.apply(image, Separable(), framebuffers=("blur_vertical", "bloom"))
    expected = unfused.apply(image, Separable(), framebuffers=("blur_vertical", "bloom"))
    for framebuffer in expected:
        np.testing.assert_array_equal(frames[framebuffer], expected[framebuffer], framebuffer)


def test_large_images_in_the_variant_of_gpus(
    monkeypatch: pytest.MonkeyPatch, unfused: Renderer
) -> None:
    # Tiles within the levels, and at all their edges.
    monkeypatch.setenv("VKBLOOM_VARIANT", "gpu")
    image = hdr_picture(1028, 772, 4, "uint8")
    settings = Pyramid(levels=2)
    with Renderer(validation=True) as renderer:
        alone = renderer.apply(image, settings, framebuffers=("final",))
        renderer.apply(image[::-1], settings)
        frames = renderer.apply(image, settings)
    np.testing.assert_array_equal(alone["final"], frames["final"])
    assert_same(frames, unfused.apply(image, settings))


# What runs


def is_fused(variant: str, renderer: Renderer) -> bool:
    """Return whether one pass makes the final picture of an image. The fused pass of CPUs stores
    words, for which the image must be in the host's memory."""
    return variant == "gpu" or (variant == "cpu" and renderer.info.type == "cpu")


def test_one_pass_stands_for_all_of_a_final(variant: str, varied: Renderer) -> None:
    image = hdr_picture(33, 44, 4, "float32", seed=5)
    ran = list(varied.apply(image, Separable(), framebuffers=("final",)).timings)
    assert ran == (
        ["final"] if is_fused(variant, varied) else ["glow", "blur_vertical", "bloom", "final"]
    )
    # The same again: nothing.
    again = varied.apply(image, Separable(), framebuffers=("final",))
    assert list(again.timings) == []


def test_cached_framebuffers_run_no_pass(varied: Renderer) -> None:
    image = hdr_picture(33, 44, 4, "float32", seed=6)
    frames = varied.apply(image, Separable())
    # Everything is cached, so a part of it runs nothing, and a change runs only the composite.
    alone = varied.apply(image, Separable(), framebuffers=("final",))
    assert list(alone.timings) == []
    np.testing.assert_array_equal(alone["final"], frames["final"])
    darker = varied.apply(image, Separable(exposure=-1.0), framebuffers=("final",))
    assert list(darker.timings) == ["final"]


def ran(frames: Iterable[Frames]) -> list[list[str]]:
    return [list(one.timings) for one in frames]


def test_sequence_runs_shared_passes_once(variant: str, varied: Renderer) -> None:
    image = hdr_picture(37, 52, 4, "float32", seed=7)
    whole = ["glow", "blur_vertical", "bloom", "final"]
    alone = ["final"] if is_fused(variant, varied) else whole
    exposures = [Separable(exposure=exposure) for exposure in (0.0, 1.0, 2.0, 3.0)]
    # The first frame is planned without the next one.
    rest = whole if is_fused(variant, varied) else ["final"]
    frames = list(varied.sweep(image, exposures, framebuffers=("final",)))
    assert ran(frames) == [alone, rest, ["final"], ["final"]]
    for settings, one in zip(exposures, frames, strict=True):
        expected = reference_apply(image, settings)["final"]
        assert np.abs(one["final"] - expected).max() <= tolerance(image.dtype, expected)
    # Single calls are planned without later ones.
    image = image[::-1]
    singly = [varied.apply(image, settings, framebuffers=("final",)) for settings in exposures]
    assert ran(singly) == [alone, rest, ["final"], ["final"]]


def test_sequence_runs_no_pass_of_other_settings(variant: str, varied: Renderer) -> None:
    image = hdr_picture(37, 52, 4, "float32", seed=8)
    fused = is_fused(variant, varied)
    alone = ["final"] if fused else ["blur_vertical", "bloom", "final"]
    strengths = [Separable(blur_strength=strength) for strength in (1.0, 2.0, 2.0, 0.5, 0.25)]
    frames = varied.sweep(image, strengths, framebuffers=("final",))
    assert ran(frames)[1:] == [alone, [], alone, alone]
    # Another image has another bloom, whatever the exposure was before.
    settings = [Separable(exposure=exposure) for exposure in (1.0, 2.0)]
    for turn, changed in enumerate(settings):
        one = varied.apply(image[turn + 1 :], changed, framebuffers=("final",))
        assert ran([one]) == [alone if fused else ["glow", *alone]]


def test_a_pass_has_one_time_in_every_variant(varied: Renderer, scene: Scene) -> None:
    frames = varied.render(scene, None, (120, 80), time=0.3)
    names = ["glow", "blur_vertical", "bloom", "scene", "final"]
    assert list(frames.timings) == names
    assert all(seconds > 0 for seconds in frames.timings.values())
    strength = Separable(blur_strength=1.0)
    changed = varied.render(scene, strength, (120, 80), time=0.3)
    assert list(changed.timings) == ["blur_vertical", "bloom", "final"]


# Scenes


@pytest.mark.parametrize("framebuffers", ["all", ("final",)], ids=["all", "final"])
def test_the_forward_frame(
    varied: Renderer, unfused: Renderer, framebuffers: str | tuple[str, ...]
) -> None:
    drawn = unfused.render(Scene.ufo(), None, (640, 360), time=0.2)
    frames = varied.render(Scene.ufo(), None, (640, 360), time=0.2, framebuffers=framebuffers)
    assert drawn["bloom"].max() > 100, "there is no bloom to compare"
    for name, array in frames.items():
        off = np.abs(array.astype(np.float64) - drawn[name])
        # The sampler's weights have 8 bits, so nine samples are up to 1.5 levels off. The other
        # variants only have rounding errors.
        assert off.max() <= (2 if array.dtype == np.uint8 else 0), name
        assert (off > 1).mean() < 1e-5, name


@pytest.mark.parametrize(
    "settings",
    [
        Separable(bloom_size=(40, 30), blur_scale=2.0),
        Separable(bloom_size=(40, 30), format="rgba16float"),
        Separable(bloom_size=(40, 30), layers=((1.0, 0.5), (2.0, 0.5))),
        Separable(bloom_scale=2.0),
        Separable(bloom_size=(300, 20)),
    ],
    ids=["scale", "half", "layers", "larger", "wider"],
)
def test_blurs_into_other_sizes(varied: Renderer, settings: Settings) -> None:
    image = hdr_picture(150, 110, 4, "float32")
    assert_matches_reference(varied.apply(image, settings), image, settings)
    uint8 = hdr_picture(150, 110, 4, "uint8")
    alone = varied.apply(uint8, settings, framebuffers=("final",))["final"]
    expected = reference_apply(uint8, settings)["final"]
    limit = tolerance(np.uint8, expected, stages_of_8_bits=2)
    assert np.abs(real(alone) - expected).max() <= limit


def test_unknown_variants_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("VKBLOOM_VARIANT", "quick")
    with pytest.raises(ValueError, match="VKBLOOM_VARIANT: quick is not one of auto, fragment"):
        Renderer()


def test_a_cpu_enlarges_in_strips_that_have_each_rows_taps_once() -> None:
    with Renderer("software") as software:
        plan = software.plan(np.zeros((18, 32, 3), np.float32), BevyBloom(max_mip_dimension=64))
    (first,) = (one for one in plan.passes if one.name == "down_0")
    assert first.shader.startswith("shrink_words")


def test_small_images_are_convolved_in_more_stages_of_smaller_pipelines() -> None:
    def stages(size: tuple[int, int]) -> int:
        image = np.zeros((size[1], size[0], 3), np.float32)
        plan = software.plan(image, Convolution(gaussian(2), kernel_size=(9, 9)))
        return sum(one.shader.startswith("fft_words") for one in plan.passes)

    with Renderer("software") as software:
        assert stages((500, 250)) > stages((500, 270))


def test_texels_are_what_fused_passes_take_them_for(renderer: Renderer) -> None:
    """The levels of 8 bits and all subnormal half floats, as a shader loads and stores them.

    On a CPU a level is multiplied by the float nearest to 1 / 255, on a GPU it is divided by 255.
    """
    levels = np.arange(256, dtype=np.uint8)
    factor = np.float32(1 / 255)
    loaded = levels * factor if renderer.info.type == "cpu" else levels / np.float32(255)
    halves = np.arange(1024, dtype=np.uint16).view(np.float16)
    cases: list[tuple[Any, Any, Any]] = [
        (levels, "rgba32float", loaded),
        (halves, "rgba32float", halves.astype(np.float32)),
        (halves.astype(np.float32), "rgba16float", halves),
    ]
    for values, format, expected in cases:
        image = np.tile(values[np.newaxis, :, np.newaxis], (1, 1, 4))
        glow = renderer.apply(image, Separable(format=format))["glow"]
        np.testing.assert_array_equal(glow[0, :, 0], expected)
