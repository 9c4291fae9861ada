"""What the variants of passes run, and large images in them; test_matrix.py has their pictures."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import pytest

from tests.device.abilities import has_linear_texels, infinities
from tests.exhaustive import EXHAUSTIVE
from tests.framebuffers import assert_same
from tests.images import hdr_picture
from tests.methods.cases import OTHERS, WHOLE
from tests.tolerance import assert_matches_reference, tolerance
from tests.variants import VARIANTS, open_variant
from vkbloom import (
    BevyBloom,
    BlenderGlare,
    Convolution,
    DualKawase,
    Frames,
    Ghosts,
    GodotBloom,
    KinoBloom,
    Pyramid,
    Renderer,
    Scene,
    Separable,
    Settings,
    presets,
)
from vkbloom.psf import gaussian
from vkbloom.reference import apply as reference_apply

#: Filters of one kernel and of several, which enlarge, reduce and keep the size.
TILED = (
    Pyramid(levels=2, threshold=0.5, knee=0.5),
    Pyramid(levels=2, radius=0.5, level_weights=(0.3, 0.9)),
    DualKawase(levels=2),
    KinoBloom(),
    presets["unity_urp"],
    presets["pygfx"],
)


@pytest.fixture(scope="module", params=VARIANTS)
def variant(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def unfused() -> Iterator[Renderer]:
    """A renderer that runs every pass as its method defines it."""
    with open_variant("fragment") as renderer:
        yield renderer


@pytest.fixture(scope="module")
def varied(variant: str, unfused: Renderer) -> Iterator[Renderer]:
    """A renderer that uses one column of the table of variants."""
    if variant == "fragment":
        yield unfused
        return
    with open_variant(variant) as renderer:
        yield renderer


@pytest.mark.parametrize("name", ["pygfx", "blender_bloom"])
def test_levels_of_another_format_than_the_frame(varied: Renderer, scene: Scene, name: str) -> None:
    """Half floats, where a deferred frame has 8 bits: the fused last pass is for one format."""
    alone = varied.render(
        scene, presets[name], (128, 96), shading="deferred", framebuffers=("final",)
    )
    frames = varied.render(scene, presets[name], (128, 96), shading="deferred", time=0.5)
    frames = varied.render(scene, presets[name], (128, 96), shading="deferred")
    np.testing.assert_array_equal(alone["final"], frames["final"])


def test_levels_without_a_weight_are_not_added_up(varied: Renderer) -> None:
    """As the engine does, so that an infinite one does not make the sum NaN."""
    image, weights = hdr_picture(70, 90, 3, "float32"), (0.0, 0.5, 1e-4, 0.2, 0.0, 0.0, 0.0)
    settings = GodotBloom(level_weights=weights)
    assert_matches_reference(varied.apply(image, settings), image, settings)
    for given, read in ((weights, ["down_1", "down_3"]), ((0.0,) * 7, ["down_0"])):
        passes = varied.plan(image, GodotBloom(level_weights=given)).passes
        names = {name for each in passes if each.name.startswith("bloom") for name in each.reads}
        assert sorted(name for name in names if name.startswith("down_")) == read


@pytest.mark.parametrize("dtype", ["float16", "float32"])
def test_values_that_are_not_finite(varied: Renderer, dtype: str) -> None:
    image = hdr_picture(70, 50, 4, dtype)
    image[20, 30, 1] = np.nan
    image[21, 40, 0], image[49, 69, 2] = infinities(varied, dtype)
    # (Also passes that read the image itself: into half of its size and into other sizes.)
    names = ("kawase-near", "bevy", "filament", "hdrp", "convolution-edge")
    every = [*WHOLE.values(), *(OTHERS[name] for name in names)]
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


@pytest.mark.parametrize(
    ("name", "size", "settings"),
    [("cpu", (257, 1028), Separable()), ("gpu", (1028, 772), Pyramid(levels=2))],
)
def test_large_images(
    unfused: Renderer, name: str, size: tuple[int, int], settings: Settings
) -> None:
    """Strips, and tiles within the levels and at all their edges."""
    image = hdr_picture(*size, 4, "uint8")
    with open_variant(name) as renderer:
        alone = renderer.apply(image, settings, framebuffers=("final",))
        renderer.apply(image[::-1], settings)
        frames = renderer.apply(image, settings)
    np.testing.assert_array_equal(alone["final"], frames["final"])
    assert_same(frames, unfused.apply(image, settings))


@pytest.mark.parametrize("size", [(258, 260), (261, 133), (5, 16001), (1, 300), (300, 1)])
def test_tiles(unfused: Renderer, size: tuple[int, int]) -> None:
    """Several tiles and parts of them, in simple ratios and others; small levels have none."""
    image = hdr_picture(*size, 3, "float16")
    bevy = BevyBloom(max_mip_dimension=max(min(size), 4))
    with open_variant("gpu") as renderer:
        for settings in (*TILED, bevy):
            alone = renderer.apply(image, settings, framebuffers=("final",))
            frames = renderer.apply(image, settings.replace(exposure=0.5))
            frames = renderer.apply(image, settings)
            np.testing.assert_array_equal(alone["final"], frames["final"])
            assert_same(frames, unfused.apply(image, settings))


# What runs


def is_fused(variant: str, renderer: Renderer) -> bool:
    """Return whether one pass makes the final picture of an image. The fused pass of CPUs stores
    linear texels, for which the image must be in the host's memory."""
    return variant == "gpu" or (variant == "cpu" and has_linear_texels(renderer))


