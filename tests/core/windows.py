"""What a process does that opens windows: ``python -m tests.core.windows [managed]``.

Of its own, since an instance that was made without a display has no windows. The window lies at the
upper left of a screen that has no window manager, or with ``managed`` one that adds nothing.
"""

from __future__ import annotations

import random
import sys
import time
from typing import Any

import glfw
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import ImageGrab

import vkbloom
from tests.images import picture
from vkbloom import Pyramid, Renderer, Separable
from vkbloom._renderer.surface import Surface
from vkbloom._views import pictures

UFO = vkbloom.Scene.ufo()
SIZE = (192, 108)
WINDOWS: list[Any] = []


def open_window(size: tuple[int, int] = SIZE) -> Any:
    glfw.init()
    glfw.window_hint(glfw.CLIENT_API, glfw.NO_API)
    glfw.window_hint(glfw.DECORATED, glfw.FALSE)
    window = glfw.create_window(*size, "vkbloom", None, None)
    glfw.set_window_pos(window, 0, 0)
    WINDOWS.append(window)
    return window


def settle(window: Any, size: tuple[int, int]) -> None:
    """Wait until the window has its size."""
    for _ in range(500):
        glfw.poll_events()
        if glfw.get_framebuffer_size(window) == size:
            return
        time.sleep(0.01)
    raise AssertionError(f"the window is not {size}")


def difference(expected: NDArray[np.uint8], most: int = 0) -> int:
    """Return by how many levels the screen differs, where that is more once it had its time."""
    height, width = expected.shape[:2]
    for _ in range(300):
        screen = np.asarray(ImageGrab.grab(xdisplay=None))[:height, :width, :3]
        found = int(np.abs(screen.astype(np.int16) - expected[..., :3]).max())
        if found <= most:
            break
        time.sleep(0.01)
    return found


def pixels(renderer: Renderer) -> None:
    """Every framebuffer that has colours."""
    window = open_window()
    with Surface(renderer, window) as surface:
        for step in range(4):
            assert surface.present(UFO, time=step / 4)
        assert difference(renderer.render(UFO, size=SIZE, time=0.75)["final"]) == 0
    with Surface(renderer, window) as surface:
        for name in ("brightness", "scene", "albedo"):
            assert surface.present(UFO, shading="deferred", framebuffer=name)
            frames = renderer.render(UFO, size=SIZE, shading="deferred", framebuffers=name)
            # The device's curve is not the exact one.
            assert difference(pictures.picture(np.minimum(frames[name], 1), name), 1) <= 1, name
        for settings in (Separable(bloom=False), Separable(bloom=False, exposure=1.0)):
            assert surface.present(UFO, settings)
            expected = renderer.render(UFO, settings, SIZE)["final"]
            assert difference(expected) == 0, settings
        settings = Separable(encoding="srgb", tonemap="aces")
        assert surface.present(UFO, settings, shading="deferred")
        frames = renderer.render(UFO, settings, SIZE, shading="deferred", framebuffers="final")
        assert difference(frames["final"]) == 0
        cases: tuple[tuple[Any, str, int], ...] = (
            ("none", "uint8", 0),
            ("none", "float16", 1),
            ("srgb", "float32", 1),
        )
        for encoding, dtype, most in cases:
            image = renderer.upload(picture(*SIZE, 3, dtype=dtype))
            bloom = Pyramid(levels=3, encoding=encoding)
            assert surface.present(image, bloom)
            shown = renderer.apply(image, bloom)["final"]
            # (A window clips each channel; pictures keep the hue.)
            clipped = shown if dtype == "uint8" else np.minimum(shown, 1)
            levels = pictures.picture(clipped, encoding=encoding)
            assert difference(levels, most) <= most, (encoding, dtype)
        # Above and below a frame of other proportions there is black.
        assert surface.present(UFO, size=(SIZE[0], 54))
        expected = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
        expected[27:81] = renderer.render(UFO, size=(SIZE[0], 54))["final"][..., :3]
        assert difference(expected) == 0


