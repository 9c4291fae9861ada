"""Laws of bloom in time: jitter of the camera, and what stays of a light that has moved."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom.testing._deviations import fail, figure, is_within, judge
from vkbloom.testing._laws.law import Figure, Law, Limits
from vkbloom.testing._moving_light import sample_area
from vkbloom.testing._probe import Bloom, Image, Probe, small_probe, takes
from vkbloom.testing._subject import Subject

__tracebackhide__ = True

# The order in which positions are tried: the light in one pixel first, then across the borders of
# pixels in different directions. After as many positions, the figure decides if it is at most this
# share of the limit: in all presets, 16 positions have at most 2.2 and 1.2 times as much.
_ORDER: Final = (0, 6, 7, 11, 3, 8, 13, 15, 1, 2, 4, 5, 9, 10, 12, 14)
_STEADY: Final = {4: 0.25, 8: 0.5}
# Share of the frames before in a reference TAA.
_FEEDBACK: Final = 0.9
# Frames a second, by which a bloom is given the time.
_RATE: Final = 60.0
# Frames before a jump; and after it, of a bloom that is given the time, and of any other.
_STILL: Final = 8
_FRAMES: Final = 60
_FEW_FRAMES: Final = 7
# Accuracy of a threshold, and the lowest value that is tried, as a share of the probe's.
_ACCURACY: Final = 1.1
_MIN_LEVEL: Final = 2.0**-12


def halton(count: int) -> NDArray[np.float64]:
    """Return the offsets of a camera's jitter: the Halton sequence of bases 2 and 3, less a half.

    - Returns: ndarray of float64, shape (count, 2): x and y in pixels, -0.5 to 0.5.
    """
    return np.array([[_inverse(i, 2) - 0.5, _inverse(i, 3) - 0.5] for i in range(1, count + 1)])


def _inverse(index: int, base: int) -> float:
    share, result = 1.0, 0.0
    while index:
        share /= base
        index, digit = divmod(index, base)
        result += share * digit
    return result


def _test_jitter(subject: Subject, limits: Limits) -> None:
    """Measure the light of the bloom of thin lights in each frame of a camera that jitters.

    A point, a line along x and a line at an angle, half a pixel wide and sampled by their area,
    are seen by a camera that follows a Halton path of 16 positions. 4 or 8 positions that differ
    most are enough if the flicker is far from its limit. A reference TAA, whose result blooms, is
    s_t = 0.9 s_t-1 + 0.1 a_t. Of lines it is measured only if they flicker by more than a quarter
    of its limit, though not beyond the other limit. The first light that breaks the law decides.
    """
    bloom, probe = subject.bloom, subject.lamp
    probe.check_fine("the bloom of a line thinner than a pixel has a few levels")
    law = "the light of a bloom does not change with the jitter of the camera"
    small = small_probe(probe)
    reasons: list[str] = []
    for name, scene in _SCENES.items():
        if reasons:
            break
        for label, kind, off in _flickers(bloom, small, scene, limits):
            figure(f"{name}, {label}", off)
            if not is_within(law, off, limits[kind], kind):
                words = f"changes by {off:.3g} of its mean" if off < math.inf else "is black"
                reasons.append(f"{name}, {label}: the light {words}, {limits[kind]:g} allowed")
    ratio = _threshold_ratio(bloom, small, limits["threshold"])
    if not is_within(law, ratio, limits["threshold"], "threshold"):
        reasons.append(
            f"a lit pixel blooms from {ratio:.2g} times the value on that a flat image needs: the "
            "threshold reads an average"
        )
    if reasons:
        fail(law, "; ".join(reasons))


JITTER: Final = Law(
    name="jitter",
    test=_test_jitter,
    formula="the bloom of thin lights has the same light in each frame of a camera that moves by "
    "parts of a pixel, and a lit pixel blooms from the same value on as a flat image",
    figures={
        "LIGHT, POSITIONS": Figure("one of the two below, by light and number of positions"),
        "flicker": Figure("(largest - smallest) / mean light of the frames", 0.05),
        "resolved": Figure("the same after a TAA", 0.02),
        "threshold": Figure(
            "value from which a pixel blooms, divided by that of a flat image", 1.5
        ),
    },
    why="A threshold after a reduction reads an average: thin lights fall below it. A reduction "
    "that skips pixels sees them now and then.",
)


def _flickers(
    bloom: Bloom,
    probe: Probe,
    scene: Callable[[Probe, float, float], Image],
    limits: Limits,
) -> Iterator[tuple[str, str, float]]:
    """Yield the positions, the kind and the value of each figure of a scene."""
    frames = [scene(probe, x, y) for x, y in halton(len(_ORDER))]
    lights: list[float] = []
    off = math.inf
    for index in _ORDER:
        lights.append(_light(bloom, probe, frames[index]))
        off = _flicker(lights)
        steady = _STEADY.get(len(lights))
        if steady and not steady * limits["flicker"] < off <= limits["flicker"]:
            break
    yield f"{len(lights)} positions", "flicker", off
    # The light of a linear bloom changes less after TAA. The point shows whether it is linear.
    least = 0.0 if scene is _point else limits["resolved"] / 4
    if least <= off <= limits["flicker"]:
        resolved = list(_taa(frames))[:: len(frames) // 2]
        lights = [_light(bloom, probe, frame) for frame in resolved]
        yield f"{len(frames)} positions, after TAA", "resolved", _flicker(lights)


def _flicker(lights: list[float]) -> float:
    mean = float(np.mean(lights))
    return float(np.ptp(lights)) / mean if mean > 0 else math.inf


def _point(probe: Probe, x: float, y: float) -> Image:
    return sample_area(probe.size, (probe.centre[0] + x, probe.centre[1] + y), (0.5, 0.5))


def _line(probe: Probe, x: float, y: float) -> Image:
    """Return a line of 24 pixels along x."""
    return sample_area(probe.size, (probe.centre[0] + x, probe.centre[1] + y), (24.0, 0.5))


def _draw_oblique_line(probe: Probe, x: float, y: float) -> Image:
    """Return a line at an angle, as squares whose centres are a quarter of a pixel apart."""
    steps = np.arange(-12, 12, 0.25)
    centres = zip(probe.centre[0] + x + steps, probe.centre[1] + y + steps / 3, strict=True)
    squares = [sample_area(probe.size, centre, (0.25, 0.5)) for centre in centres]
    return np.asarray(np.sum(squares, axis=0))


_SCENES: Final[dict[str, Callable[[Probe, float, float], Image]]] = {
    "point": _point,
    "line": _line,
    "angled line": _draw_oblique_line,
}


def _taa(frames: list[Image]) -> Iterator[Image]:
    """Yield the resolved frames of a second round, which starts from the mean of the first."""
    resolved: Image = np.mean(frames, axis=0)
    for frame in frames:
        resolved = _FEEDBACK * resolved + (1 - _FEEDBACK) * frame
        yield resolved


def _light(bloom: Bloom, probe: Probe, share: Image) -> float:
    """Return the sum of the bloom of a plane, whose values are shares of the probe's value."""
    image = np.repeat(share[:, :, np.newaxis], probe.colours, axis=2) * probe.value
    return float(probe.apply(bloom, image)[0].sum())


