"""Surfaces: what they show is what arrays hold; sizes change, windows close, calls are refused."""

from __future__ import annotations

import contextlib
import itertools
import shutil
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import vkbloom
from tests.core.builds import ROOT
from tests.processes import output
from tests.refusals import assert_refused, rows
from vkbloom import Renderer, Scene, Separable, _core
from vkbloom._renderer.surface import Surface

SIZE = (48, 27)

# Windows are where they want to be, without borders. Text is in the font that every server has.
MANAGER = """
RandomPlacement
NoTitle
BorderWidth 0
UsePPosition "on"
TitleFont "fixed"
MenuFont "fixed"
IconFont "fixed"
ResizeFont "fixed"
IconManagerFont "fixed"
"""


def open_or_skip(renderer: Renderer) -> Surface:
    try:
        return Surface(renderer, size=SIZE)
    except vkbloom.Error as error:
        pytest.skip(str(error))


@pytest.fixture
def surface(renderer: Renderer) -> Iterator[Surface]:
    """A surface without a window."""
    with open_or_skip(renderer) as opened:
        yield opened


def run_windows(display: dict[str, str], *arguments: str) -> None:
    output("-m", "tests.core.windows", *arguments, cwd=ROOT, **display)


def test_windows(display: dict[str, str]) -> None:
    run_windows(display)


def test_windows_are_minimized(display: dict[str, str], tmp_path: Path) -> None:
    if shutil.which("twm") is None:
        pytest.skip("there is no window manager, which minimizes windows (Debian: twm)")
    rules = tmp_path / "rules"
    rules.write_text(MANAGER)
    environment = {**display, "LC_ALL": "C"}
    with subprocess.Popen(["twm", "-f", rules], env=environment) as manager:
        try:
            run_windows(display, "managed")
        finally:
            manager.terminate()


def test_frames_are_presented_and_stay_as_they_were(
    surface: Surface, renderer: Renderer, scene: Scene
) -> None:
    before = renderer.render(scene, size=SIZE)["final"]
    assert all(surface.present(scene, time=step / 6) for step in range(6))
    np.testing.assert_array_equal(renderer.render(scene, size=SIZE)["final"], before)


def test_ctrl_c_ends_a_wait(surface: Surface, scene: Scene) -> None:
    class Alarm(BaseException):
        pass

    def handler(number: int, frame: object) -> None:
        raise Alarm

    before = signal.signal(signal.SIGALRM, handler)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        with pytest.raises(Alarm):  # noqa: PT012
            for settings in itertools.repeat(Separable(loops=8, bloom_scale=1.0)):
                surface.present(scene, settings, size=(640, 360))
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    assert surface.present(scene)


def test_a_closed_surface_is_refused(surface: Surface, scene: Scene) -> None:
    surface.close()
    surface.close()
    with pytest.raises(ValueError, match="the surface is closed"):
        surface.present(scene)


@pytest.mark.parametrize(("call", "error"), rows(__file__, "surfaces"))
def test_a_wrong_value_is_refused(surface: Surface, scene: Scene, call: str, error: str) -> None:
    assert_refused(call, error, {"surface": surface, "scene": scene})
    assert surface.present(scene)


def test_without_the_extension_an_error_says_so(renderer: Renderer) -> None:
    with contextlib.suppress(_core.Error):
        Surface(renderer).close()
        pytest.skip("the driver has VK_EXT_headless_surface")
    with pytest.raises(_core.Error, match="needs VK_EXT_headless_surface, which the driver of"):
        Surface(renderer)
