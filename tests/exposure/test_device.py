"""The exposures of engines on a device: the same as the reference, from call to call."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.refusals import assert_refused, rows
from tests.variants import VARIANTS, open_variant
from vkbloom import Renderer

from .sequences import MODEL_ERRORS, Sequence, read_sequences

SEQUENCES = read_sequences()
COPY = vkbloom.Pyramid(bloom=False)
MASK = np.linspace(0, 1, 35, dtype=np.float32).reshape(5, 7)
POINTS = ((-6, -2), (-1, 0), (2, 0.5), (6, 2.5))

#: Exposures that, beside the presets, take all branches of the shaders.
EXPOSURES: dict[str, Any] = {
    **vkbloom.exposures,
    "ev100": vkbloom.FixedExposure(value=1.5, unit="ev100"),
    "keyframed": vkbloom.KeyframedExposure(keys=((0.1, 1), (0.25, -2), (0.3, 0))),
    "bevy_mask": vkbloom.BevyExposure(mask=MASK, compensation=POINTS, range_min=-6),
    "spot": vkbloom.HdrpExposure(metering="spot", limit_min=-8),
    "average": vkbloom.HdrpExposure(metering="average", percent_max=100, compensation=0.5),
    "mask": vkbloom.HdrpExposure(metering="mask", mask=MASK, grey=18),
    "procedural": vkbloom.HdrpExposure(
        metering="procedural", centre_x=0.3, radius_x=0.8, radius_y=0.5, mask_min=-3, mask_max=7
    ),
    "automatic_mask": vkbloom.HdrpExposure(mode="automatic", metering="mask", mask=MASK),
    "ppv2_open": vkbloom.PostProcessingExposure(minimum=-9, maximum=9, key_value=0.5),
}
#: What an exposure meets on its way: published thresholds, glare, curves, 8 bits, alpha.
# Their buffers are single floats, so that the exposures may be compared closely.
BLOOMS: dict[str, Any] = {
    "pyramid": vkbloom.Pyramid(levels=2, threshold=0.8, tonemap="aces", exposure=0.5),
    "screen": vkbloom.Separable(threshold=0.5, composite="screen", bloom_scale=0.5),
    "mix": vkbloom.Pyramid(levels=2, composite="mix", intensity=0.3, tonemap="reinhard"),
    "glare": vkbloom.KinoBloom(
        threshold=1, glare=(vkbloom.Streaks(iterations=2, halvings=1),), format="rgba32float"
    ),
    "alpha": vkbloom.Pyramid(levels=2, alpha="blur", encoding="srgb"),
    "none": COPY.replace(exposure=-1.0),
}


def picture(seed: int = 0, height: int = 23, width: int = 37, channels: int = 3) -> NDArray[Any]:
    """Return light of 12 stops."""
    random = np.random.default_rng(seed)
    return (2 ** random.uniform(-8, 4, (height, width, channels))).astype(np.float32)


@pytest.fixture(scope="module", params=VARIANTS)
def variant(request: pytest.FixtureRequest) -> Any:
    with open_variant(request.param) as opened:
        yield opened


def compare(frames: vkbloom.Frames, expected: dict[str, NDArray[np.float64]]) -> None:
    assert list(frames) == list(expected)
    for name, array in frames.items():
        wanted = expected[name]
        assert array.shape == wanted.shape, name
        if array.dtype == np.uint8:
            assert np.abs(array / 255 - np.clip(wanted, 0, 1)).max() <= 2 / 255, name
            continue
        scale = np.abs(wanted[np.isfinite(wanted)]).max(initial=1e-6)
        error = {"float32": 1e-4, "float16": 2e-3}[array.dtype.name]
        if name == "histogram":  # Light at the edge of a bin may be in the other one.
            error = 4096 / scale
        np.testing.assert_allclose(array, wanted, rtol=0, atol=error * scale, err_msg=name)


def follow(
    renderer: Renderer,
    images: list[Any],
    settings: Any,
    exposure: Any,
    dt: float = 0.1,
    **given: Any,
) -> vkbloom.Frames:
    """Compare each call with the reference, which continues from the device's state."""
    frames: vkbloom.Frames | None = None
    state: Any = {}
    for image in images:
        frames = renderer.apply(image, settings, exposure=exposure, dt=dt, state=state, **given)
        expected = vkbloom.reference.apply(
            image, settings, exposure=exposure, dt=dt, state=state, **given
        )
        compare(frames, expected)
        state = frames.state
    assert frames is not None
    return frames


@pytest.mark.skipif(not SEQUENCES, reason="the engines' sequences (../shared/data) are not here")
@pytest.mark.parametrize("sequence", SEQUENCES, ids=lambda sequence: sequence.key)
def test_the_engines_sequences(renderer: Renderer, sequence: Sequence) -> None:
    state: Any = {}
    values, bins = [], []
    for frame, dt in sequence.frames():
        frames = renderer.apply(frame, COPY, exposure=sequence.exposure, dt=dt, state=state)
        state = frames.state
        values.append(frames["exposure"][0, 0, 0])
        bins.append(frames["histogram"][0, :, 0] if "histogram" in frames else None)

    found = sequence.deviation(np.array(values, np.float64))
    assert found <= 2 * MODEL_ERRORS[sequence.engine]
    if sequence.histogram is not None:
        np.testing.assert_array_equal(bins, sequence.histogram)


@pytest.mark.parametrize("name", EXPOSURES)
def test_the_reference(renderer: Renderer, name: str) -> None:
    frames = follow(renderer, [picture(0), picture(1) * 4], BLOOMS["mix"], EXPOSURES[name])
    before, after = frames["exposure"][0, 0, 1:3]
    assert frames.exposure == pytest.approx(np.log2(before) + np.log2(after))


