"""The forms that passes run in give one picture: each against the reference and the others."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.images import hdr_picture
from tests.methods.cases import DTYPES, METHODS
from tests.tolerance import assert_matches_reference, real, tolerance
from vkbloom import (
    Convolution,
    Frames,
    Pyramid,
    Renderer,
    Scene,
    Separable,
    Settings,
    gaussian_weights,
    presets,
)
from vkbloom.reference import apply as reference_apply

FORMS = ("fragment", "cpu", "gpu")

# Sides that the strips and tiles of the forms divide, and some that leave a rest; levels of exactly
# half the size, and some that are not.
SIZES = ((97, 61), (136, 144))

# One N x N pass has no other form than a compute shader's, and takes its time.
FORMED = [name for name in METHODS if not name.startswith("direct")]

# Of these a pass may stand for several when only `final` is wanted.
WHOLE: dict[str, Settings] = {
    "tutorial": Separable(),
    "threshold": Separable(threshold=0.3, knee=0.5, composite="screen", intensity=0.7),
    # (Not encoded: near black, a curve makes many levels of the bloom's one.)
    "hard": Separable(threshold=0.30001, tonemap="aces"),
    "fractional": Separable(blur_scale=0.63, composite="mix", intensity=0.4),
    "wide": Separable(weights=gaussian_weights(4.0, 12), blur_strength=1.0, exposure=-1.0),
    "outline": Separable(first_tap=0, blur_strength=0.4, texel="x", dither=True, dither_seed=3),
    "pyramid": Pyramid(levels=4, threshold=0.2, tonemap="reinhard", encoding="gamma22"),
    "pyramid-radius": Pyramid(levels=3, radius=0.6, exposure=0.5),
}

# The same bits in every form: all but blurs into another size, which some forms filter after the
# taps are added and not before.
BIT_EQUAL = {
    **WHOLE,
    "layers": METHODS["layers"],
    "loops": Separable(loops=3, blur_scale=1.1),
    "long": METHODS["longest"],
    "still": METHODS["still"],
    "kawase": METHODS["dual-kawase-offset"],
}


# Convolutions have the same passes but for the kernel: one with colours stands for all.
PRESETS = [
    name for name in presets if name == "iris_6" or not isinstance(presets[name], Convolution)
]


@pytest.fixture(scope="module", params=FORMS)
def form(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def formed(form: str) -> Iterator[Renderer]:
    """A renderer that is held to one table of forms."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("VKBLOOM_FORM", form)
        opened = Renderer(validation=True)
    with opened:
        yield opened


