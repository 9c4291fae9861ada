"""The temporal anti-aliasing of engines on a device: the same as the reference."""

from __future__ import annotations

import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.refusals import assert_refused, rows
from tests.variants import VARIANTS, open_variant
from vkbloom import Renderer

from .moving import Frame, moving_frame

COPY = vkbloom.Pyramid(bloom=False)
BLOOM = vkbloom.Pyramid(levels=2, threshold=0.8, tonemap="aces", format="rgba32float")
ENGINES = tuple(vkbloom.antialiasing)
#: Those for which near surfaces have small depths.
SMALL = ("godot", "o3de")

#: What takes all branches of the shaders: anti-aliasing, size, what is given.
CASES: dict[str, tuple[Any, tuple[int, int], tuple[str, ...]]] = {
    **{name: (name, (49, 71), ("motion", "depth")) for name in ENGINES},
    **{f"{name} without": (name, (23, 36), ()) for name in ENGINES},
    "bevy motion": (vkbloom.BevyAntialiasing(weight=0.3, still=2), (24, 37), ("motion",)),
    "godot depth": (vkbloom.GodotAntialiasing(frames=4, disocclusion=0), (37, 24), ("depth",)),
    "godot motion": ("godot", (24, 37), ("motion",)),
    "o3de jitter": (
        vkbloom.O3deAntialiasing(jitter=(0.3, -0.4), gamma=2, damping=1),
        (25, 38),
        ("motion",),
    ),
    "hdrp bilinear": (vkbloom.HdrpAntialiasing(history_sharpening=0), (24, 37), ("motion",)),
    "hdrp_high jitter": (
        vkbloom.HdrpAntialiasing(quality="high", jitter=(0.3, -0.4), anti_flicker=1),
        (24, 37),
        ("motion", "depth"),
    ),
    "hdrp_low soft": (
        vkbloom.HdrpAntialiasing(quality="low", sharpening=0, base_blend=0.95),
        (24, 37),
        ("motion",),
    ),
    **{f"{name} 1 x 1": (name, (1, 1), ("motion", "depth")) for name in ENGINES},
    **{f"{name} column": (name, (9, 1), ("motion", "depth")) for name in ENGINES},
}


@pytest.fixture(scope="module", params=VARIANTS)
def variant(request: pytest.FixtureRequest) -> Any:
    with open_variant(request.param) as opened:
        yield opened


def engine_of(taa: Any) -> str:
    return vkbloom.antialiasing[taa].engine if isinstance(taa, str) else str(taa.engine)


def frames_of(
    taa: Any, count: int, size: tuple[int, int] = (23, 37), channels: int = 3
) -> list[Frame]:
    nearest = float(engine_of(taa) not in SMALL)
    return [moving_frame(t, *size, nearest=nearest, channels=channels) for t in range(count)]


def share_of_close(array: NDArray[Any], wanted: NDArray[Any], limit: float = 3e-4) -> float:
    """Return the share of pixels whose error is within the limit, relative to at least 0.01."""
    values = array / 255 if array.dtype == np.uint8 else array
    error = np.abs(values - wanted) / np.maximum(np.abs(wanted), 0.01)
    return float((error.max(axis=-1) <= limit).mean())


@pytest.mark.parametrize("case", CASES)
def test_the_reference_after_20_frames(renderer: Renderer, case: str) -> None:
    """Device and reference each continue their own state."""
    taa, size, given = CASES[case]
    own: Any = {}
    other: Any = {}
    for frame in frames_of(taa, 20, size):
        keywords = {name: getattr(frame, name) for name in given}
        frames = renderer.apply(frame.image, COPY, taa=taa, state=own, **keywords)
        other = vkbloom.reference.apply(frame.image, COPY, taa=taa, state=other, **keywords)
        own = frames.state
    assert list(frames) == list(other)
    assert set(own) == {name for name in other if name.startswith("history")}
    assert not np.array_equal(frames["final"], frame.image) or size[1] == 1
    for name, wanted in other.items():
        assert frames[name].shape == wanted.shape
        assert share_of_close(frames[name], wanted) >= 0.999, name
    np.testing.assert_array_equal(frames["resolved"], frames["final"])


@pytest.mark.parametrize("name", ENGINES)
def test_variants(variant: Renderer, name: str) -> None:
    """With alpha, which stays, a mask, and an emission, which is not resolved."""
    state: Any = {}
    mask = np.linspace(0, 1, 23 * 37, dtype=np.float32).reshape(23, 37)
    for frame in frames_of(name, 3, channels=4):
        given: dict[str, Any] = {"taa": name, "mask": mask, "emission": frame.image / 2}
        given |= frame.keywords() | {"state": state}
        frames = variant.apply(frame.image, BLOOM, **given)
        wanted = vkbloom.reference.apply(frame.image, BLOOM, **given)
        for key in wanted:
            assert share_of_close(frames[key], wanted[key]) >= 0.995, key
        state = frames.state
    assert (frames["resolved"][..., 3] == 0.5).all()


@pytest.mark.parametrize("exposure", ["hdrp", "bevy", "godot", "o3de"])
@pytest.mark.parametrize("order", ["before", "after"])
def test_the_order_of_stages(renderer: Renderer, exposure: str, order: Any) -> None:
    """HDRP's exposure is before the anti-aliasing, others are after it."""
    taa = vkbloom.BevyAntialiasing(order=order)
    state: Any = {}
    for frame in frames_of(taa, 4):
        given: dict[str, Any] = {"taa": taa, "exposure": exposure, "dt": 0.1, "state": state}
        given |= frame.keywords()
        frames = renderer.apply(frame.image, BLOOM, **given)
        wanted = vkbloom.reference.apply(frame.image, BLOOM, **given)
        assert list(frames) == list(wanted)
        for key in wanted:
            if key not in ("histogram", "exposure"):
                assert share_of_close(frames[key], wanted[key]) >= 0.995, key
        np.testing.assert_allclose(frames["exposure"], wanted["exposure"], rtol=1e-4)
        state = frames.state
    names = list(frames)
    assert (names.index("exposure") < names.index("resolved")) == (
        exposure == "hdrp" or (order == "after" and exposure != "o3de")
    )
    assert (names.index("glow") < names.index("resolved")) == (order == "after")


