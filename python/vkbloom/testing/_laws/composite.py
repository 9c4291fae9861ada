"""A law of how a picture and its bloom are put together."""

from __future__ import annotations

from typing import Final

import numpy as np

from vkbloom.reference._tone_map import TONE_MAPS
from vkbloom.testing._deviations import Findings
from vkbloom.testing._laws.law import Figure, Law, Limits
from vkbloom.testing._probe import Bloom, Image, NotTaken, Probe, small_probe
from vkbloom.testing._subject import Subject

__tracebackhide__ = True

# Values of the light: each is the one before times the square root of 2.
_LIGHTS: Final = tuple(2.0 ** (index / 2) for index in range(9))
# Side of the light in pixels, and how far from its centre its bloom is measured.
_SIDE: Final = 9
_AWAY: Final = 7
# Where backdrops lie from there, in directions of x and y; their values, and others, by which two
# of them are seen below and above 1.
_PLACES: Final = ((1, 0), (-1, 0), (0, 1), (0, -1))
_BLACK: Final = (0.0, 0.0, 0.0, 0.0)
_GREY: Final = (0.25, 0.75, 0.99, 1.01)
_SWAPPED: Final = (0.25, 0.75, 1.01, 0.99)
# A bloom is visible from this share of the light that it has on another backdrop.
_VISIBLE: Final = 0.01


