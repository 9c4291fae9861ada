"""Bloom in time: jitter of the camera, and what stays of a light that has moved."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._argument_types import checked
from vkbloom._public import public
from vkbloom.testing._border import takes
from vkbloom.testing._deviations import fail, figure, is_within, judge
from vkbloom.testing._moving_light import area_sampled
from vkbloom.testing._probe import DEFAULT, Bloom, Image, Probe, small_probe

__tracebackhide__ = True

__all__ = ["HISTORY_LIMITS", "JITTER_LIMITS", "assert_history", "assert_jitter", "halton"]

#: Limits by figure: changes of the bloom's light as shares of its mean, and how many times as
#: bright a pixel must be as a flat image to pass a threshold.
JITTER_LIMITS: Final = {"flicker": 0.05, "resolved": 0.02, "threshold": 1.5}
#: Limits by figure, as shares of the light: what stays in the first frame; changes of a still.
HISTORY_LIMITS: Final = {"stays": 0.01, "steady": 0.01}
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
_LEAST: Final = 2.0**-12


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


@public("vkbloom.testing")
@checked
def assert_jitter(
    bloom: Bloom,
    probe: Probe = DEFAULT,
    *,
    limits: Mapping[str, float] | None = None,
) -> None:
    """Assert that the jitter of a camera does not make a bloom flicker.

    A point, a line along x and a line at an angle, half a pixel wide and sampled by their area,
    are seen by a camera that follows a Halton path of 16 positions. The law: the light of the bloom
    is the same in each frame. "flicker" is (largest - smallest) / mean of its sum; 4 or 8 positions
    that differ most are enough if the figure is far from the limit. "resolved" is the same of a
    reference TAA, whose result blooms: s_t = 0.9 s_t-1 + 0.1 a_t. Of lines it is
    measured only if they flicker by more than a quarter of its limit, though not beyond the other
    limit. The first light that breaks the law decides. And a
    lit pixel blooms from the same value on as a flat image: "threshold" is the first divided by the
    second.

    Parameters
    ----------
    bloom : callable
        Takes an image and returns one of the same height and width: the bloom alone.
    probe : Probe
        Its value must be far above a threshold.
    limits : mapping of str to float, optional
        Limits by figure; by default 0.05, 0.02, 1.5.

    Raises
    ------
    AssertionError
        The law does not hold, or a result is not finite.
    """
    probe.check_fine("the bloom of a line thinner than a pixel has a few levels")
    allowed = JITTER_LIMITS | dict(limits or {})
    law = "the light of a bloom does not change with the jitter of the camera"
    small = small_probe(probe)
    reasons: list[str] = []
    for name, scene in _SCENES.items():
        if reasons:
            break
        for label, kind, off in _flickers(bloom, small, scene, allowed):
            figure(f"{name}, {label}", off)
            if not is_within(law, off, allowed[kind], kind):
                words = f"changes by {off:.3g} of its mean" if off < math.inf else "is black"
                reasons.append(f"{name}, {label}: the light {words}, {allowed[kind]:g} allowed")
    ratio = _threshold_ratio(bloom, small, allowed["threshold"])
    if not is_within(law, ratio, allowed["threshold"], "threshold"):
        reasons.append(
            f"a lit pixel blooms from {ratio:.2g} times the value on that a flat image needs: the "
            "threshold reads an average"
        )
    if reasons:
        fail(law, "; ".join(reasons))


def _flickers(
    bloom: Bloom,
    probe: Probe,
    scene: Callable[[Probe, float, float], Image],
    allowed: Mapping[str, float],
) -> Iterator[tuple[str, str, float]]:
    """Yield the positions, the kind and the value of each figure of a scene."""
    frames = [scene(probe, x, y) for x, y in halton(len(_ORDER))]
    lights: list[float] = []
    off = math.inf
    for index in _ORDER:
        lights.append(_light(bloom, probe, frames[index]))
        off = _flicker(lights)
        steady = _STEADY.get(len(lights))
        if steady and not steady < off / allowed["flicker"] <= 1:
            break
    yield f"{len(lights)} positions", "flicker", off
    # The light of a linear bloom changes less after TAA. The point shows whether it is linear.
    least = 0.0 if scene is _point else allowed["resolved"] / 4
    if least <= off <= allowed["flicker"]:
        resolved = list(_taa(frames))[:: len(frames) // 2]
        lights = [_light(bloom, probe, frame) for frame in resolved]
        yield f"{len(frames)} positions, after TAA", "resolved", _flicker(lights)


def _flicker(lights: list[float]) -> float:
    mean = float(np.mean(lights))
    return float(np.ptp(lights)) / mean if mean > 0 else math.inf


def _point(probe: Probe, x: float, y: float) -> Image:
    return area_sampled(probe.size, (probe.centre[0] + x, probe.centre[1] + y), (0.5, 0.5))


def _line(probe: Probe, x: float, y: float) -> Image:
    """Return a line of 24 pixels along x."""
    return area_sampled(probe.size, (probe.centre[0] + x, probe.centre[1] + y), (24.0, 0.5))


def _angled(probe: Probe, x: float, y: float) -> Image:
    """Return a line at an angle, as squares whose centres are a quarter of a pixel apart."""
    steps = np.arange(-12, 12, 0.25)
    centres = zip(probe.centre[0] + x + steps, probe.centre[1] + y + steps / 3, strict=True)
    squares = [area_sampled(probe.size, centre, (0.25, 0.5)) for centre in centres]
    return np.asarray(np.sum(squares, axis=0))


_SCENES: Final[dict[str, Callable[[Probe, float, float], Image]]] = {
    "point": _point,
    "line": _line,
    "angled line": _angled,
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

    least = _LEAST * probe.value
    if blooms(least, False):
        return 1.0
    flat = first(False, least)
    if blooms(min(flat * limit, probe.value), True):
        return 1.0
    return first(True, flat) / flat if blooms(probe.value, True) else 1.0


@public("vkbloom.testing")
@checked
def assert_history(
    bloom: Bloom, probe: Probe = DEFAULT, *, limits: Mapping[str, float] | None = None
) -> None:
    """Assert that a bloom shows the image of now, and nothing of the images before.

    A light stands still for 8 frames, then jumps. "stays" is the light of the first bloom after the
    jump that a bloom of the same image 60 frames later has not, as a share (7 frames later, if the
    bloom takes no time); the figure "frames" tells for how many frames it stays above its limit.
    "steady" is (largest - smallest) / mean of the light in the second half of these frames.

    Parameters
    ----------
    bloom : callable
        ``bloom(image)`` or ``bloom(image, *, time)``, with the time in seconds; called in the order
        of the frames, at 60 frames a second.
    probe : Probe
    limits : mapping of str to float, optional
        Limits by figure; by default 0.01 of both.

    Raises
    ------
    AssertionError
        The law does not hold, or a result is not finite.
    """
    allowed = HISTORY_LIMITS | dict(limits or {})
    law = "the bloom of an image depends on that image alone"
    probe = small_probe(probe)
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
    above = sum(share > allowed["stays"] for share in left)
    figure("frames", float(above))
    changes = f"the bloom of an image that stays the same changes by {steady:.3g} of its mean"
    stays = (
        f"after a light has jumped, {left[0]:.3g} of the light differs from what it becomes, "
        f"and {above} frames are above {allowed['stays']:g}"
    )
    judge(
        law,
        ("steady", steady, allowed["steady"], changes),
        ("stays", left[0], allowed["stays"], stays),
    )