@pytest.mark.parametrize("bloom", BLOOMS)
@pytest.mark.parametrize("name", ["hdrp", "bevy", "o3de", "granite"])
def test_all_kinds_of_bloom(variant: Renderer, name: str, bloom: str) -> None:
    images = [picture(seed, channels=4) for seed in range(2)]
    for image in images:
        image[..., 3] = 0.5
    follow(variant, images, BLOOMS[bloom], name)


@pytest.mark.parametrize("name", ["godot", "o3de", "granite"])
def test_mask_and_emission(renderer: Renderer, name: str) -> None:
    image, weights = picture(), np.linspace(0, 1, 23 * 37).reshape(23, 37).astype(np.float32)
    follow(renderer, [image, image], BLOOMS["mix"], name, mask=weights)
    follow(renderer, [image, image], BLOOMS["pyramid"], name, emission=picture(1))


@pytest.mark.parametrize("dtype", ["uint8", "float16"])
def test_other_types_of_images(renderer: Renderer, dtype: str) -> None:
    levels = picture().clip(0, 1)
    settings = BLOOMS["pyramid"].replace(levels=1, format="rgba32float")
    image = (levels * 255).astype(np.uint8) if dtype == "uint8" else levels.astype(dtype)
    for name in ("ppv2_open", "bevy"):
        follow(renderer, [image, image], settings, EXPOSURES[name])


@pytest.mark.parametrize(
    ("size", "dt"), [((1, 1), 0.0), ((1, 9), 1 / 240), ((65, 3), 3.0), ((130, 70), 1.0)]
)
def test_any_size_and_step(renderer: Renderer, size: tuple[int, int], dt: float) -> None:
    for name, exposure in vkbloom.exposures.items():
        images = [picture(seed, *size) for seed in range(2)]
        frames = follow(renderer, images, COPY, exposure, dt)
        again = renderer.apply(images[1], COPY, exposure=name, dt=0, state=frames.state)
        assert again["exposure"][0, 0, 0] == frames["exposure"][0, 0, 0]


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf, -np.inf, -1.0])
@pytest.mark.parametrize("where", ["everywhere", "in one pixel"])
def test_black_and_what_is_not_finite(renderer: Renderer, value: float, where: str) -> None:
    for name in vkbloom.exposures:
        good, bad = picture(), picture()
        bad[... if where == "everywhere" else (2, 4)] = value
        state: Any = {}
        for image in (good, bad, bad, good):
            before = state
            frames = renderer.apply(image, COPY, exposure=name, dt=0.5, state=before)
            wanted = vkbloom.reference.expose(image, name, dt=0.5, state=before)["exposure"]
            np.testing.assert_allclose(frames["exposure"], wanted, rtol=1e-4, atol=1e-5)
            state = frames.state


def test_counts_beyond_single_floats(renderer: Renderer) -> None:
    """A bin of 2^24 and more has the nearest float to its integer."""
    image = np.full((290, 410, 3), 0.18, np.float32)
    counted = renderer.apply(image, COPY, exposure="hdrp")["histogram"]
    wanted = vkbloom.reference.expose(image, "hdrp")["histogram"]
    assert wanted.max() > 2**24
    np.testing.assert_array_equal(counted, wanted.astype(np.float32))


def test_a_sequence_that_is_cut(renderer: Renderer, new_renderer: Callable[[], Renderer]) -> None:
    """State is a value: another device continues it with equal bits, and so does map."""
    images = [picture(seed) for seed in range(4)]
    for name in ("bevy", "hdrp", "granite"):
        whole = list(renderer.map(images, BLOOMS["mix"], exposure=name, dt=0.1))
        state = pickle.loads(pickle.dumps(whole[1].state))
        other_renderer = new_renderer()
        rest = list(
            other_renderer.map(images[2:], BLOOMS["mix"], exposure=name, dt=0.1, state=state)
        )
        assert rest[-1].state == whole[-1].state
        for one, other in zip(whole[2:], rest, strict=True):
            np.testing.assert_array_equal(one["final"], other["final"])
            assert one.exposure == other.exposure
        given = {"exposure": np.array([[[1.0, 1, 1, 1]]], np.float32)}
        set_by_user = renderer.apply(images[0], COPY, exposure=name, dt=0, state=given)
        assert set_by_user["exposure"][0, 0, 0] == 1


def test_without_an_exposure_nothing_changes(renderer: Renderer) -> None:
    frames = renderer.apply(picture(), BLOOMS["pyramid"])
    assert not {"exposure", "exposed", "histogram"} & set(frames)
    assert not frames.state
    assert frames.exposure == 0.5
    assert frames.settings is BLOOMS["pyramid"]
    assert renderer.apply(picture(), BLOOMS["pyramid"], exposure="bevy").settings == frames.settings


def test_apply_takes_stops_or_an_exposure(renderer: Renderer) -> None:
    one = vkbloom.apply(picture(), COPY, exposure=2, renderer=renderer)
    other = vkbloom.apply(
        picture(), COPY, exposure=vkbloom.FixedExposure(value=2), renderer=renderer
    )
    assert one.exposure == other.exposure == 2
    np.testing.assert_allclose(one["final"], other["final"], rtol=1e-6)


@pytest.mark.parametrize(("call", "error"), rows(__file__, "calls"))
def test_refused(renderer: Renderer, call: str, error: str) -> None:
    names = {"vkbloom": vkbloom, "renderer": renderer, "IMAGE": picture(), "np": np}
    assert_refused(call, error, names)
