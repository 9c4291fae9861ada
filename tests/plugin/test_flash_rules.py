"""Verdicts by Rec. ITU-R BT.1702 and by IRIS that follow from the rules by hand."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.cli.calls import run
from tests.custom.test_check import check
from tests.srgb import encode_srgb
from vkbloom import write
from vkbloom.testing import Display, FlashRules, FlashVerdict, flash

Image = NDArray[Any]
FPS = 24
SHAPE = (20, 40)
GREY = (1.0, 1.0, 1.0)


def toggles(every: int, count: int) -> list[int]:
    """Return `count` frames of transitions, `every` frames apart."""
    return [every * (index + 1) for index in range(count)]


def light(frames: int, at: Sequence[int], low: float = 0.0, high: float = 1.0) -> list[float]:
    """Return a value for each frame that changes between two at the given frames."""
    return [high if sum(1 for t in at if t <= n) % 2 else low for n in range(frames)]


def full(values: Sequence[float], colour: tuple[float, float, float] = GREY) -> list[Image]:
    return [
        (np.ones((*SHAPE, 3)) * value * np.array(colour)).astype(np.float32) for value in values
    ]


def columns(values: Sequence[float], first: int, end: int, base: float = 0.3) -> list[Image]:
    """Return frames whose columns from `first` up to `end` have the values; others are still."""
    frames = full([base] * len(values))
    for frame, value in zip(frames, values, strict=True):
        frame[:, first:end] = value
    return frames


def counterphase(values: Sequence[float], low: float, high: float) -> list[Image]:
    y, x = np.indices(SHAPE)
    checks = ((x // 4 + y // 4) % 2)[..., np.newaxis] * np.ones(3)
    return [np.where(checks == value, high, low).astype(np.float32) for value in values]


def quadrants() -> list[Image]:
    """Return frames whose quarters rise one after another, a frame each, and fall in that order."""
    frames = full([0.0] * 40)
    for index, frame in enumerate(frames):
        for quarter in range(4):
            # The first rises at frame 4, 12, ... and falls at 8, 16, ...
            if (index - 4 - quarter) % 8 < 4 and index >= 4 + quarter:
                frame[:, 10 * quarter : 10 * quarter + 10] = 1
    return frames


def bar(step: int) -> list[Image]:
    """Return a white bar of 4 of 40 columns that goes back and forth between the sides."""
    frames = full([0.0] * 48)
    for index, frame in enumerate(frames):
        at = abs((index * step) % 72 - 36)
        frame[:, at : at + 4] = 1
    return frames


def bits(frames: list[Image]) -> list[Image]:
    return [np.rint(255 * encode_srgb(frame)).astype(np.uint8) for frame in frames]


class Case(NamedTuple):
    """A sequence, its results of luminance and red, and transitions of the worst second.

    IRIS' are those of BT.1702 unless they are given.
    """

    frames: list[Image]
    luminance: str
    red: str = "pass"
    most: int | None = None
    iris: str | None = None
    fps: int = FPS
    display: Any = None
    second: float | None = None
    share: float | None = None


#: 5 Hz and a bit: a transition each 2 frames, 12 in a second, which fails at the seventh.
FAST = toggles(2, 20)
FAILS_AT = 14 / FPS
# Transitions of IRIS' videos of two and of three flashes of three frames in each second.
_SECONDS = (5, 29, 54, 79, 104, 129)
TWO = [first + step for first in _SECONDS for step in (0, 3, 6, 9)]
THREE = [first + step for first in _SECONDS[:5] for step in (0, 3, 6, 9, 11, 14)]

CASES: dict[str, Case] = {
    "still": Case(full([0.5] * 30), "pass", most=0),
    # One flash a second is two transitions, below the four of a warning.
    "1 Hz for 8 s": Case(full(light(192, toggles(12, 15))), "pass", most=2),
    # Transitions at 6, 12, 18 and 24 lie in the 24 frames 1 to 24.
    "2 Hz for a second": Case(full(light(26, toggles(6, 4))), "warning", most=4),
    # 4, 8, ... 24: six, which are three flashes.
    "3 Hz for a second": Case(full(light(26, toggles(4, 6))), "warning", most=6),
    # The seventh transition within 28 frames: more than three flashes, at 28 / 28 s.
    "7 transitions in a second": Case(
        full(light(30, toggles(4, 7))), "failure", most=7, fps=28, second=1.0, share=1.0
    ),
    # T >= 4 from frame 16 on: the 96th such frame, 4 s, is 111.
    "3 Hz for 6 s": Case(
        full(light(144, toggles(4, 35))), "extended failure", most=6, second=111 / FPS, share=1.0
    ),
    # From frame 16 to the end at 110: 95 frames, one less than 4 s.
    "3 Hz for 4.6 s": Case(full(light(111, toggles(4, 27))), "warning", most=6),
    # Four transitions in the first second, none in the next four: E counts at most 24 frames each.
    "four transitions every 5 s": Case(
        full(light(250, [6, 12, 18, 24, 126, 132, 138, 144])), "warning", most=4
    ),
    # 0.095 and 0.105 of 200 cd/m2 are 19 and 21.
    "changes of 19 cd/m2": Case(full(light(40, FAST, 0.5, 0.595)), "pass", most=0),
    "changes of 21 cd/m2": Case(
        full(light(40, FAST, 0.5, 0.605)), "failure", second=FAILS_AT, share=1.0
    ),
    # 0.805 of 200 is 161 cd/m2, 0.795 is 159.
    "the darker picture has 161 cd/m2": Case(full(light(40, FAST, 0.805, 1)), "pass", most=0),
    "the darker picture has 159 cd/m2": Case(full(light(40, FAST, 0.795, 1)), "failure"),
    # By a white of 100 cd/m2, 0.15 is 15; by 400, 0.06 is 24.
    "0.15 of 100 cd/m2": Case(
        full(light(40, FAST, 0.2, 0.35)), "pass", most=0, display=Display(white=100)
    ),
    "0.06 of 400 cd/m2": Case(
        full(light(40, FAST, 0.2, 0.26)), "failure", display=Display(white=400)
    ),
    # (190 - 170) / 360 is 1 / 18, (192 - 170) / 362 is 1 / 16.5. IRIS has no rule above 160.
    "PQ, a contrast of 1/18": Case(
        full(light(40, FAST, 170 / 203, 190 / 203)), "pass", most=0, display="pq"
    ),
    "PQ, a contrast of 1/16.5": Case(
        full(light(40, FAST, 170 / 203, 192 / 203)), "failure", iris="pass", display="pq"
    ),
    # 1000 (1 / 12)^1.2 = 51 cd/m2 at the signal 1/2; 203 at 3/4.
    "HLG, signals of 1/2 and 3/4": Case(
        [np.rint(65535 * f).astype(np.uint16) for f in full(light(40, FAST, 0.5, 0.75))],
        "failure",
        display="hlg",
    ),
    # 1000 / 12^1.2 = 51 and 65 cd/m2: the signal 0.54 has E = 0.1016 and 1000 E^1.2 = 64.4.
    "HLG, signals of 0.5 and 0.54": Case(
        [np.rint(65535 * f).astype(np.uint16) for f in full(light(40, FAST, 0.5, 0.54))],
        "pass",
        display="hlg",
    ),
    # 9 and 10 of 40 columns: 22.5 % and 25 %; their change by 0.7 makes the mean 0.16 and 0.175.
    "on 22.5 %": Case(columns(light(40, FAST, 0.3, 1), 0, 9), "pass", most=0),
    "on 25 %": Case(columns(light(40, FAST, 0.3, 1), 0, 10), "failure", share=0.25),
    # 13 of 40 columns change by 50 cd/m2, the mean by 16.
    "a third changes by 0.25": Case(
        columns(light(40, FAST, 0.3, 0.55), 0, 13), "failure", iris="pass", share=13 / 40
    ),
    # All pixels change by 140 cd/m2, the mean by 0.
    "checks in counterphase": Case(
        counterphase(light(40, FAST), 0.1, 0.8), "failure", iris="pass", share=1.0
    ),
    # Each quarter has a transition every 4 frames. Four that rise are one transition: six a second.
    "quarters one after another": Case(quadrants(), "warning", most=6),
    # A step of 4 columns: 4 get light and 4 lose it, 20 %.
    "a bar that moves": Case(bar(4), "pass", most=0),
    # 0.15 in three seconds: 10 cd/m2 within one.
    "slow fades": Case(
        full(np.interp(np.arange(288), [0, 72, 144, 216, 288], [0, 0.15, 0, 0.15, 0]).tolist()),
        "pass",
        most=0,
    ),
    # A sine of 6 Hz by 0.3: the trend reaches 0.1 in each half of its 4 frames.
    "a sine": Case(full([0.4 + 0.15 * np.sin(np.pi * n / 2) for n in range(40)]), "failure"),
    # 20 % change; what the others do is less than a level of 8 bits, so that they do not change.
    "on 20 %, beside less than a level": Case(
        [
            frame + np.float32(1e-5 * (index % 2))
            for index, frame in enumerate(columns(light(40, FAST, 0.3, 1), 0, 8))
        ],
        "pass",
        most=0,
    ),
    # Boxes of 2 x 2 pixels, since 160 are judged along the longer side.
    "checks of a pixel": Case(
        [np.roll(np.indices((4, 320)).sum(0) % 2, n, 1)[..., None] * np.ones(3) for n in range(40)],
        "pass",
        most=0,
    ),
    "8 bits": Case(bits(full(light(40, FAST, 0.1, 0.4))), "failure", second=FAILS_AT),
    # Its luminance changes by 200 x 0.2126 x 0.25 = 10.6 cd/m2, 320 (R - G - B) by 80.
    "red": Case(full(light(40, FAST, 0, 0.25), (1, 0, 0)), "pass", red="failure"),
    # 320 x 0.059 = 18.9, 320 x 0.066 = 21.1.
    "red by 19": Case(full(light(40, FAST, 0, 0.059), (1, 0, 0)), "pass"),
    "red by 21": Case(full(light(40, FAST, 0, 0.066), (1, 0, 0)), "pass", red="failure"),
    # 1 / (1 + 0.2 + 0.2) = 0.71, below 0.8; the luminance changes by 200 x 0.374 x 0.25 = 18.7.
    "pink": Case(full(light(40, FAST, 0, 0.25), (1, 0.2, 0.2)), "pass"),
    "3 Hz in red for 6 s": Case(
        full(light(144, toggles(4, 35), 0, 0.25), (1, 0, 0)), "pass", red="extended failure"
    ),
    # IRIS' videos by what they show, with its own results.
    "IRIS' 2Hz_5s: T up to 5 for 3 s": Case(
        full(light(25, [6, 7, 8, 9, 10, 11, 12, 13, 15, 16, 17, 18, 20, 21, 22, 23])),
        "warning",
        most=5,
        fps=5,
    ),
    # T >= 4 from frame 14 on.
    "IRIS' 2Hz_6s": Case(
        full(light(149, TWO)), "extended failure", most=5, fps=25, second=113 / 25, share=1.0
    ),
    # The seventh: 5, 8, 11, 14, 16, 19 and 29 lie in 25 frames.
    "IRIS' 3Hz_6s": Case(full(light(149, THREE)), "failure", most=7, fps=25, second=29 / 25),
    # 320 R of 248 to 314 in 5 frames and back: a transition each.
    "IRIS' GradualRedIncrease": Case(
        full(np.interp(range(24), [3, 8, 10, 15], [0.775, 0.98, 0.98, 0.775]).tolist(), (1, 0, 0)),
        "pass",
    ),
    # Every half second, 11 and 14 frames apart: up to 3 transitions in 25 frames.
    "IRIS' extendedFLONG": Case(
        full(light(200, sorted([*range(9, 200, 25), *range(20, 200, 25)]))), "pass", fps=25
    ),
    # From 0.83 on: the darker picture has 166 cd/m2.
    "IRIS' gray": Case(full(light(50, toggles(4, 11), 0.83, 1)), "pass", most=0, fps=25),
    "IRIS' intermitentEF": Case(
        full(light(200, [9, 20, 33, 44, 58, 69, 83, 94, 133, 144, 158, 169])), "pass", fps=25
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_verdicts(name: str) -> None:
    case = CASES[name]
    for standard in ("bt1702", "iris"):
        found = flash(case.frames, case.fps, standard=standard, display=case.display)
        expected = case.luminance if standard == "bt1702" else case.iris or case.luminance
        assert (found.luminance.result, found.saturated_red.result) == (expected, case.red), found
        assert (found.general, found.red) == ("failure" in expected, "failure" in case.red)
        if case.most is not None:
            assert found.luminance.transitions.max() == case.most
        if "failure" in expected:
            if case.second is not None:
                assert found.luminance.second == pytest.approx(case.second)
            if case.share is not None:
                assert found.luminance.share == pytest.approx(case.share)
        assert len(found.luminance.results) == len(case.frames)


def stripes(period: float, share: float = 1.0, low: float = 0.0, high: float = 1.0) -> Image:
    """Return stripes whose first is light, on a share of the columns; the rest is dark."""
    x = np.arange(240)
    is_light = (x % period < period / 2) & (x < 240 * share)
    line = np.where(is_light, high, low)[np.newaxis, :, np.newaxis]
    return np.broadcast_to(line, (120, 240, 3)).astype(np.float32)


def rings() -> Image:
    y, x = np.indices((120, 240))
    lit = np.hypot(x - 120, y - 60) % 8 < 4
    return np.repeat(lit[..., np.newaxis], 3, axis=2).astype(np.float32)


def bar_code() -> Image:
    widths = [4, 20, 6, 4, 24, 9, 5, 16, 4, 12] * 3
    line = np.repeat(np.arange(len(widths)) % 2.0, widths)[:240]
    return np.broadcast_to(line[np.newaxis, :, np.newaxis], (120, 240, 3)).astype(np.float32)


#: Six light stripes, on a quarter, of 50 cd/m2 and with 20 between light and dark, for half a
#: second, which is 6 of 12 frames.
PATTERNS: dict[str, tuple[Image, int, bool]] = {
    "6 stripes": (stripes(40), 6, True),
    "along the other axis": (stripes(20).swapaxes(0, 1), 6, True),
    "5 stripes": (stripes(48), 6, False),
    "for 5 frames": (stripes(40), 5, False),
    "on 30 %": (stripes(10, 0.3), 6, True),
    "on 20 %": (stripes(8, 0.2), 6, False),
    # 0.26 of 200 is 52 cd/m2, 0.24 is 48.
    "light of 52 cd/m2": (stripes(20, low=0.1, high=0.26), 6, True),
    "light of 48 cd/m2": (stripes(20, low=0.1, high=0.24), 6, False),
    # 0.5 and 0.59 are 18 cd/m2 apart.
    "18 cd/m2 apart": (stripes(20, low=0.5, high=0.59), 6, False),
    "rings": (rings(), 6, True),
    "noise": (
        np.random.default_rng(1).random((120, 240, 1)).repeat(3, axis=2).astype(np.float32),
        6,
        False,
    ),
    # At most two neighbouring lines have stripes; those of a bar code have widths of 4 to 24.
    "single lines": (
        stripes(10) * np.isin(np.arange(120) % 7, (0, 1, 3, 4))[:, np.newaxis, np.newaxis],
        6,
        False,
    ),
    "a bar code": (bar_code(), 6, False),
    "a plain picture": (np.full((120, 240, 3), 0.5, np.float32), 6, False),
}


@pytest.mark.parametrize("name", PATTERNS)
def test_patterns(name: str) -> None:
    image, frames, failed = PATTERNS[name]
    found = flash([image] * frames, 12, standard="bt1702")
    assert (found.pattern, found.result) == (failed, "failure" if failed else "pass"), found
    assert found.stripes_second == (5 / 12 if failed else None)
    assert flash([image] * frames, 12, standard="iris").stripes is None


def test_rules_are_numbers() -> None:
    """Each number of the rules changes the verdict of a sequence near it."""

    def result(case: str, **changes: Any) -> str:
        return flash(CASES[case].frames, FPS, standard=FlashRules(**changes)).result

    changed: dict[str, tuple[str, dict[str, Any], str]] = {
        "change": ("changes of 19 cd/m2", {"change": 18}, "failure"),
        "dark": ("the darker picture has 161 cd/m2", {"dark": 170}, "failure"),
        "red_change": ("red by 19", {"red_change": 18}, "failure"),
        "area": ("on 22.5 %", {"area": 0.2}, "failure"),
        "max_transitions": ("3 Hz for a second", {"max_transitions": 5}, "failure"),
        "warning_transitions": ("3 Hz for a second", {"warning_transitions": 7}, "pass"),
        "min_transitions": ("3 Hz for 6 s", {"min_transitions": 7}, "warning"),
        "extended_seconds": ("3 Hz for 4.6 s", {"extended_seconds": 3}, "extended failure"),
        "extended_window": ("3 Hz for 6 s", {"extended_window": 3}, "warning"),
        "changes_of": ("checks in counterphase", {"changes_of": "picture"}, "pass"),
    }
    for name, (case, changes, expected) in changed.items():
        assert result(case, **changes) == expected, name
    rules = FlashRules.iris()
    assert (rules.contrast, rules.changes_of, rules.stripes) == (None, "picture", None)


def test_a_step_counts_after_a_second_of_calm() -> None:
    """A fade of 13 cd/m2 a second between two steps up of 40 is no transition."""
    values = np.interp(range(110), [0, 5, 6, 78, 100, 101], [0, 0, 0.2, 0, 0, 0.2])
    for standard in ("bt1702", "iris"):
        found = flash(full(values.tolist()), FPS, standard=standard).luminance
        assert np.flatnonzero(np.diff(found.transitions) > 0).tolist() == [5, 100]


def test_an_extended_failure_ends_with_the_flashes() -> None:
    """The fourth last of transitions up to 120 is at 108, and leaves the second at 132."""
    found = flash(full(light(140, toggles(4, 30))), FPS, standard="bt1702").luminance
    assert [found.results[n] for n in (131, 132)] == ["extended failure", "pass"]
    assert found.extended[132] >= 96


def test_noise_does_not_hide_a_flash() -> None:
    rng = np.random.default_rng(0)
    wave = [0.4 + 0.2 * np.sin(2 * np.pi * 4 * n / 48) for n in range(96)]
    noisy = [np.clip(frame + 0.01 * rng.standard_normal(frame.shape), 0, 1) for frame in full(wave)]
    assert flash(noisy, 48, standard="bt1702").luminance.transitions[-1] == 8


def test_luminance_of_displays() -> None:
    """PQ by table 4 of BT.2100: the signal 0.5081 is 100 cd/m2; HLG by table 5."""
    grey = np.full((1, 1, 3), round(0.508078 * 65535), np.uint16)
    np.testing.assert_allclose(Display(encoding="pq").light_of(grey), 100, rtol=1e-4)
    hlg = np.full((1, 1, 3), round(0.75 * 65535), np.uint16)
    np.testing.assert_allclose(Display(encoding="hlg").light_of(hlg), 203, rtol=2e-3)
    assert Display(encoding="hlg").light_of(hlg * 0 + 65535).max() == pytest.approx(1000)
    # A white of 4000 cd/m2 by PQ is clamped at the peak of the display.
    bright = np.full((1, 1, 3), 4000 / 203, np.float32)
    assert Display(encoding="pq", peak=1000).light_of(bright).max() == 1000
    # The signal is absolute: a white that floats are relative to does not change it.
    np.testing.assert_allclose(Display(encoding="pq", white=100).light_of(grey), 100, rtol=1e-4)
    # The red of Rec. 2020 is outside of Rec. 709 and has the luminance 0.2627 there.
    red = np.array([[[65535, 0, 0]]], np.uint16)
    light = Display(encoding="pq", peak=1e4).light_of(red)
    assert (light[0, 0, 0], light[0, 0, 1]) == (1e4, 0)
    np.testing.assert_allclose(
        Display(white=300).light_of(np.full((1, 1, 3), 188, np.uint8)), 300 * 0.5029, rtol=1e-3
    )


@pytest.mark.parametrize("encoding", ["pq", "srgb"])
def test_luminances_stay_from_the_scene_to_the_display(encoding: Any) -> None:
    """A scene in cd/m2, divided by the white of settings and display, is shown as it is."""
    scene, white = np.array([[[0.5, 20.0, 96.0]]]), 100.0
    settings = vkbloom.Convolution(
        vkbloom.psf.cie_total(), intensity=0, encoding=encoding, reference_white=white
    )
    signal = vkbloom.reference.apply(scene / white, settings)["final"]
    display = Display(encoding=encoding, white=white, primaries="rec709")
    shown = display.light_of(np.rint(65535 * signal).astype(np.uint16))
    np.testing.assert_allclose(shown, scene, rtol=2e-3)
    np.testing.assert_allclose(display.light_of(scene / white), scene)


def test_memory_does_not_grow() -> None:
    """A second of frames is held, and of the others only what the result has."""
    alive: list[int] = []

    class Frame(np.ndarray[Any, Any]):
        def __array_finalize__(self, _: object) -> None:
            alive.append(1)

        def __del__(self) -> None:
            alive.append(-1)

    def frames() -> Iterator[Image]:
        for value in light(200, toggles(2, 99)):
            yield np.full((4, 4, 3), value, np.float32).view(Frame)
            assert sum(alive) < 20

    assert flash(frames(), FPS, standard="bt1702").result == "failure"


def untyped(function: Any) -> Any:
    return function


REFUSED: dict[str, tuple[Callable[[], object], str]] = {
    "degrees": (lambda: flash([], 60), "degrees: WCAG 2.2 judges fields of ten degrees; give"),
    "display": (
        lambda: untyped(flash)([], 60, degrees=4, display="pq"),
        "display: WCAG 2.2 judges relative luminance",
    ),
    "standard": (lambda: untyped(flash)([], 60, standard="bt1720"), "did you mean 'bt1702'?"),
    "a frame": (
        lambda: flash([np.zeros((2, 2, 3))], 60, standard="bt1702"),
        "frames: 1 given; a sequence has at least 2",
    ),
    "encoding": (
        lambda: untyped(Display)(encoding="srbg"),
        "encoding: 'srbg' is not one of srgb, pq, hlg",
    ),
    "white": (lambda: Display(encoding="hlg", white=200), 'white: that of "hlg" follows from'),
    "area": (lambda: FlashRules(area=0), "area: 0 is out of range"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused(name: str) -> None:
    call, message = REFUSED[name]
    with pytest.raises(ValueError, match=message.replace("?", r"\?")):
        call()


def test_check_judges_files_by_bt1702(tmp_path: Path) -> None:
    """Gaps in numbers are time: every second file is missing, and 12 transitions are 6."""
    for index, frame in enumerate(full(light(26, toggles(2, 12)), (0.5, 0.5, 0.5))):
        write(tmp_path / f"f.{index:04d}.png", frame)
        write(tmp_path / f"slow.{2 * index:04d}.png", frame)
    words = ["--sequence", str(tmp_path / "f.%04d.png"), "--fps", "24", "--standard", "bt1702"]
    done, found = check(*words)
    assert (done.exit_code, found["standard"], found["flash"]["result"]) == (1, "bt1702", "failure")
    assert found["flash"]["luminance"]["transitions"][14] == 7
    assert (
        "26 frames at 24 a second, by ITU-R BT.1702\n"
        "general flashes: failure, up to 12 transitions a second, from 0.583 s on, 100 % of the "
        "picture\nred flashes: pass, up to 0 transitions a second\npatterns: pass\n"
    ) in run("check", *words).stdout
    # 0.5 of 30 cd/m2 is 15.
    done, found = check(*words, "--display-white", "30")
    assert (done.exit_code, found["flash"]["luminance"]["transitions"][14]) == (0, 0)
    words[1] = str(tmp_path / "slow.%04d.png")
    done, found = check(*words)
    assert (done.exit_code, found["missing"], found["flash"]["result"]) == (0, 25, "warning")
    assert max(found["flash"]["luminance"]["transitions"]) == 6
    done, found = check(*words[:-1], "iris")
    assert (done.exit_code, found["flash"]["stripes"]) == (0, None)
    for wrong, message in (
        ([*words[:4], "--display", "pq"], "--display needs --standard bt1702"),
        (["--preset", "kino", "--standard", "bt1702"], "--standard needs --sequence"),
        ([*words, "--display", "hlg", "--display-white", "200"], 'that of "hlg" follows'),
    ):
        refused = run("check", *wrong)
        assert (refused.exit_code, message in refused.stderr) == (2, True), refused.stderr


def test_both_standards_have_the_same_names() -> None:
    frames = CASES["red"].frames
    for found in (flash(frames, FPS, degrees=40), flash(frames, FPS, standard="bt1702")):
        assert (found.general, found.red, found.failed) == (False, True, True)
    assert isinstance(found, FlashVerdict)