@pytest.mark.parametrize("size", SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("method", FORMED)
def test_every_form_against_the_reference(
    formed: Renderer, method: str, dtype: str, size: tuple[int, int]
) -> None:
    image = hdr_picture(*size, 4, dtype)
    settings = METHODS[method]
    assert_matches_reference(formed.apply(image, settings), image, settings)


@pytest.mark.parametrize("name", PRESETS)
def test_presets_in_every_form(formed: Renderer, name: str) -> None:
    image = hdr_picture(96, 64, 4, "float32")
    assert_matches_reference(formed.apply(image, presets[name]), image, presets[name])


@pytest.mark.parametrize("size", [(1, 1), (61, 97), (520, 48)], ids=str)
@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("name", WHOLE)
def test_final_alone_is_the_final_of_all(
    formed: Renderer, name: str, dtype: str, size: tuple[int, int]
) -> None:
    image = hdr_picture(*size, 4, dtype)
    settings = WHOLE[name]
    all_at_once = formed.apply(image, settings)
    # Another image in between, so that nothing of the first call is left.
    formed.apply(image[::-1], settings)
    alone = formed.apply(image, settings, attachments=("final",))
    assert list(alone) == ["final"]
    np.testing.assert_array_equal(alone["final"], all_at_once["final"])
    if not settings.dither:
        # (Dithering makes two levels of a value that differs in its last bit.)
        assert_matches_reference(all_at_once, image, settings)


@pytest.fixture(scope="module")
def unfused() -> Iterator[Renderer]:
    """A renderer that runs every pass as its method has it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("VKBLOOM_FORM", "fragment")
        with Renderer(validation=True) as renderer:
            yield renderer


@pytest.mark.parametrize("size", [(256, 160), (61, 97), (1, 1)], ids=str)
@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("name", BIT_EQUAL)
def test_every_form_gives_the_same_bits(
    formed: Renderer, unfused: Renderer, name: str, dtype: str, size: tuple[int, int]
) -> None:
    image = hdr_picture(*size, 4, dtype)
    expected = unfused.apply(image, BIT_EQUAL[name])
    alone = formed.apply(image, BIT_EQUAL[name], attachments=("final",))
    np.testing.assert_array_equal(alone["final"], expected["final"])
    formed.apply(image[::-1], BIT_EQUAL[name])
    frames = formed.apply(image, BIT_EQUAL[name])
    for framebuffer in expected:
        np.testing.assert_array_equal(frames[framebuffer], expected[framebuffer], framebuffer)


@pytest.mark.parametrize("size", [(256, 160), (61, 97), (33, 5), (1, 1)], ids=str)
@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("name", ["tutorial", "threshold", "outline", "pyramid", "long"])
def test_three_channels_have_the_bits_of_four(
    formed: Renderer, unfused: Renderer, name: str, dtype: str, size: tuple[int, int]
) -> None:
    image = hdr_picture(*size, 4, dtype)
    image[..., 3] = 255 if dtype == "uint8" else 1
    expected = unfused.apply(image, BIT_EQUAL[name])
    image = np.ascontiguousarray(image[..., :3])
    alone = formed.apply(image, BIT_EQUAL[name], attachments=("final",))
    np.testing.assert_array_equal(alone["final"], expected["final"][..., :3])
    formed.apply(image[::-1], BIT_EQUAL[name])
    frames = formed.apply(image, BIT_EQUAL[name])
    for framebuffer in expected:
        right = expected[framebuffer][..., : frames[framebuffer].shape[2]]
        np.testing.assert_array_equal(frames[framebuffer], right, framebuffer)


@pytest.mark.parametrize("name", PRESETS)
def test_final_alone_has_the_bits_of_the_final_of_all(formed: Renderer, name: str) -> None:
    for dtype in DTYPES:
        image = hdr_picture(136, 144, 4, dtype)
        alone = formed.apply(image, presets[name], attachments=("final",))["final"]
        formed.apply(image[::-1], presets[name])
        np.testing.assert_array_equal(alone, formed.apply(image, presets[name])["final"])


def test_values_that_are_not_finite(formed: Renderer) -> None:
    image = hdr_picture(70, 50, 4, "float32")
    image[20, 30, 1] = np.nan
    image[21, 40, 0] = np.inf
    image[49, 69, 2] = -np.inf
    for settings in (*WHOLE.values(), presets["filament"]):
        frames = formed.apply(image, settings)
        alone = formed.apply(image, settings, attachments=("final",))
        for final in (frames["final"], alone["final"]):
            np.testing.assert_array_equal(np.isfinite(final), np.isfinite(image))
        if not settings.dither and settings.tonemap == "none" and settings.encoding == "none":
            assert_matches_reference(frames, image, settings)


@pytest.mark.parametrize("threshold", [None, 0.5])
def test_the_largest_halves_stay_finite(formed: Renderer, threshold: float | None) -> None:
    image = np.full((20, 30, 4), 65504, np.float16)
    for settings in (Separable(threshold=threshold), Pyramid(levels=2, threshold=threshold)):
        alone = formed.apply(image, settings, attachments=("final",))["final"]
        np.testing.assert_array_equal(alone, image)


def test_large_images_in_the_form_of_gpus(monkeypatch: pytest.MonkeyPatch) -> None:
    # There strips are for large images alone.
    monkeypatch.setenv("VKBLOOM_FORM", "gpu")
    image = hdr_picture(1028, 772, 4, "uint8")
    settings = Pyramid(levels=2)
    with Renderer(validation=True) as renderer:
        alone = renderer.apply(image, settings, attachments=("final",))
        renderer.apply(image[::-1], settings)
        frames = renderer.apply(image, settings)
    np.testing.assert_array_equal(alone["final"], frames["final"])
    assert_matches_reference(frames, image, settings)


# What runs


def test_one_pass_stands_for_all_of_a_final(form: str, formed: Renderer) -> None:
    image = hdr_picture(33, 44, 4, "float32", seed=5)
    ran = list(formed.apply(image, Separable(), attachments=("final",)).timings)
    assert ran == (["glow", "blur_vertical", "bloom", "final"] if form == "fragment" else ["final"])
    # The same again: nothing.
    again = formed.apply(image, Separable(), attachments=("final",))
    assert list(again.timings) == []


def test_what_is_there_is_not_made_again(formed: Renderer) -> None:
    image = hdr_picture(33, 44, 4, "float32", seed=6)
    frames = formed.apply(image, Separable())
    # All is there: nothing runs for a part of it; and the composite alone after a change.
    alone = formed.apply(image, Separable(), attachments=("final",))
    assert list(alone.timings) == []
    np.testing.assert_array_equal(alone["final"], frames["final"])
    darker = formed.apply(image, Separable(exposure=-1.0), attachments=("final",))
    assert list(darker.timings) == ["final"]


def ran(frames: Iterable[Frames]) -> list[list[str]]:
    return [list(one.timings) for one in frames]


def test_a_sequence_makes_once_what_its_settings_share(form: str, formed: Renderer) -> None:
    image = hdr_picture(37, 52, 4, "float32", seed=7)
    whole = ["glow", "blur_vertical", "bloom", "final"]
    alone = whole if form == "fragment" else ["final"]
    exposures = [Separable(exposure=exposure) for exposure in (0.0, 1.0, 2.0, 3.0)]
    # The first frame comes without a look at the next.
    rest = ["final"] if form == "fragment" else whole
    frames = list(formed.apply_many(image, exposures, attachments=("final",)))
    assert ran(frames) == [alone, rest, ["final"], ["final"]]
    for settings, one in zip(exposures, frames, strict=True):
        expected = reference_apply(image, settings)["final"]
        assert np.abs(one["final"] - expected).max() <= tolerance(image.dtype, expected)
    # Nor are single calls looked at before they come.
    image = image[::-1]
    singly = [formed.apply(image, settings, attachments=("final",)) for settings in exposures]
    assert ran(singly) == [alone, rest, ["final"], ["final"]]


def test_a_sequence_makes_nothing_for_others(form: str, formed: Renderer) -> None:
    image = hdr_picture(37, 52, 4, "float32", seed=8)
    alone = ["blur_vertical", "bloom", "final"] if form == "fragment" else ["final"]
    strengths = [Separable(blur_strength=strength) for strength in (1.0, 2.0, 2.0, 0.5, 0.25)]
    frames = formed.apply_many(image, strengths, attachments=("final",))
    assert ran(frames)[1:] == [alone, [], alone, alone]
    # Another image has another bloom, whatever the exposure was before.
    settings = [Separable(exposure=exposure) for exposure in (1.0, 2.0)]
    for turn, changed in enumerate(settings):
        one = formed.apply(image[turn + 1 :], changed, attachments=("final",))
        assert ran([one]) == [["glow", *alone] if form == "fragment" else alone]


def test_a_pass_has_one_time_in_every_form(formed: Renderer, scene: Scene) -> None:
    frames = formed.render(scene, None, (120, 80), time=0.3)
    names = ["glow", "blur_vertical", "bloom", "scene", "final"]
    assert list(frames.timings) == names
    assert all(seconds > 0 for seconds in frames.timings.values())
    strength = Separable(blur_strength=1.0)
    changed = formed.render(scene, strength, (120, 80), time=0.3)
    assert list(changed.timings) == ["blur_vertical", "bloom", "final"]


# Scenes


@pytest.fixture(scope="module")
def drawn() -> Iterator[dict[str, NDArray[np.uint8]]]:
    """The forward system's framebuffers as its passes are, drawn."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("VKBLOOM_FORM", "fragment")
        with Renderer(validation=True) as renderer:
            yield dict(renderer.render(Scene.ufo(), None, (640, 360), time=0.2))


@pytest.mark.parametrize("attachments", ["all", ("final",)], ids=["all", "final"])
def test_the_forward_frame(
    formed: Renderer, drawn: dict[str, NDArray[np.uint8]], attachments: str | tuple[str, ...]
) -> None:
    frames = formed.render(Scene.ufo(), None, (640, 360), time=0.2, attachments=attachments)
    assert drawn["bloom"].max() > 100, "there is no bloom to compare"
    for name, array in frames.items():
        off = np.abs(array.astype(np.float64) - drawn[name])
        # The sampler's weights have 8 bits: nine of its samples are up to 1.5 levels off, where the
        # other forms are off by their rounding alone.
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
def test_blurs_into_other_sizes(formed: Renderer, settings: Settings) -> None:
    image = hdr_picture(150, 110, 4, "float32")
    assert_matches_reference(formed.apply(image, settings), image, settings)
    uint8 = hdr_picture(150, 110, 4, "uint8")
    alone = formed.apply(uint8, settings, attachments=("final",))["final"]
    expected = reference_apply(uint8, settings)["final"]
    limit = tolerance(np.uint8, expected, stages_of_8_bits=2)
    assert np.abs(real(alone) - expected).max() <= limit


def test_unknown_forms_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("VKBLOOM_FORM", "quick")
    with pytest.raises(ValueError, match="VKBLOOM_FORM: quick is not one of auto, fragment"):
        Renderer()
