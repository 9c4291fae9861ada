"""``vkbloom view``: show the bloom of a scene or an image in a window."""

from __future__ import annotations

import contextlib
import dataclasses
import time
from collections.abc import Callable, Iterator
from typing import Any, Final

import click
from numpy.typing import NDArray

import vkbloom
from vkbloom._checks import import_extra
from vkbloom._cli.fields import SIZE, Command
from vkbloom._cli.live_options import live_options
from vkbloom._renderer.surface import Surface
from vkbloom._settings.settings import SHADINGS, Settings, Shading

HELP: Final = """\
B              bloom on, off
1 ... 9        the framebuffer that is shown
P              the next preset
Space          pauses the animation
Q, Escape      close\
"""

_TURN_SECONDS: Final = 8.0


@dataclasses.dataclass
class Live:
    """The state of a window.

    - `shading`: Of a scene.
    - `framebuffer`: Name of the framebuffer that is shown.
    - `time`: Time of the animation, in periods.
    """

    settings: Settings
    source: Any
    shading: Shading = "forward"
    framebuffer: str = "final"
    time: float = 0.0
    paused: bool = False
    closed: bool = False

    def press(self, key: str, names: list[str]) -> None:
        """Do what a key stands for; `names` are the framebuffers that there are."""
        if key in "bp":
            # The next settings may lack the framebuffer.
            self.framebuffer = "final"
        if key == "b":
            self.settings = self.settings.replace(bloom=not self.settings.bloom)
        elif key in "123456789" and int(key) <= len(names):
            self.framebuffer = names[int(key) - 1]
        elif key == "p":
            known = list(vkbloom.presets.values())
            shown = known.index(self.settings) if self.settings in known else -1
            self.settings = known[(shown + 1) % len(known)]
        elif key == "space":
            self.paused = not self.paused
        elif key in ("q", "escape"):
            self.closed = True

    def advance(self, seconds: float) -> None:
        """Let time pass."""
        if not self.paused:
            self.time = (self.time + seconds / _TURN_SECONDS) % 1.0

    def title(self, seconds: float) -> str:
        """Return the text of the title; `seconds` is the time of a frame."""
        parts = [
            f"{self.framebuffer}: {self.settings.method}",
            *([] if self.settings.bloom else ["no bloom"]),
            *(["paused"] if self.paused else []),
            f"{seconds * 1e3:.1f} ms, {1 / seconds:.0f} frames/s",
        ]
        return " | ".join(parts)


_LARGEST: Final = (1600, 900)  # size of a window for an image
_TITLE_SECONDS: Final = 0.5  # between updates of the title
_WAIT_SECONDS: Final = 0.1  # while the window is hidden
_KEYS: Final = ("SPACE", "ESCAPE", *"BPQ", *"123456789")


@click.command(cls=Command, epilog=f"\b\n{HELP}")
@click.option("--size", type=SIZE, help="Of the window [default: 1280x720, or the image's size]")
@click.option("--shading", type=click.Choice(SHADINGS), default="forward")
@live_options(image_has_size=True)
def command(
    *,
    image: NDArray[Any] | None,
    origin: dict[str, Any],
    size: tuple[int, int] | None,
    shading: Shading,
    adapter: str,
    scene: Callable[[], vkbloom.Scene],
    settings: vkbloom.Settings,
) -> None:
    """Show the bloom of IMAGE, or of a scene, in a window with live controls."""
    glfw = import_extra("glfw", "window", "view")
    height, width = (720, 1280) if image is None else image.shape[:2]
    loaded = scene() if image is None else image
    with (
        _opened(glfw, size or (min(width, _LARGEST[0]), min(height, _LARGEST[1]))) as window,
        vkbloom.Renderer(adapter) as renderer,
        Surface(renderer, window) as surface,
    ):
        source = loaded if isinstance(loaded, vkbloom.Scene) else renderer.upload(loaded)
        live = Live(settings, source, shading)
        _listen(glfw, window, renderer, live)
        since = before = time.perf_counter()
        shown = 0
        while not (live.closed or glfw.window_should_close(window)):
            options: dict[str, Any] = {"shading": live.shading, "time": live.time}
            if surface.present(live.source, live.settings, framebuffer=live.framebuffer, **options):
                shown += 1
            else:
                glfw.wait_events_timeout(_WAIT_SECONDS)
            glfw.poll_events()
            now = time.perf_counter()
            live.advance(now - before)
            before = now
            if shown and now - since >= _TITLE_SECONDS:
                glfw.set_window_title(window, live.title((now - since) / shown))
                since, shown = now, 0


@contextlib.contextmanager
def _opened(glfw: Any, size: tuple[int, int]) -> Iterator[Any]:
    """Open a window without an OpenGL context."""
    glfw.ERROR_REPORTING = "ignore"  # The last error is asked for.
    try:
        window = None
        if glfw.init():
            glfw.window_hint(glfw.CLIENT_API, glfw.NO_API)
            window = glfw.create_window(*size, "vkbloom", None, None)
        if not window:
            raise vkbloom.Error(f"no window was opened: {glfw.get_error()[1].decode()}")
        yield window
    finally:
        glfw.terminate()


def _listen(glfw: Any, window: Any, renderer: vkbloom.Renderer, live: Live) -> None:
    """Connect keys to the state."""
    keys = {getattr(glfw, f"KEY_{name}"): name.lower() for name in _KEYS}

    def on_key(_: Any, key: int, code: int, action: int, mods: int) -> None:
        if action != glfw.RELEASE and key in keys:
            outputs = renderer.plan(live.source, live.settings, shading=live.shading).framebuffers
            colours = [name for name, (shape, _) in outputs.items() if len(shape) == 3]
            live.press(keys[key], colours)

    glfw.set_key_callback(window, on_key)