def _test_composite(subject: Subject, limits: Limits) -> None:
    """Measure the bloom beside a light on black and on four backdrops, for several lights."""
    picture, probe = subject.picture or subject.bloom, small_probe(subject.probe)
    if probe.levels is not None or probe.dtype.kind == "u":
        raise ValueError("cannot be tested in integers: they hold no light above 1")
    if min(probe.size) < 2 * _AWAY + 4:
        raise ValueError(f"probe: {min(probe.size)} pixels have no place for a light and backdrops")
    scale = max(1.0, probe.value)
    lights = [scale * light for light in _LIGHTS]
    ends = [lights[0], lights[len(lights) // 2], lights[-1]]
    on_black, *others = (
        _measure(picture, probe, used, values)
        for used, values in ((lights, _BLACK), (ends, _GREY), (lights[-1:], _SWAPPED))
    )
    (on_grey, _), (swapped, _) = others
    error = max(error for _, error in (on_black, *others))
    findings = Findings("F(s, light) is continuous and rises with the light, on black, too")
    largest = max(float(on_black[0].max()), float(on_grey[:, :2].max()))
    if not largest > 4 * error:
        raise NotTaken(f"a light of {lights[-1]:g} has no bloom {_AWAY} pixels beside its centre")
    _judge_visible(findings, on_black[0], largest, limits)
    _judge_rising(findings, on_black[0], on_grey[:, :2], error, limits)
    _judge_above_1(findings, (on_black[0][-1], on_grey[-1], swapped[-1]), error, limits)
    if subject.toned is not None:
        _judge_curve(findings, picture, subject.toned, probe, limits)
    findings.conclude()


def _measure(
    picture: Bloom, probe: Probe, lights: list[float], backdrops: tuple[float, ...]
) -> tuple[Image, float]:
    """Return what lights add at the places of the backdrops, one row a light; and its error."""
    (x, y), begin = probe.centre, probe.centre[0] - _SIDE // 2
    scene = probe.flat(0.0)
    places = [(x + _AWAY * along, y + _AWAY * across) for along, across in _PLACES]
    for (at_x, at_y), value in zip(places, backdrops, strict=True):
        scene[at_y - 1 : at_y + 2, at_x - 1 : at_x + 2] = value
    window = np.s_[y - _SIDE // 2 : y + _SIDE // 2 + 1, begin : begin + _SIDE]
    rows, error = [], 0.0
    for light in (0.0, *lights):
        image = scene.copy()
        image[window] = light
        result, allowed = probe.apply(picture, image)
        rows.append([float(result[at_y, at_x].mean()) for at_x, at_y in places])
        # Beside a light, errors are a share of what is there.
        near = np.broadcast_to(allowed, result.shape).max() / max(1.0, float(np.abs(result).max()))
        error = max(error, near * max(1.0, *rows[-1]))
    return np.array(rows[1:]) - rows[0], 2 * error


def _judge_visible(findings: Findings, on_black: Image, largest: float, limits: Limits) -> None:
    share = float(on_black[-1].min()) / largest
    off, limit = max(0.0, 1 - share / _VISIBLE), limits["black"]
    text = f"on black, a light adds {share:.3g} of what it adds on a grey: {_VISIBLE:g} is visible"
    findings.add([("black", off, limit, text)])


def _judge_rising(
    findings: Findings, on_black: Image, on_grey: Image, error: float, limits: Limits
) -> None:
    """Backdrops up to 0.75 are judged: a screen takes light from brighter ones."""
    largest = float(max(on_black.max(), error))
    lost = [-float(np.diff(rows, axis=0, prepend=0.0).min()) for rows in (on_black, on_grey)]
    falls = max(0.0, *(off - error for off in lost)) / largest
    jumps = float(np.abs(np.diff(on_black, axis=0)).max()) / largest
    findings.add(
        [
            (
                *("falls", falls, limits["falls"]),
                f"a brighter light adds less, by {falls:.3g} of the largest bloom: "
                f"{limits['falls']:g} allowed",
            ),
            (
                *("jump", jumps, limits["jump"]),
                f"from a light to the next one, sqrt(2) times as bright, the bloom jumps by "
                f"{jumps:.3g} of the largest: {limits['jump']:g} allowed",
            ),
        ]
    )


def _judge_above_1(
    findings: Findings, lights: tuple[Image, Image, Image], error: float, limits: Limits
) -> None:
    """Compare what a light adds at the same place below and above 1; `lights`: also on black."""
    on_black, *on_others = (row[2:] for row in lights)
    if float(on_black.min()) <= 4 * error:
        return
    first, second = (row / on_black for row in on_others)
    worst = int(np.abs(first - second).argmax())
    off, limit = float(np.abs(first - second)[worst]), limits["above_1"]
    shares = (first, second) if worst == 0 else (second, first)
    text = (
        f"on backdrops of 0.99 and 1.01 a light adds {shares[0][worst]:.3g} and "
        f"{shares[1][worst]:.3g} of what it adds on black: {limit:g} apart are allowed"
    )
    findings.add([("above_1", off, limit, text)])


def _judge_curve(
    findings: Findings, picture: Bloom, toned: Bloom, probe: Probe, limits: Limits
) -> None:
    """Compare the picture with a tone curve with the curve of the picture."""
    image = probe.noise(0, 4.0)
    expected = TONE_MAPS["reinhard"](np.maximum(probe.apply(picture, image)[0], 0))
    off = float(np.abs(probe.apply(toned, image)[0] - expected).max())
    text = f"the picture with a tone curve is off by {off:.3g} from the curve of the picture: "
    findings.add([("curve", off, limits["curve"], f"{text}{limits['curve']:g} allowed")])


COMPOSITE: Final = Law(
    name="composite",
    test=_test_composite,
    formula="what a light adds beside it is visible on black, rises with the light without a jump, "
    "changes little from a backdrop of 0.99 to one of 1.01, and is added before the tone curve",
    figures={
        "black": Figure(
            "on black, what is missing to a hundredth of the light on a grey, as a share", 0.0
        ),
        "falls": Figure("what a brighter light adds less, as a share of the largest bloom", 0.01),
        "jump": Figure(
            "what a light adds more than one by sqrt(2) darker, as a share of the largest", 0.5
        ),
        "above_1": Figure(
            "how much the share differs that a light adds on backdrops of 0.99 and 1.01", 0.1
        ),
        "curve": Figure(
            "of settings, difference of the picture with the tone curve from the curve of it", 0.01
        ),
    },
    why="Soft light and other products with the picture add nothing to black. A method may add its "
    "bloom after the tone curve, as its description says.",
)
