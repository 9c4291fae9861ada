"""Laws of an exposure: how it follows the light in time, and what it meters."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom.testing._adaptation import Adaptation, Frame, UnsettledError
from vkbloom.testing._deviations import Measured, figure, judge
from vkbloom.testing._laws.law import Figure, Law, Limits
from vkbloom.testing._laws.time import halton
from vkbloom.testing._probe import NotTaken

__tracebackhide__ = True

# 0.01 stops are 0.7 % of the light, less than a level of 8 bits at white (0.9 %): nobody sees it.
# What engines do without a fault is below: weights at whole pixels, means of 128 bins. And the
# smallest fault that is known, Godot's steps of time, is twice as large.
_SEEN: Final = 0.01
# A pixel of a small image is many of a large one: what leaves out tiles of 1/1024 of an image with
# NaN leaves out four.
_TILES: Final = 0.02
# Half of the light is a stop; bins of histograms can be 18 / 128 stops wide.
_HALF_OF_THE_LIGHT: Final = 1.1
# Weights towards the centre move by a row.
_ROWS: Final = 0.1
# Neither half a stop nor its bins make the time to half of the distance uncertain by more.
_SLOWER: Final = 1.1

# Four stops that the limits of engines have room for: 1/16 of it is metered by all but HDRP, whose
# darkest light is 1/16; Godot's brightest mean is 1.
_DARK, _BRIGHT = 0.045, 0.72
_MIDDLE: Final = 0.4
_RATES: Final = (10, 60, 240)
_STEPS: Final = (1 / 30, 0.1, 0.3, 0.45, 0.75, 1.0, 3.0)
_FRAMES_OF_A_STEP: Final = 6
_STOPS: Final = (-1.0, -0.65, -0.3, 0.2, 0.55, 1.0)
_SPEED_STOPS: Final = 0.5
_SPEED_STEP: Final = 1 / 30
_LONGEST: Final = 10.0
_SEED: Final = 70


def grains(size: tuple[int, int], mean: float) -> Frame:
    """Return noise of two stops, whose light is spread over bins and places alike.

    Even and odd rows are the same.
    """
    light = 2.0 ** np.random.default_rng(_SEED).uniform(-1, 1, (-(-size[1] // 2), size[0], 1))
    light = light.repeat(2, axis=0)[: size[1]]
    return np.repeat(light * (mean / light.mean()), 3, axis=2).astype(np.float32)


def _four_stops(subject: Adaptation) -> tuple[Frame, Frame]:
    """Return a dark and a bright image; raise NotTaken if both get the same exposure."""
    dark, bright = (grains(subject.size, mean) for mean in (_DARK, _BRIGHT))
    _check_follows(*(subject.settle(frame).stops for frame in (dark, bright)))
    return dark, bright


def _test_frame_rate(subject: Adaptation, limits: Limits) -> None:
    """Let the light rise and fall by four stops, and wait a second at 10, 60 and 240 Hz."""
    dark, bright = _four_stops(subject)
    measured: list[Measured] = []
    for name, before, after in (("up", dark, bright), ("down", bright, dark)):
        stops = []
        rates = _RATES if name == "up" else _RATES[:2]
        for rate in rates:
            start = subject.settle(before)
            stops.append(subject.run(after, 1 / rate, rate, start.state).stops)
        words = ", ".join(f"{one:.3f} at {rate} Hz" for rate, one in zip(rates, stops, strict=True))
        measured.append(
            (name, _range(stops), limits[name], f"a second after the light went {name}: {words}")
        )
    judge("the exposure after a second does not depend on the frames in it", *measured)


FRAME_RATE: Final = Law(
    name="frame_rate",
    subject=Adaptation,
    test=_test_frame_rate,
    formula="a second after the light has changed by four stops, the exposure is the same at 10, "
    "60 and 240 frames per second",
    figures={
        "up": Figure("largest - smallest exposure after more light, in stops", _SEEN),
        "down": Figure("the same after less light, at 10 and 60 frames per second", _SEEN),
    },
    why="Steps of a share `speed * dt` of the distance are not exponential: those of fewer frames "
    "are larger. `1 - exp(-speed * dt)` is exact.",
)


def _test_no_overshoot(subject: Adaptation, limits: Limits) -> None:
    """Let the light change by four stops, and show six frames with steps of up to 3 seconds."""
    dark, bright = _four_stops(subject)
    beyond: dict[float, float] = {}
    for before, after in ((dark, bright), (bright, dark)):
        goal = subject.settle(after).stops
        for dt in _STEPS:
            now = subject.settle(before)
            sign = math.copysign(1.0, goal - now.stops)
            for _ in range(_FRAMES_OF_A_STEP):
                now = subject.run(after, dt, 1, now.state)
                off = sign * (now.stops - goal)
                # What is not finite is beyond any goal.
                beyond[dt] = max(beyond.get(dt, 0.0), off if math.isfinite(off) else math.inf)
    first = min((dt for dt in _STEPS if not beyond[dt] <= limits["beyond"]), default=math.inf)
    figure("from_dt", first)
    most = max(beyond.values())
    text = f"the exposure goes beyond its goal by {most:.3g} stops, from steps of {first:.3g} s on"
    judge("the exposure does not go beyond its goal", ("beyond", most, limits["beyond"], text))


NO_OVERSHOOT: Final = Law(
    name="no_overshoot",
    subject=Adaptation,
    test=_test_no_overshoot,
    formula="the exposure does not go beyond its goal, whatever the time from frame to frame, up "
    "to 3 seconds",
    figures={
        "beyond": Figure("how far it goes beyond, in stops", _SEEN),
        "from_dt": Figure("the shortest step that does, in seconds"),
    },
    why="A share `speed * dt` of the distance is more than all of it after a long frame, as one in "
    "which a level is loaded.",
)


def _test_still(subject: Adaptation, limits: Limits) -> None:
    """Show frames of four stops more and less light, no time after the one before."""
    dark, bright = _four_stops(subject)
    most = 0.0
    for before, after in ((dark, bright), (bright, dark)):
        start = subject.settle(before)
        state = start.state
        for _ in range(3):
            state = subject.step(after, 0.0, state).state
        off = abs(subject.read(before, state) - start.stops)
        most = max(most, off if math.isfinite(off) else math.inf)
    text = f"three frames in no time change the exposure by {most:.3g} stops"
    judge("in no time nothing changes", ("changes", most, limits["changes"], text))


STILL: Final = Law(
    name="still",
    subject=Adaptation,
    test=_test_still,
    formula="a frame that follows in no time (dt = 0), as in a paused game, changes nothing",
    figures={"changes": Figure("change of the exposure after three such frames, in stops", _SEEN)},
    why="An exposure that moves by a share of the distance in each frame knows no time.",
)


def _test_monotone(subject: Adaptation, limits: Limits) -> None:
    """Make half of the pixels brighter, from black on; then a lamp; look at each goal."""
    light = grains(subject.size, _MIDDLE)
    is_dark = np.random.default_rng(_SEED + 1).random(light.shape[:2]) < 0.5
    height, width = light.shape[:2]
    lamp = np.zeros((height, width), bool)
    lamp[height // 3 : height // 2, width // 3 : width // 2] = True
    series: dict[str, list[Frame]] = {
        "shadows": [np.where(is_dark[..., np.newaxis], light * share, light) for share in _SHARES],
        "lamp": [np.where(lamp[..., np.newaxis], light * gain, light) for gain in (1, 4, 16, 64)],
    }
    measured: list[Measured] = []
    for name, frames in series.items():
        goals = [subject.settle(frame.astype(np.float32)).stops for frame in frames]
        least, rise = math.inf, 0.0
        for goal in goals:
            rise, least = max(rise, goal - least), min(goal, least)
        text = f"more light in {name} raises the exposure by {rise:.3g} stops"
        measured.append((name, rise, limits[name], text))
    judge("more light never gets more exposure", *measured)


#: What half of the pixels have of their light, from black on.
_SHARES: Final = (0.0, 2.0**-10, 2.0**-8, 2.0**-6.5, 2.0**-5, 2.0**-3, 0.5, 1.0)

MONOTONE: Final = Law(
    name="monotone",
    subject=Adaptation,
    test=_test_monotone,
    formula="an image with more light, in the shadows or in a lamp, never gets more exposure",
    figures={
        "shadows": Figure("rise of the goal as half of the pixels become lit, in stops", _SEEN),
        "lamp": Figure("the same as a lamp becomes brighter", _SEEN),
    },
    why="A mean that leaves black pixels out becomes darker when these pixels are lit a little.",
)


def _test_speeds(subject: Adaptation, limits: Limits) -> None:
    """Measure the time to half of the distance, half a stop up and down."""
    law = (
        "the exposure comes to its goal, and to a brighter scene's no later than to a darker one's"
    )
    low, high = (
        grains(subject.size, _MIDDLE * 2.0**stops)
        for stops in (-_SPEED_STOPS / 2, _SPEED_STOPS / 2)
    )
    try:
        goals = [subject.settle(frame).stops for frame in (low, high)]
    except UnsettledError as error:
        raise AssertionError(f"{error}\n  law: {law}") from None
    _check_follows(*goals)
    up, down = (_half_time(subject, before, after) for before, after in ((low, high), (high, low)))
    figure("up", up)
    figure("down", down)
    ratio = math.inf if math.isinf(max(up, down)) else up / max(down, 1e-9)
    text = f"half of the way takes {up:.3g} s to a brighter scene, {down:.3g} s to a darker one"
    judge(law, ("slower", ratio, limits["slower"], text))


def _half_time(subject: Adaptation, before: Frame, after: Frame) -> float:
    """Return the seconds in which half of the distance in stops passes; infinity: too many."""
    goal, now = subject.settle(after).stops, subject.settle(before)
    distance, left = goal - now.stops, 1.0
    for count in range(1, round(_LONGEST / _SPEED_STEP) + 1):
        now = subject.run(after, _SPEED_STEP, 1, now.state)
        last, left = left, (goal - now.stops) / distance
        if left <= 0.5:
            return _SPEED_STEP * (count - (0.5 - left) / (last - left))
    return math.inf


SPEEDS: Final = Law(
    name="speeds",
    subject=Adaptation,
    test=_test_speeds,
    formula="the exposure of an image that stays comes to its goal, and to a scene that is half a "
    "stop brighter no later than to a darker one, as in an eye",
    figures={
        "up": Figure("seconds to half of the way to a scene that is half a stop brighter"),
        "down": Figure("the same to a darker one"),
        "slower": Figure("the first divided by the second", _SLOWER),
    },
    why="Two speeds may be the other way round on purpose. A multiplier that moves by steps of its "
    "own, and not of stops, is slower in brighter scenes.",
)


def _check_follows(*goals: float) -> None:
    """Raise NotTaken if the exposure does not depend on the light."""
    if all(math.isfinite(goal) for goal in goals) and _range(goals) <= _SEEN:
        raise NotTaken("the exposure does not follow the light")


def _range(values: Sequence[float]) -> float:
    if not all(math.isfinite(value) for value in values):
        return math.inf
    return max(values) - min(values)


def _test_scale(subject: Adaptation, limits: Limits) -> None:
    """Compare the goals of one image at lights from half to twice as much."""
    goals = [subject.settle(grains(subject.size, _MIDDLE * 2.0**k)).stops for k in _STOPS]
    _check_follows(*goals)
    off = _range([goal + k for goal, k in zip(goals, _STOPS, strict=True)])
    text = f"the goals of an image at {_STOPS[0]:g} to {_STOPS[-1]:g} stops are off by {off:.3g}"
    judge("light times 2^k moves the goal by -k stops", ("off", off, limits["off"], text))


SCALE: Final = Law(
    name="scale",
    subject=Adaptation,
    test=_test_scale,
    formula="light times 2^k moves the goal by -k stops",
    figures={"off": Figure("largest - smallest goal plus k, k of -1 to 1, in stops", _SEEN)},
    why="Limits of the exposure; a curve of compensation. Bins of histograms, if they are wide or "
    "are stored and read by different steps.",
)


def _test_mirror(subject: Adaptation, limits: Limits) -> None:
    """Mirror an image with a lamp near its right edge, and one near its lower edge."""
    light = grains(subject.size, 0.1)
    height, width = light.shape[:2]
    across, down = light.copy(), light.copy()
    across[height * 3 // 8 : height * 5 // 8, width * 3 // 4 : width * 15 // 16] = 8.0
    down[height * 3 // 4 : height * 15 // 16, width * 3 // 8 : width * 5 // 8] = 8.0
    measured: list[Measured] = []
    for name, frame, words in (
        ("across", across, "left and right change places"),
        ("down", down, "top and bottom change places"),
    ):
        mirrored = frame[:, ::-1] if name == "across" else frame[::-1]
        goals = [subject.settle(np.ascontiguousarray(one)).stops for one in (frame, mirrored)]
        off = _range(goals)
        text = f"the goal changes by {off:.3g} stops if {words}"
        measured.append((name, off, limits[name], text))
    judge("a mirrored image gets the same exposure", *measured)


MIRROR: Final = Law(
    name="mirror",
    subject=Adaptation,
    test=_test_mirror,
    formula="a mirrored image gets the same exposure",
    figures={
        "across": Figure("change of the goal as left and right change places, in stops", _SEEN),
        "down": Figure("the same of top and bottom", _SEEN),
    },
    why="A mask, or weights towards a point that is not the centre, as of a face. Blocks that "
    "leave a border out.",
)


def _test_dark_pixels(subject: Adaptation, limits: Limits) -> None:
    """Make every second row black: the even ones, then the odd ones."""
    light = grains(subject.size, _MIDDLE)
    whole = subject.settle(light).stops
    _check_follows(whole, subject.settle(grains(subject.size, _MIDDLE / 2)).stops)
    rises = []
    for first in (0, 1):
        frame = light.copy()
        frame[first::2] = 0
        rises.append(subject.settle(frame).stops - whole)
    rise, rows = max(rises) if _range(rises) < math.inf else math.inf, _range(rises)
    judge(
        "every second row that is black counts as half of the light",
        ("rise", rise, limits["rise"], f"black rows raise the goal by {rise:.3g} stops"),
        ("rows", rows, limits["rows"], f"even and odd rows differ by {rows:.3g} stops"),
    )


DARK_PIXELS: Final = Law(
    name="dark_pixels",
    subject=Adaptation,
    test=_test_dark_pixels,
    formula="every second row that is black raises the goal by a stop at most, since half of the "
    "light is left, and whether they are even or odd does not matter",
    figures={
        "rise": Figure("rise of the goal, in stops", _HALF_OF_THE_LIGHT),
        "rows": Figure("difference of even and odd rows, in stops", _ROWS),
    },
    why="A meter that reads every second row sees all of it or nothing; a mean of logarithms "
    "counts black as the light that it adds to it.",
)


def _test_finite_state(subject: Adaptation, limits: Limits) -> None:
    """Show an image with one pixel of NaN, and a black one first of all."""
    light = grains(subject.size, _MIDDLE)
    bad = light.copy()
    # Of even coordinates, so that those who read each second pixel read it.
    bad[light.shape[0] // 4 * 2, light.shape[1] // 4 * 2] = np.nan
    goal = subject.settle(light).stops
    black = subject.step(np.zeros_like(light), 1 / 60, None).state
    dark = subject.read(light, black)
    nan = _range([goal, subject.settle(bad).stops])
    after = _range([goal, subject.run(light, 0.25, 60, subject.settle(bad).state).stops])
    judge(
        "neither NaN nor black makes the exposure infinite",
        ("nan", nan, limits["nan"], f"one pixel of NaN moves the goal by {nan:.3g} stops"),
        ("stays", after, limits["stays"], f"{after:.3g} stops stay of NaN after 15 seconds"),
        ("black", abs(dark), limits["black"], f"black gets an exposure of {dark:.3g} stops"),
    )


FINITE_STATE: Final = Law(
    name="finite_state",
    subject=Adaptation,
    test=_test_finite_state,
    formula="one pixel of NaN does not move the goal, and black has a finite exposure",
    figures={
        "nan": Figure("change of the goal by one pixel of NaN, in stops", _TILES),
        "stays": Figure("what stays of it 15 seconds later, in stops", _SEEN),
        "black": Figure("exposure after a black image, in stops, either way", 128.0),
    },
    why="A mean with NaN is NaN, and what stands for it is another goal. The multiplier of a mean "
    "of 0 is infinite, unless the mean has a lower limit.",
)


def _test_shimmer(subject: Adaptation, limits: Limits) -> None:
    """Show lights of half a pixel to a camera that jitters, and measure the light beside them.

    The frames are not smoothed: a light is in a pixel whose centre it covers, or in none.
    """
    if not subject.gives_pictures:
        raise NotTaken("it returns stops, and no pictures")
    width, height = subject.size
    if min(width, height) < _MIN_SIDE:
        raise ValueError(f"images of {width} x {height} are too small for the lights; use 96 x 64")
    frames = [_draw_lights(subject.size, x, y) for x, y in halton(_PHASES)]
    is_beside = _are_beside(subject.size)

    def glow(frame: Frame, state: Any) -> tuple[float, Any]:
        now = subject.step(frame, 1 / 60, state)
        assert now.picture is not None
        return float(now.picture[is_beside][..., :3].sum(dtype=np.float64)), now.state

    stills = []
    for frame in frames:
        # Some histories begin as black; in others, a light of one pixel fades.
        most, state = 0.0, None
        for _ in range(_STILL_FRAMES):
            one, state = glow(frame, state)
            most = max(most, one)
        stills.append(most)
    mean = sum(stills) / len(stills)
    if not mean > 0:
        raise NotTaken("the picture has no bloom")
    state, seen = None, []
    for number in range(5 * _PHASES):
        one, state = glow(frames[number % _PHASES], state)
        seen.append(one)
    settled = seen[-2 * _PHASES :]
    off = _range(settled) / mean
    figure("stills", _range(stills) / mean)
    figure("kept", sum(settled) / len(settled) / mean)
    text = f"the bloom of lights of half a pixel changes by {off:.3g} of that of still frames"
    law = "the bloom of a camera that jitters does not flicker"
    judge(law, ("flicker", off, limits["flicker"], text))


def _positions(size: tuple[int, int]) -> list[tuple[float, float]]:
    """Return the lights' centres, at different parts of pixels."""
    return [
        (size[0] / 2 - 20 + 5.3 * number + 0.37, size[1] / 2 - 6 + 1.7 * number + 0.21)
        for number in range(_LIGHTS)
    ]


