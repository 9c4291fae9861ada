"""The temporal anti-aliasing of engines in NumPy, against values derived by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom

COPY = vkbloom.Pyramid(bloom=False)
ENGINES = tuple(vkbloom.antialiasing)
SIZE = (6, 8)


def flat(light: float) -> NDArray[np.float64]:
    return np.full((*SIZE, 3), light)


def steps(light: float) -> NDArray[np.float64]:
    """Return grey columns of `light` and 0 in turns."""
    image = np.zeros((*SIZE, 3))
    image[:, ::2] = light
    return image


def resolve(
    taa: Any, *images: NDArray[np.float64], state: Any = None, **given: Any
) -> dict[str, NDArray[np.float64]]:
    for image in images:
        state = vkbloom.reference.apply(image, COPY, taa=taa, state=state, **given)
    return dict(state)


def centre(state: dict[str, NDArray[np.float64]], name: str = "final") -> Any:
    return state[name][3, 4]


@pytest.mark.parametrize("name", ENGINES)
def test_a_flat_picture_stays(name: str) -> None:
    state = resolve(name, *[flat(0.5)] * 4)
    # O3DE's border is darkened by what is outside.
    inside = state["final"][2:-2, 2:-2]
    np.testing.assert_allclose(inside, 0.5, rtol=1e-12)


@pytest.mark.parametrize("name", ENGINES)
def test_the_first_frame(name: str) -> None:
    """Bevy and Godot show the first picture; O3DE mixes it with black."""
    image = np.random.default_rng(0).random((*SIZE, 3))
    state = resolve(name, image)
    if name in ("bevy", "godot"):
        np.testing.assert_allclose(state["final"], image, rtol=1e-12)
    assert np.isfinite(state["final"]).all()


def test_bevy_by_hand() -> None:
    """Grey 1 is followed by columns of 1 and 0: the history is the box's nearest point."""
    state = resolve("bevy", flat(1.0), steps(1.0))
    # T(1) = 1/2. Of three columns around the pixel one is bright: mean 1/6, variance 1/12 - 1/36.
    mean, deviation = 1 / 6, math.sqrt(1 / 12 - 1 / 36)
    history = min(0.5, mean + deviation + 1e-8)
    confidence = 1 / 0.015 + 10
    weight = max(1 / confidence, 0.015)
    kept = history * (1 - weight) + 0.5 * weight
    np.testing.assert_allclose(centre(state, "history"), [kept] * 3 + [confidence], rtol=1e-12)
    np.testing.assert_allclose(centre(state), kept / (1 - kept), rtol=1e-12)
    moved = resolve("bevy", flat(1.0), steps(1.0), motion=np.full((*SIZE, 2), 0.01))
    # Now the confidence is 1, and the weight 0.1.
    kept = history * 0.9 + 0.5 * 0.1
    np.testing.assert_allclose(centre(moved, "history"), [kept] * 3 + [1], rtol=1e-12)


def test_godot_by_hand() -> None:
    state = resolve("godot", flat(1.0), flat(3.0))
    # R(1) = 0.5 is pulled to 0.75, the mean of a box without extent; now and history are alike.
    np.testing.assert_allclose(centre(state, "history"), [3, 3, 3, 1], rtol=1e-12)
    state = resolve("godot", steps(1.0), steps(1.0)[:, ::-1])
    # Of three columns one is dark, with R = 0, the others have 0.5: weights 1 and 1 / 1.5.
    bright = 2 / 3 * 2
    mean = bright * 0.5 / (bright + 1)
    extent = math.sqrt(bright * 0.25 / (bright + 1) - mean**2)
    now, history = 0.0, min(0.5, mean + extent)
    assert centre(resolve("godot", steps(1.0)))[0] == 1
    alike = (1 - (history - 1e-4) / 1.001) ** 2
    weight = alike / (0 + 1)
    mixed = history * (1 - weight) + now * weight
    np.testing.assert_allclose(centre(state)[:3], mixed / (1 - mixed), rtol=1e-12)
    assert resolve("godot", *[flat(1.0)] * 30)["history"][3, 4, 3] == 16


def test_o3de_by_hand() -> None:
    taa = vkbloom.O3deAntialiasing(jitter=(0, 0))
    state = resolve(taa, steps(1.0))
    # Black history: pulled to mean - deviation, of one bright column in three.
    mean, deviation = 1 / 3, math.sqrt(1 / 3 - 1 / 9)
    history = max(0.0, mean - deviation)
    side = math.exp(-2.29)
    now = 1 / (1 + 2 * side)
    share = min(1.0, 0.5 * deviation / abs(history - now))
    weight = 0.1 * share**2
    np.testing.assert_allclose(centre(state), history * (1 - weight) + now * weight, rtol=1e-12)
    # The engine's own offset of the first frame is (1/2, 1/3) - 1/2, up: no part along x.
    own = np.array(vkbloom.O3deAntialiasing().filter_weights()[0]).reshape(3, 3)
    np.testing.assert_allclose(own[:, 0], own[:, 2])
    # Its y points upwards: 1/3 - 1/2 is down, and the weight of the row below is larger.
    assert vkbloom.O3deAntialiasing().offset(0) == pytest.approx((0, 1 / 6))
    np.testing.assert_allclose(
        own[2, 1] / own[0, 1], math.exp(-2.29 * ((1 + 1 / 3) ** 2 - (1 - 1 / 3) ** 2))
    )