def _threshold_ratio(bloom: Bloom, probe: Probe, limit: float) -> float:
    """Return the value from which a pixel blooms, divided by that of a flat image.

    1 if the ratio is at most the limit, or a pixel of the probe's value does not bloom.
    """

    def blooms(value: float, pixel: bool) -> bool:
        image = probe.point(probe.centre, value) if pixel else probe.flat(value)
        return bool(probe.apply(bloom, image)[0].max() > 1e-6 * value)

    def first(pixel: bool, low: float) -> float:
        """Return the value from which an image blooms, by bisection of its logarithm."""
        high = probe.value
        while high > _ACCURACY * low:
            middle = math.sqrt(low * high)
            low, high = (low, middle) if blooms(middle, pixel) else (middle, high)
        return high

    least = _MIN_LEVEL * probe.value
    if blooms(least, False):
        return 1.0
    flat = first(False, least)
    if blooms(min(flat * limit, probe.value), True):
        return 1.0
    return first(True, flat) / flat if blooms(probe.value, True) else 1.0


def _test_history(subject: Subject, limits: Limits) -> None:
    """Let a light stand still for 8 frames, then jump.

    The image after the jump stays for 60 frames; for 7, if the bloom takes no time. A bloom that
    takes `time` is given it in seconds, in the order of the frames, at 60 frames a second.
    """
    bloom, probe = subject.bloom, small_probe(subject.lamp)
    law = "the bloom of an image depends on that image alone"
    clock = iter(range(1 << 30))

    def at(image: Image) -> Image:
        options: dict[str, Any] = {"time": next(clock) / _RATE} if takes(bloom, "time") else {}
        return probe.apply(lambda given: bloom(given, **options), image)[0]

    x, y = probe.centre
    before, after = (
        probe.point((max(0, min(probe.size[0] - 3, x + step)), y), probe.value, (3, 3))
        for step in (-8, 8)
    )
    count = _FRAMES if takes(bloom, "time") else _FEW_FRAMES
    for _ in range(_STILL):
        at(before)
    images = [at(after) for _ in range(count)]
    last = float(images[-1].sum())
    if not last > 0:
        raise ValueError("the bloom of a small light is black")
    left = [float(np.abs(image - images[-1]).sum()) / last for image in images]
    sums = np.array([image.sum() for image in images[count // 2 :]])
    steady = float(np.ptp(sums) / sums.mean()) if sums.mean() > 0 else math.inf
    above = sum(share > limits["stays"] for share in left)
    figure("frames", float(above))
    changes = f"the bloom of an image that stays the same changes by {steady:.3g} of its mean"
    stays = (
        f"after a light has jumped, {left[0]:.3g} of the light differs from what it becomes, "
        f"and {above} frames are above {limits['stays']:g}"
    )
    judge(
        law,
        ("steady", steady, limits["steady"], changes),
        ("stays", left[0], limits["stays"], stays),
    )


HISTORY: Final = Law(
    name="history",
    test=_test_history,
    formula="the bloom of an image does not depend on the images before, nor on the time",
    figures={
        "frames": Figure("frames for which more than the limit differs after a jump"),
        "stays": Figure("light that differs in the first frame after a jump, as a share", 0.01),
        "steady": Figure("(largest - smallest) / mean light of an image that stays", 0.01),
    },
    why="A bloom that is smoothed in time keeps what has moved for some frames on purpose.",
)