def _distances(size: tuple[int, int], x: float, y: float) -> NDArray[np.float64]:
    """Return how far each pixel's centre is from each light, along the axis where it is more."""
    columns, rows = np.arange(size[0]) + 0.5, np.arange(size[1])[:, np.newaxis] + 0.5
    return np.array(
        [
            np.maximum(np.abs(columns - x - left), np.abs(rows - y - top))
            for left, top in _positions(size)
        ]
    )


def _draw_lights(size: tuple[int, int], x: float, y: float) -> Frame:
    is_lit: NDArray[np.bool_] = np.any(_distances(size, x, y) < _HALF_SIDE, axis=0)
    return np.dstack([np.where(is_lit, np.float32(_LIGHT), np.float32(0))] * 3)


def _are_beside(size: tuple[int, int]) -> NDArray[np.bool_]:
    """Return the pixels that only a bloom reaches, and not the filters of a TAA."""
    return np.asarray((_distances(size, 0, 0) > _REACH).all(axis=0))


# Lights of 0.6 pixels, which each frame of the jitter sees or misses; pixels within 5 of them are
# not measured. The engines' cameras repeat 8 offsets.
_LIGHTS, _HALF_SIDE, _LIGHT, _REACH = 8, 0.3, 16.0, 5.0
_PHASES: Final = 8
_STILL_FRAMES: Final = 12
_MIN_SIDE: Final = 48
# A mean over frames by shares of 0.1 leaves a fifth of what flickers by itself; bloom before TAA
# two thirds and more.
_RESOLVED: Final = 0.3

SHIMMER: Final = Law(
    name="shimmer",
    subject=Adaptation,
    applies=lambda subject: subject.gives_pictures,
    test=_test_shimmer,
    formula="with anti-aliasing over frames (TAA), the bloom of small lights does not flicker as a "
    "camera moves by parts of a pixel",
    figures={
        "flicker": Figure(
            "(largest - smallest) light of the bloom, by the mean of still frames", _RESOLVED
        ),
        "stills": Figure("the same of still frames, without help by other frames"),
        "kept": Figure(
            "light of the bloom, by the mean of still frames: a TAA can take lights out"
        ),
    },
    why="There is no TAA, or it runs after the bloom: a history that is limited by the colours "
    "around a pixel keeps nothing of a glow, which has nearly one colour there.",
)