@pytest.mark.parametrize("size", [(320, 180), (211, 97)])
def test_the_last_pass_contains_a_filter_that_adds_an_image(
    variant: str, varied: Renderer, size: tuple[int, int]
) -> None:
    image = hdr_picture(*size, 3, "float32")
    frames = varied.apply(image, presets["unreal"])
    varied.apply(image[::-1], presets["unreal"])
    alone = varied.apply(image, presets["unreal"], framebuffers="final")
    np.testing.assert_array_equal(alone["final"], frames["final"])
    assert "bloom" in frames.timings
    assert ("bloom" in alone.timings) == (variant == "fragment")


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
    # Single calls are planned without later ones. The same again runs nothing.
    image = image[::-1]
    singly = [
        varied.apply(image, settings, framebuffers=("final",))
        for settings in (exposures[0], *exposures)
    ]
    assert ran(singly) == [alone, [], rest, ["final"], ["final"]]


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
    ("name", "message"),
    [
        ("quick", "quick is not one of auto, fragment"),
        ("cp-filtered", "cp-filtered is not one of auto, fragment"),
        ("cpu-quick", "cpu has no variant quick"),
        ("cpu-filtered-", "cpu has no variant $"),
        ("cpu-tiles", "cpu has no variant tiles"),
        ("fragment-pixels", "fragment has no variant pixels"),
    ],
)
def test_unknown_variants_are_refused(
    monkeypatch: pytest.MonkeyPatch, name: str, message: str
) -> None:
    monkeypatch.setenv("VKBLOOM_VARIANT", name)
    with pytest.raises(ValueError, match=f"VKBLOOM_VARIANT: {message}"):
        Renderer()


@pytest.mark.parametrize("column", ["cpu", "gpu"])
def test_variants_can_be_left_out(column: str, unfused: Renderer) -> None:
    """Each variant of a preset; the picture stays, whatever runs in its place."""
    image, settings = hdr_picture(70, 50, 4, "float16"), presets["bevy_natural"]
    drawn = unfused.apply(image, settings)
    with open_variant(column) as renderer:
        names = {one.variant for one in renderer.plan(image, settings).passes} - {"fragment"}
    assert names == {"pixels", "filtered" if column == "cpu" else "tiles"}
    for left_out in (*((name,) for name in names), names):
        with open_variant("-".join((column, *left_out))) as renderer:
            left = {one.variant for one in renderer.plan(image, settings).passes}
            # A dispatch before a fused pass is the method's own, but called so.
            assert not left & {*left_out} - {"pixels"}
            frames = renderer.apply(image, settings)
        for name, array in frames.items():
            np.testing.assert_array_equal(array, drawn[name], err_msg=name)


def test_a_cpu_enlarges_in_strips_that_have_each_rows_taps_once(renderer: Renderer) -> None:
    plan = renderer.plan(np.zeros((18, 32, 3), np.float32), BevyBloom(max_mip_dimension=64))
    linear = has_linear_texels(renderer)
    (first,) = (one for one in plan.passes if one.name == "down_0")
    assert first.shader.startswith("taps_linear") == linear


def test_lines_of_up_to_256_elements_are_transformed_in_two_stages(unfused: Renderer) -> None:
    """Larger butterflies than 16 elements would save stages, but take longer than these."""

    def stages(width: int) -> int:
        image = np.zeros((4, width, 3), np.float32)
        plan = unfused.plan(image, Convolution(gaussian(2), kernel_size=(9, 1)))
        return sum(one.shader.startswith("fft_image") for one in plan.passes)

    # The kernel's rows, and the image's both ways.
    assert stages(300) - stages(250) == 3


def test_a_cpu_transforms_on_the_host(renderer: Renderer) -> None:
    """All stages along an axis are one pass; along columns with the product and the way back."""
    plan = renderer.plan(np.zeros((40, 300, 3), np.float32), Convolution(gaussian(2)))
    names = [one.name for one in plan.passes if one.shader == "host"]
    expected = ["kernel", "kernel", "spectrum", "bloom", "bloom"]
    assert names == (expected if has_linear_texels(renderer) else [])


@pytest.mark.parametrize("size", [(64, 48), (37, 5), (2, 3)])
@pytest.mark.parametrize("alpha", ["keep", "blur"])
def test_a_cpu_has_ghosts_with_the_bits_of_the_shader(
    renderer: Renderer, unfused: Renderer, size: tuple[int, int], alpha: Any
) -> None:
    """The host makes them: Blender's four at a time, and those of a stage."""
    image = hdr_picture(*size, 4, "float16")
    stage = Ghosts(scales=(-1.5, 0, 0.4), vignette=0, falloff=1, threshold=0, halvings=0)
    for settings in (
        BlenderGlare(type="ghosts", threshold=None, alpha=alpha),
        Pyramid(levels=1, alpha=alpha, glare=(stage,)),
    ):
        frames, expected = (each.apply(image, settings) for each in (renderer, unfused))
        assert_same(frames, expected)


def test_texels_are_what_fused_passes_take_them_for(renderer: Renderer) -> None:
    """The levels of 8 bits and all subnormal half floats, as a shader loads and stores them.

    Some devices multiply a level by the float nearest to 1 / 255, others divide it by 255.
    """
    levels = np.arange(256, dtype=np.uint8)
    image = np.tile(levels[np.newaxis, :, np.newaxis], (1, 1, 4))
    glow = renderer.apply(image, Separable(format="rgba32float"))["glow"][0, :, 0]
    products, quotients = levels * np.float32(1 / 255), levels / np.float32(255)
    loaded = products if (glow == products).all() else quotients
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
