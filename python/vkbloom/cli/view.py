"""``vkbloom view``: a window that shows the bloom of a scene or an image, controlled by keys."""

from __future__ import annotations

import contextlib
import itertools
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final, Literal

import click
from numpy.typing import NDArray

import vkbloom
from vkbloom.checks import import_extra
from vkbloom.cli.fields import SIZE, Command
from vkbloom.cli.image_files import note
from vkbloom.cli.live import HELP, Live
from vkbloom.cli.live_options import live_options
from vkbloom.cli.program import given
from vkbloom.settings import SHADINGS, Shading

_LARGEST: Final = (1600, 900)  # size of a window for an image
_TITLE_SECONDS: Final = 0.5  # between updates of the title
_WAIT_SECONDS: Final = 0.1  # while the window is hidden
_KEYS: Final = ("UP", "DOWN", "LEFT", "RIGHT", "SPACE", "ESCAPE", *"BMPSQ", *"123456789")


@click.command(cls=Command, epilog=f"\b\n{HELP}")
@click.option(
    "--size",
    type=SIZE,
    default="1280x720",
    show_default="1280x720, or the image's size",
    help="Size of the window.",
)
@click.option("--shading", type=click.Choice(SHADINGS), default="forward", show_default=True)
@click.option(
    "--mode",
    type=click.Choice(("fifo", "mailbox")),
    default="fifo",
    show_default=True,
    help="fifo: a frame for each refresh of the screen; mailbox: the newest frame at each refresh.",
)
@click.option(
    "--frames",
    "count",
    metavar="N",
    type=click.IntRange(min=2),
    help="Close after N frames, and print the frame rate, without the first frame.",
)
@click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path),
    default="view",
    show_default=True,
    help="Folder of the screenshots.",
)
@live_options(image_has_size=True)
def command(
    *,
    image: NDArray[Any] | None,
    size: tuple[int, int],
    shading: Shading,
    mode: Literal["fifo", "mailbox"],
    count: int | None,
    out: Path,
    adapter: str,
    validation: bool,
    scene: Callable[[], vkbloom.Scene],
    settings: vkbloom.Settings,
) -> None:
    """Show the bloom of IMAGE, or of a scene, in a window with live controls."""
    glfw = import_extra("glfw", "window", "view")
    if image is not None and not given("size"):
        height, width = image.shape[:2]
        fit = min(1.0, _LARGEST[0] / width, _LARGEST[1] / height)
        size = (max(1, int(width * fit)), max(1, int(height * fit)))
    live = Live(settings, scene() if image is None else None)
    with (
        _opened(glfw, size) as window,
        vkbloom.Renderer(adapter, validation=validation) as renderer,
        vkbloom.Surface(renderer, window, mode=mode) as surface,
    ):
        uploaded = None if image is None else renderer.upload(image)
        view = _View(renderer, uploaded, live, shading)
        view.listen(glfw, window)
        begin = 0.0
        for number in view.frames(glfw, window, surface, out):
            if number == 1:
                # The first frame includes the compilation of shaders.
                begin = time.perf_counter()
            elif number == count:
                rate = (number - 1) / (time.perf_counter() - begin)
                click.echo(f"{number} frames: {rate:.1f} frames a second after the first one")
                break


@contextlib.contextmanager
def _opened(glfw: Any, size: tuple[int, int]) -> Iterator[Any]:
    """Open a window without an OpenGL context."""
    reasons: list[str] = []
    glfw.set_error_callback(lambda code, text: reasons.append(text.decode(errors="replace")))
    window = None
    try:
        if glfw.init():
            glfw.window_hint(glfw.CLIENT_API, glfw.NO_API)
            window = glfw.create_window(*size, "vkbloom", None, None)
        if not window:
            raise vkbloom.Error(f"no window was opened: {'; '.join(reasons) or 'unknown reason'}")
        yield window
    finally:
        glfw.terminate()


class _View:
    """Renders the state, which keys and the mouse change."""

    def __init__(
        self,
        renderer: vkbloom.Renderer,
        image: vkbloom.Image | None,
        live: Live,
        shading: Shading,
    ) -> None:
        self._renderer, self._image, self._live = renderer, image, live
        self._shading: dict[str, Any] = {} if image is not None else {"shading": shading}

    @property
    def _source(self) -> Any:
        return self._live.scene if self._image is None else self._image

    @property
    def _options(self) -> dict[str, Any]:
        return {**self._shading, "time": self._live.time} if self._shading else {}

    def _names(self) -> list[str]:
        """Return the framebuffers that can be shown."""
        plan = self._renderer.plan(self._source, self._live.settings, **self._shading)
        return [name for name, (shape, _) in plan.outputs.items() if len(shape) == 3]

    def _screenshot(self, folder: Path, size: tuple[int, int]) -> None:
        settings = self._live.settings
        if self._image is not None:
            frames = self._renderer.apply(self._image, settings)
        else:
            frames = self._renderer.render(self._source, settings, size, **self._options)
        for path in frames.save(folder):
            note(f"Wrote {path}")

    def listen(self, glfw: Any, window: Any) -> None:
        """Connect keys and the mouse to the state."""
        live = self._live
        keys = {getattr(glfw, f"KEY_{name}"): name.lower() for name in _KEYS}
        last = [0.0, 0.0]

        def on_key(_: Any, key: int, code: int, action: int, mods: int) -> None:
            if action != glfw.RELEASE and key in keys:
                live.press(keys[key], self._names())

        def on_move(_: Any, x: float, y: float) -> None:
            if glfw.get_mouse_button(window, glfw.MOUSE_BUTTON_LEFT) == glfw.PRESS:
                live.drag(x - last[0], y - last[1])
            last[:] = x, y

        glfw.set_key_callback(window, on_key)
        glfw.set_cursor_pos_callback(window, on_move)
        glfw.set_scroll_callback(window, lambda _, x, y: live.scroll(y))

    def frames(self, glfw: Any, window: Any, surface: vkbloom.Surface, out: Path) -> Iterator[int]:
        """Show frames until the window is closed; yield the number of each."""
        live = self._live
        pictures = itertools.count(1)
        since = before = time.perf_counter()
        shown = counted = 0
        glfw.set_window_title(window, live.title(0.0))
        while not (live.closed or glfw.window_should_close(window)):
            if surface.present(
                self._source, live.settings, attachment=live.framebuffer, **self._options
            ):
                shown += 1
                yield shown
            else:
                glfw.wait_events_timeout(_WAIT_SECONDS)
            glfw.poll_events()
            now = time.perf_counter()
            live.advance(now - before)
            before = now
            if now - since >= _TITLE_SECONDS and shown > counted:
                glfw.set_window_title(window, live.title((now - since) / (shown - counted)))
                since, counted = now, shown
            if live.screenshot:
                self._screenshot(out / f"{next(pictures):04}", surface.size)
                live.screenshot = False
