"""``vkbloom view``: what keys and the mouse do, and the command in a window."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import vkbloom
from tests.core.builds import ROOT
from tests.processes import python
from vkbloom import Pyramid, Separable
from vkbloom._cli.live import Live

NAMES = ["glow", "blur_vertical", "bloom", "scene", "final"]


def press(live: Live, *keys: str) -> Live:
    for key in keys:
        live.press(key, NAMES)
    return live


def test_a_key_turns_bloom_off_and_on() -> None:
    live = press(Live(Separable(), None), "b")
    assert live.settings == Separable(bloom=False)
    assert press(live, "b").settings == Separable()


def test_a_key_goes_through_presets() -> None:
    live = Live(Separable(tonemap="aces", encoding="srgb"), None)
    found = [press(live, "p").settings for _ in vkbloom.presets]
    assert found == list(vkbloom.presets.values())


def test_keys_choose_framebuffers() -> None:
    live = press(Live(Pyramid(), None), "3")
    assert live.framebuffer == "bloom"
    assert press(live, "9").framebuffer == "bloom"
    # Other settings may lack the framebuffer.
    assert [press(live, "3", key).framebuffer for key in "bp"] == ["final"] * 2
    assert not live.closed
    assert press(live, "escape").closed
    assert press(Live(Pyramid(), None), "q").closed


def test_time_passes_unless_it_is_paused() -> None:
    live = Live(Separable(), None)
    live.advance(2.0)
    assert live.time == 0.25
    press(live, "space").advance(2.0)
    assert live.time == 0.25
    assert "paused" in live.title(0.02)
    press(live, "space").advance(7.0)
    assert live.time == 0.125


def test_the_title_has_the_values() -> None:
    assert Live(Separable(), None).title(0.02) == ("final: separable | 20.0 ms, 50 frames/s")
    assert "no bloom" in Live(Separable(bloom=False), None).title(0.02)


def test_a_window_is_controlled_by_keys(display: dict[str, str], tmp_path: Path) -> None:
    # (The fourth framebuffer is gone without bloom.)
    keys = "B,B,4,B,1,P,SPACE,Q"
    done = python("-m", "tests.cli.keys", keys, "--size", "64x36", cwd=ROOT, **display)
    assert done.returncode == 0, done.stderr
    picture = str(vkbloom.write(tmp_path / "a.png", np.full((9, 16, 3), 0.5, np.float32)))
    done = python("-m", "tests.cli.keys", "2,SPACE,ESCAPE", picture, cwd=ROOT, **display)
    assert done.returncode == 0, done.stderr


def test_without_a_display_it_says_so() -> None:
    pytest.importorskip("glfw")
    done = python("-m", "vkbloom._cli", "view", DISPLAY="", WAYLAND_DISPLAY="")
    assert (done.returncode, done.stdout) == (1, "")
    assert "no window was opened: " in done.stderr
    assert "use vkbloom explore" in done.stderr