@pytest.mark.parametrize("dtype", ["uint8", "float16"])
def test_types_of_images(renderer: Renderer, dtype: str) -> None:
    frame = frames_of("godot", 1)[0]
    levels = frame.image.clip(0, 1)
    image = (levels * 255).astype(np.uint8) if dtype == "uint8" else levels.astype(dtype)
    geometry = {"motion": frame.motion.astype(np.float16), "depth": frame.depth.astype(float)}
    for name in ENGINES:
        state: Any = {}
        for _ in range(3):
            given: dict[str, Any] = {"taa": name, "state": state, **geometry}
            frames = renderer.apply(image, COPY, **given)
            wanted = vkbloom.reference.apply(image, COPY, **given)
            assert share_of_close(frames["resolved"], wanted["resolved"]) >= 0.999
            assert frames["final"].dtype == image.dtype
            state = frames.state


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite(renderer: Renderer, value: float) -> None:
    """It counts as 0 in the history, and stays at its own pixel of that frame."""
    for name in ENGINES:
        good = frames_of(name, 3)
        bad = good[1].image.copy()
        bad[5, 7, 1] = value
        zero = np.where(np.isfinite(bad), bad, 0)
        found, wanted = (
            list(renderer.map([good[0].image, image, good[2].image], COPY, taa=name))
            for image in (bad, zero)
        )
        np.testing.assert_array_equal(found[1]["final"][5, 7, 1], value)
        assert np.isfinite(found[1]["final"]).sum() == bad.size - 1
        np.testing.assert_array_equal(found[1]["history"], wanted[1]["history"])
        np.testing.assert_array_equal(found[2]["final"], wanted[2]["final"])
        assert found[1].info["nan"] + found[1].info["inf"] == 1


def test_infinite_depths_are_not_counted(renderer: Renderer) -> None:
    frame = frames_of("godot", 1)[0]
    depth = np.full_like(frame.depth, np.inf)
    frames = renderer.apply(frame.image, COPY, taa="godot", depth=depth)
    assert frames.info["inf"] == 0


@pytest.mark.parametrize("name", ENGINES)
def test_a_sequence_that_is_cut(
    renderer: Renderer, new_renderer: Callable[[], Renderer], name: str
) -> None:
    """State is a value: another device continues it with equal bits, and so does map."""
    frames = frames_of(name, 6)
    given: dict[str, Any] = {"settings": BLOOM, "taa": name, "exposure": "hdrp", "dt": 0.1}

    def run(renderer: Renderer, first: int, state: Any) -> list[vkbloom.Frames]:
        images, motions, depths = zip(*frames[first:], strict=True)
        return list(renderer.map(images, motion=motions, depth=depths, state=state, **given))

    whole = run(renderer, 0, {})
    rest = run(new_renderer(), 3, pickle.loads(pickle.dumps(whole[2].state)))
    alone = renderer.apply(
        frames[3].image, **given, state=dict(whole[2].state), **frames[3].keywords()
    )
    assert rest[-1].state == whole[-1].state
    assert alone.state == whole[3].state
    for one, other in zip(whole[3:], rest, strict=True):
        np.testing.assert_array_equal(one["final"], other["final"])


def test_another_process_continues(renderer: Renderer, tmp_path: Path) -> None:
    script = """
import pickle, sys
import vkbloom
frames, state = pickle.load(open(sys.argv[1], "rb"))
for image, motion, depth in frames:
    state = vkbloom.apply(
        image, "bevy_natural", taa="godot", motion=motion, depth=depth, state=state
    ).state
pickle.dump(state, open(sys.argv[2], "wb"))
"""
    frames = frames_of("godot", 4)
    state: Any = {}
    states = []
    for frame in frames:
        made = renderer.apply(
            frame.image, "bevy_natural", taa="godot", state=state, **frame.keywords()
        )
        states.append(state := made.state)
    given, taken = tmp_path / "given", tmp_path / "taken"
    given.write_bytes(pickle.dumps(([tuple(frame) for frame in frames[2:]], states[1])))
    subprocess.run([sys.executable, "-c", script, given, taken], check=True)
    assert pickle.loads(taken.read_bytes()) == states[-1]


def test_without_anti_aliasing_nothing_changes(renderer: Renderer) -> None:
    image = frames_of("bevy", 1)[0].image
    frames = renderer.apply(image, BLOOM)
    assert not {"history", "resolved"} & set(frames)
    assert not frames.state
    taken = renderer.apply(image, BLOOM, taa="bevy")
    assert taken.settings == frames.settings
    assert taken.exposure == frames.exposure
    # The first frame is its own history.
    np.testing.assert_allclose(taken["final"], frames["final"], rtol=1e-5)


@pytest.mark.parametrize(("call", "error"), [*rows(__file__, "calls"), *rows(__file__, "settings")])
def test_refused(renderer: Renderer, call: str, error: str) -> None:
    frame = frames_of("bevy", 1)[0]
    names = {"vkbloom": vkbloom, "renderer": renderer, "np": np, "COPY": COPY}
    names |= {"IMAGE": frame.image, "MOTION": frame.motion, "DEPTH": frame.depth}
    assert_refused(call, error, names)