def resized(renderer: Renderer) -> None:
    """A hundred sizes, before and after a frame is shown, and while it is not to be seen."""
    window = open_window()
    dice = random.Random(4)
    with Surface(renderer, window) as surface:
        for step in range(100):
            glfw.set_window_size(window, dice.randrange(1, 300), dice.randrange(1, 300))
            if dice.random() < 0.1:
                glfw.hide_window(window)
                surface.present(UFO, time=step / 100, size=(32, 18))
                glfw.show_window(window)
            if dice.random() < 0.7:
                glfw.poll_events()
            for _ in range(dice.randrange(3)):
                surface.present(UFO, time=step / 100, size=(32, 18))
        glfw.set_window_size(window, *SIZE)
        settle(window, SIZE)
        assert surface.size == SIZE
        assert surface.present(UFO, time=0.5)
        assert difference(renderer.render(UFO, size=SIZE, time=0.5)["final"]) == 0


def minimize(window: Any, minimized: bool) -> None:
    """Ask until it is done: the manager may have begun after this process."""
    for _ in range(500):
        (glfw.iconify_window if minimized else glfw.restore_window)(window)
        glfw.wait_events_timeout(0.01)
        if bool(glfw.get_window_attrib(window, glfw.ICONIFIED)) is minimized:
            return
    raise AssertionError(f"minimized is not {minimized}")


def minimized(renderer: Renderer) -> None:
    """Minimized and restored while frames are in flight; frames meanwhile; closed so.

    A window manager has to do it.
    """
    window = open_window()
    for _ in range(3):
        with Surface(renderer, window) as surface:
            for step in range(3):
                surface.present(UFO, time=step / 3)
            glfw.iconify_window(window)
            for step in range(3):
                surface.present(UFO, time=step / 4)
            minimize(window, True)
            for step in range(3):
                surface.present(UFO, time=step / 5)
            glfw.restore_window(window)
            surface.present(UFO)
            minimize(window, False)
            assert surface.present(UFO, time=0.5)
            assert difference(renderer.render(UFO, size=SIZE, time=0.5)["final"]) == 0
            surface.present(UFO)
            minimize(window, True)
            surface.present(UFO)
        minimize(window, False)


def closed_while_busy(renderer: Renderer) -> None:
    """The surface, then the renderer with a surface; each after frames that nobody waited for."""
    window = open_window()
    for _ in range(3):
        with Surface(renderer, window) as surface:
            assert surface.present(UFO)
            assert surface.present(UFO, time=0.5)
    with Renderer("software", validation=True) as other:
        left = Surface(other, window)
        assert left.present(UFO)
        assert left.present(UFO, time=0.5)
    left.close()
    with pytest.raises(ValueError, match="closed"):
        left.present(UFO)


def two_windows(renderer: Renderer) -> None:
    first, second = open_window((64, 36)), open_window((64, 36))
    glfw.set_window_pos(second, 64, 0)
    with Surface(renderer, first) as left, Surface(renderer, second) as right:
        for step in range(4):
            assert left.present(UFO, time=step / 4)
            assert right.present(UFO, time=step / 8)
        frames = [renderer.render(UFO, size=(64, 36), time=at)["final"] for at in (0.75, 0.375)]
        assert difference(np.concatenate(frames, axis=1)) == 0


def main() -> None:
    alone = (pixels, resized, closed_while_busy, two_windows)
    with Renderer("software", validation=True) as renderer:
        for work in (minimized,) if sys.argv[1:] == ["managed"] else alone:
            work(renderer)
            while WINDOWS:
                glfw.destroy_window(WINDOWS.pop())
    # Once: Mesa keeps the connection to the display for as long as the process lives.
    glfw.terminate()


if __name__ == "__main__":
    main()