def test_hdrp_by_hand() -> None:
    """Grey: Y / (1 + Y) decides, and the chromas have the bias only."""
    taa = vkbloom.HdrpAntialiasing(sharpening=0)
    state = resolve(taa, flat(1.0), flat(3.0))
    # The box has no extent: the history is this frame.
    np.testing.assert_allclose(centre(state), 3, rtol=1e-12)
    # One bright column in a plus of five: 3 of 5 texels have Y / (1 + Y) = 1 / 2.
    state = resolve(vkbloom.HdrpAntialiasing(quality="low", sharpening=0), flat(2.0), steps(1.0))
    # History 2 is clamped to 1, and its luminance is that before the clamp.
    weight = max(0.03, 0.125 / (1 + 1 / 2))
    mixed = 0.5 * (1 - weight) + 0.5 * weight
    np.testing.assert_allclose(centre(state), mixed / (1 - mixed), rtol=1e-6)
    sharp = resolve(vkbloom.HdrpAntialiasing(quality="low"), flat(1.0), steps(1.0))
    # Now 1 + 1.5 (1 - mean of 1, 1, 0, 0) = 1.75, T = 1.75 / 2.75; contrast 1 over 1.
    weight = 0.125 / 2
    mixed = 0.5 * (1 - weight) + 1.75 / 2.75 * weight
    np.testing.assert_allclose(centre(sharp), mixed / (1 - mixed), rtol=1e-6)


#: Whose boxes and weights do not depend on the length of the motion.
STEADY: dict[str, Any] = {
    "bevy": vkbloom.BevyAntialiasing(still=64),
    "godot": vkbloom.GodotAntialiasing(moving_box=1),
    "o3de": vkbloom.O3deAntialiasing(),
    "hdrp": vkbloom.HdrpAntialiasing(),
    "hdrp_low": vkbloom.HdrpAntialiasing(quality="low"),
    "hdrp_high": vkbloom.HdrpAntialiasing(quality="high", anti_flicker=0),
}


@pytest.mark.parametrize("name", STEADY)
def test_motion_says_where_light_was(name: str) -> None:
    """A picture that moves by whole pixels has the history of its own pixels."""
    taa = STEADY[name]
    image = np.random.default_rng(1).random((24, 32, 3)) + 0.5
    motion = np.broadcast_to([3 / 32, -2 / 24], (24, 32, 2))
    moving: Any = None
    still: Any = None
    for number in range(4):
        shown = np.roll(image, (-2 * number, 3 * number), axis=(0, 1))
        if number == 0 and taa.engine == "hdrp":
            # Its first picture is its own history.
            moving = vkbloom.reference.apply(shown, COPY, taa=taa)
        else:
            moving = vkbloom.reference.apply(shown, COPY, taa=taa, motion=motion, state=moving)
        still = vkbloom.reference.apply(image, COPY, taa=taa, state=still)
    moved = np.roll(moving["final"], (6, -9), axis=(0, 1))
    inside = np.s_[11:14, 4:16]
    np.testing.assert_allclose(moved[inside], still["final"][inside], rtol=1e-6)


def test_the_nearest_surface_moves_its_edge() -> None:
    """The motion of a pixel is that of the nearest one around it, by each engine's quirk."""
    size = (9, 12)
    image = np.random.default_rng(2).random((*size, 3))
    for name, near, offset in (
        ("bevy", 1.0, (2, 2)),
        ("o3de", 0.0, (1, 1)),
        ("hdrp", 1.0, (1, 1)),
        ("godot", 0.0, (1, 1)),
    ):
        depth = np.full(size, 0.5)
        motion = np.zeros((*size, 2))
        depth[4, 6] = near
        # Godot reads the motion one pixel to the upper left.
        quirk = 1 if name == "godot" else 0
        motion[4 - quirk, 6 - quirk] = 9.0
        state = resolve(name, image, image)
        changed = vkbloom.reference.apply(
            image, COPY, taa=name, motion=motion, depth=depth, state=state
        )
        same = vkbloom.reference.apply(image, COPY, taa=name, depth=depth, state=state)
        touched = (changed["history"] != same["history"]).any(axis=-1)
        y, x = 4 - offset[1], 6 - offset[0]
        assert touched[y, x], name
        assert not touched[y - 1, x - 1], name


@pytest.mark.parametrize("name", ENGINES)
def test_jitter_is_that_of_the_engine(name: str) -> None:
    taa = vkbloom.antialiasing[name]
    offsets = [taa.offset(frame) for frame in range(2 * taa.phases)]
    assert offsets[: taa.phases] == offsets[taa.phases :]
    assert offsets[0] == pytest.approx((0.0, (1 / 6 if name == "o3de" else -1 / 6)))
    assert len(set(offsets)) == taa.phases == (16 if name == "godot" else 8)
    assert all(abs(number) <= 0.5 for offset in offsets for number in offset)
    # The number of the frame is in the history.
    if taa.filter_weights():
        fixed = type(taa).from_dict({**taa.to_dict(), "jitter": offsets[1]})
        image = np.random.default_rng(3).random((*SIZE, 3))
        first = vkbloom.reference.apply(image, COPY, taa=name)
        one, other = (
            vkbloom.reference.apply(image, COPY, taa=taa, state=first) for taa in (taa, fixed)
        )
        np.testing.assert_allclose(one["final"], other["final"])
        assert taa == type(taa).from_dict(taa.to_dict())
