"""``vkbloom view``, ``explore``: an image or a scene with live controls."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import functools
import math
import signal
import time
import webbrowser
from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from pathlib import PurePath
from typing import Any, Final, NamedTuple

import click
from numpy.typing import NDArray

from vkbloom._cli import sequences
from vkbloom._cli.fields import SIZE, Command
from vkbloom._cli.image_files import read_picture, reading_options
from vkbloom._cli.interrupts import INTERRUPTED
from vkbloom._cli.program import adapter_option, as_wrong_use, is_given
from vkbloom._cli.scene_options import scene_options
from vkbloom._cli.sequences import is_stream
from vkbloom._cli.settings_options import (
    STARTS,
    StartOptions,
    start_options,
    taa_option,
)
from vkbloom._cli.terminal import is_quiet, note, say, tell_device
from vkbloom._cli.videos import Rate
from vkbloom._errors import Error
from vkbloom._explorer.playing import ONLY_OF_SEQUENCES, Clip, open_clip
from vkbloom._explorer.viewer import GLOW, Viewer
from vkbloom._extras import import_extra
from vkbloom._io import image_file
from vkbloom._io.numbered_files import as_frames, gap_note
from vkbloom._io.picture import Picture
from vkbloom._io.video.reading import is_video
from vkbloom._presets.start import PRESET_OF_SCENES, Start, start_of
from vkbloom._renderer.interruptible import open_renderer
from vkbloom._renderer.renderer import Renderer
from vkbloom._renderer.surface import Surface
from vkbloom._scene import Scene
from vkbloom._sequence.inputs import TURN_SECONDS
from vkbloom._settings.settings import SHADINGS, Settings, Shading, presets

#: Options of a scene, by the names of their parameters.
_OF_SCENE: Final = {"base": "--scene", "shading": "--shading"}
HELP: Final = """\
B              bloom on, off
1 ... 9        the framebuffer that is shown
P              the next preset
Space          pauses the animation
Q, Escape      close\
"""
_STORED: Final = (640, 640)  # what the frames of a page of stored pictures fit into
_MAX_WINDOW: Final = (1600, 900)  # size of a window for an image
_TITLE_SECONDS: Final = 0.5  # between updates of the title
_WAIT_SECONDS: Final = 0.1  # while the window is hidden
_KEYS: Final = ("SPACE", "ESCAPE", *"BPQ", *"123456789")


class Opened(NamedTuple):
    """An IMAGE: as decoded, its file ("" for a stream), and what it is expanded up to.

    - `is_fixed`: Whether the call says the expansion, so that another preset does not change it.
    - `clip`: The frames in time of which the picture is the first; None: it is a still.
    """

    picture: Picture
    file: str
    expand: float | None
    is_fixed: bool
    clip: Clip | None = None

    def pixels(self, settings: Settings) -> NDArray[Any]:
        """Return what a renderer gets with these settings."""
        return Start(settings, self.expand).develop(self.picture).pixels

    def with_preset(self, settings: Settings) -> Opened:
        """Return the image as it starts with the settings of a preset."""
        if self.is_fixed:
            return self
        return self._replace(expand=start_of(self.picture.highlights, settings).expand)


def _live_options(command: Callable[..., Any], *, plays: bool = False) -> Callable[..., Any]:
    """Add IMAGE and its options, and those of the device, the scene and the settings.

    The command gets as `opened` IMAGE, or None for a scene.

    - `plays`: IMAGE may be a sequence; the command gets as `timing` the keywords of `open_clip`.
    """

    def add_settings(run: Callable[..., Any]) -> Callable[..., Any]:
        return start_options(run, is_timed=plays)

    @click.argument("source", metavar="[IMAGE]", required=False, type=click.Path())
    @reading_options
    @adapter_option
    @scene_options
    @add_settings
    @functools.wraps(command)
    def run(
        *,
        source: str | None,
        subimage: int,
        layer: str | None,
        expand: float | None,
        start: StartOptions,
        **arguments: Any,
    ) -> Any:
        timing: dict[str, Any] | None = None
        if plays:
            timing = arguments["timing"] = _timing_of(start, arguments.pop("fps"))
        if source is None:
            if is_given("expand"):
                raise click.UsageError("--expand is only for an IMAGE")
            return command(opened=None, settings=start.of_file("").settings, **arguments)
        for name, option in _OF_SCENE.items():
            _check_is_scene(name, option)
        clip = None
        if timing is not None:
            read_file = functools.partial(image_file.read_picture, subimage=subimage, layer=layer)
            clip = _open_clip(source, timing, read_file)
        if clip is None:
            begun = start.of_file(source)
            picture = read_picture(source, subimage, None, layer=layer)
        else:
            picture = clip.decoded(0)
            begun = start.of(picture.highlights)
        file = "" if is_stream(source) else source
        opened = Opened(picture, file, begun.expand, is_given("expand"), clip)
        return command(opened=opened, settings=begun.settings, **arguments)

    return run


def _open_clip(
    source: str, timing: Mapping[str, Any], read_file: Callable[[str], Picture]
) -> Clip | None:
    """Return the frames of a video, a pattern, a folder or a glob; None: IMAGE is a still."""
    if is_video(source):
        return open_clip(source, **timing)
    files = as_frames(sequences.expand(source))
    if files == [(source, None)]:
        for name, value in timing.items():
            if value is not None and is_given(name):
                raise click.UsageError(f"--{name}: {ONLY_OF_SEQUENCES}")
        return None
    if (missing := gap_note(files)) is not None:
        note(f"{source}: {missing}; they are time in which the frame before stays")
    return open_clip(files, **timing, read_file=read_file)


def _timing_of(start: StartOptions, fps: Fraction | None) -> dict[str, Any]:
    """Return the keywords of `open_clip` that a call gives, or the file of its settings."""
    stages = {name: start.stages.get(name) for name in ("exposure", "taa")}
    return {**stages, "fps": None if fps is None else float(fps)}


def _check_is_scene(name: str, option: str) -> None:
    if is_given(name):
        raise click.UsageError(f"{option} is only for scenes; leave it out with an IMAGE")


@dataclasses.dataclass
class Live:
    """The state of a window.

    - `shading`: Of a scene.
    - `framebuffer`: Name of the framebuffer that is shown.
    - `time`: Time of the animation, in periods.
    - `opened`: The image, if it is none of a scene.
    """

    settings: Settings
    source: Any
    shading: Shading = "forward"
    framebuffer: str = "final"
    time: float = 0.0
    paused: bool = False
    closed: bool = False
    opened: Opened | None = None

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
            known = list(presets.values())
            shown = known.index(self.settings) if self.settings in known else -1
            self.settings = known[(shown + 1) % len(known)]
            if self.opened is not None:
                self.opened = self.opened.with_preset(self.settings)
        elif key == "space":
            self.paused = not self.paused
        elif key in ("q", "escape"):
            self.closed = True

    def advance(self, seconds: float) -> None:
        """Let time pass."""
        if not self.paused:
            self.time = (self.time + seconds / TURN_SECONDS) % 1.0

    def title(self, seconds: float) -> str:
        """Return the text of the title; `seconds` is the time of a frame."""
        parts = [
            f"{self.framebuffer}: {self.settings.method}",
            *([] if self.settings.bloom else ["no bloom"]),
            *(["paused"] if self.paused else []),
            f"{seconds * 1e3:.1f} ms, {1 / seconds:.0f} frames/s",
        ]
        return " | ".join(parts)


@click.command(cls=Command, epilog=f"\b\n{HELP}")
@click.option("--size", type=SIZE, help="Of the window [default: 1280x720, or the image's size]")
@click.option("--shading", type=click.Choice(SHADINGS), default="forward")
@_live_options
def view(
    *,
    opened: Opened | None,
    size: tuple[int, int] | None,
    shading: Shading,
    adapter: str,
    scene: Callable[[], Scene],
    settings: Settings,
) -> None:
    """Show the bloom of IMAGE, or of a scene, in a window with live controls."""
    glfw = import_extra("glfw", "window", "view")
    height, width = (720, 1280) if opened is None else opened.picture.pixels.shape[:2]
    loaded = scene() if opened is None else None
    with (
        _open_window(
            glfw, size or (min(width, _MAX_WINDOW[0]), min(height, _MAX_WINDOW[1]))
        ) as window,
        open_renderer(adapter) as renderer,
        Surface(renderer, window) as surface,
    ):
        live = Live(settings, loaded, shading, opened=opened)
        uploaded = _show(live, renderer, None)
        _listen(glfw, window, renderer, live)
        since = before = time.perf_counter()
        shown = 0
        while not (live.closed or glfw.window_should_close(window)):
            uploaded = _show(live, renderer, uploaded)
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


def _show(live: Live, renderer: Renderer, uploaded: object) -> object:
    """Upload the image for the settings, unless it is there; return what it depends on."""
    if live.opened is None:
        return None
    needed = live.opened.expand, live.settings.alpha != "keep"
    if needed != uploaded:
        live.source = renderer.upload(live.opened.pixels(live.settings))
    return needed


@contextlib.contextmanager
def _open_window(glfw: Any, size: tuple[int, int]) -> Iterator[Any]:
    """Open a window without an OpenGL context."""
    glfw.ERROR_REPORTING = "ignore"  # The last error is asked for.
    try:
        window = None
        if glfw.init():
            glfw.window_hint(glfw.CLIENT_API, glfw.NO_API)
            window = glfw.create_window(*size, "vkbloom", None, None)
        if not window:
            reason = glfw.get_error()[1].decode()
            raise Error(
                f"no window was opened: {reason}; without a display, use vkbloom explore, which "
                "shows the same in a browser"
            )
        yield window
    finally:
        glfw.terminate()


def _listen(glfw: Any, window: Any, renderer: Renderer, live: Live) -> None:
    """Connect keys to the state."""
    keys = {getattr(glfw, f"KEY_{name}"): name.lower() for name in _KEYS}

    def on_key(_: Any, key: int, code: int, action: int, mods: int) -> None:
        if action != glfw.RELEASE and key in keys:
            outputs = renderer.plan(live.source, live.settings, shading=live.shading).framebuffers
            colours = [name for name, (shape, _) in outputs.items() if len(shape) == 3]
            live.press(keys[key], colours)

    glfw.set_key_callback(window, on_key)


@click.command(cls=Command)
@click.option(
    "--static",
    "out",
    metavar="OUT",
    type=click.Path(),
    help="Write a page of stored pictures, to send to others: a new folder, or a file NAME.html.",
)
@click.option(
    "--axis",
    "words",
    metavar="NAME=VALUES",
    multiple=True,
    help="With --static: a slider and its values, as of vkbloom grid.  [default: three sliders]",
)
@click.option(
    "--port", type=click.IntRange(0, 65535), default=0, help="Of 127.0.0.1; 0: any free port."
)
@click.option("--open/--no-open", "opens", default=True, help="Whether to open a browser.")
@click.option(
    "--size", type=SIZE, default="1280x720", help="Of a scene's frame, which gives its aspect."
)
@click.option("--shading", type=click.Choice(SHADINGS), default="deferred")
@click.option(
    "--fps",
    type=Rate(),
    metavar="N",
    help="Frames per second of a sequence [default 24]; of a video, instead of its times.",
)
@taa_option
@functools.partial(_live_options, plays=True)
def explore(
    *,
    opened: Opened | None,
    out: str | None,
    words: tuple[str, ...],
    port: int,
    opens: bool,
    size: tuple[int, int],
    shading: Shading,
    adapter: str,
    scene: Callable[[], Scene],
    settings: Settings,
    timing: dict[str, Any],
) -> int:
    """Explore the bloom of IMAGE, or of a scene, in a browser with controls for all settings.

    The page is served on 127.0.0.1 until Ctrl-C, to every program that knows its address. IMAGE
    is decoded as vkbloom apply decodes it. It may be a sequence, which the page plays: a video, a
    pattern of numbers (f.%04d.exr), a folder or a glob. With --exposure NAME, --taa or --fps a
    scene is one, too: its animation. The built-in scene has lights 6 times as bright as
    white, unless --glow-intensity says otherwise. Without options of settings, a scene in deferred
    shading begins with the tone map "aces" and the encoding "srgb".

    With --static, nothing is served: OUT is the same page with stored pictures, which opens in any
    browser. Its sliders have a few values; the frame fits into 640 x 640 pixels, or into --size.
    """
    if out is None:
        import_extra("tornado", "notebook", "explore")
        if words:
            raise click.UsageError("--axis is only for a page of stored pictures; give --static")
    elif timing["fps"] or (timing["exposure"] or timing["taa"]) or (opened and opened.clip):
        raise click.UsageError("--static: a page of stored pictures has stills; name an image")
    looked_at: Scene | Picture
    begun: Settings | None = settings
    of_file: dict[str, Any] = {}
    if opened is not None:
        if out is None:
            _check_is_scene("size", "--size")
        looked_at = opened.picture
        # A page for others has no path of this machine.
        file = opened.file if out is None else PurePath(opened.file).name
        of_file = {"file": file, "expand": opened.expand, "clip": opened.clip}
    else:
        looked_at = scene()
        if not any(is_given(name) for name in ("base", "glow", "glow_intensity")):
            looked_at = dataclasses.replace(looked_at, glow_intensity=GLOW)
        of_file = {"clip": open_clip(looked_at, **timing)}
        if settings == presets[PRESET_OF_SCENES] and not any(is_given(name) for name in STARTS):
            begun = None
    with open_renderer(adapter) as renderer:

        def new_viewer() -> Viewer:
            how: dict[str, Any] = {"size": size, "shading": shading, "renderer": renderer}
            return Viewer(looked_at, begun, **how, **of_file)

        with as_wrong_use():
            # Checks the arguments, so that an error appears here and not on the page.
            viewer = new_viewer()
        tell_device(renderer)
        if out is not None:
            _store(viewer, out, words, size if is_given("size") else _STORED)
            return 0
        try:
            return asyncio.run(_serve(new_viewer, port, webbrowser.open if opens else _ignore))
        except KeyboardInterrupt:
            return INTERRUPTED


def _store(viewer: Viewer, out: str, words: Sequence[str], size: tuple[int, int]) -> None:
    """Write a page of stored pictures, with the axes that the call names."""
    from vkbloom._cli.grid import axis_values  # noqa: PLC0415  costs start-up time
    from vkbloom._explorer.stored import (  # noqa: PLC0415  costs start-up time
        StoredGrid,
        StoredSource,
        choose_axes,
        write_stored,
    )

    settings = viewer.settings["a"]
    if taken := {"alpha", "bloom", "preset", "time"} & {
        word.partition("=")[0].strip() for word in words
    }:
        raise click.UsageError(f"--axis: {taken.pop()} is no slider of a page of stored pictures")
    axes = axis_values(words, settings) if words else choose_axes(settings)
    name = next((name for name, preset in presets.items() if preset == settings), "")
    source = StoredSource(viewer.name, viewer, [StoredGrid(settings, axes, name)])
    with as_wrong_use():
        write_stored(out, [source], size=size, progress=not is_quiet())
    say(f"wrote {out}, {math.prod(map(len, axes.values()))} points")


def _ignore(_: str) -> None:
    """Leave it to the user to open the page."""


async def _serve(new_viewer: Callable[[], Viewer], port: int, show: Callable[[str], object]) -> int:
    """Serve the page until a signal comes, and return the exit status; `show` gets its address."""
    # Imported here because it needs tornado; `command` has checked that it is installed.
    from vkbloom._explorer.server import Server  # noqa: PLC0415

    server = Server(new_viewer, port)
    stopped: asyncio.Future[int] = asyncio.get_running_loop().create_future()

    def stop(status: int) -> None:
        if not stopped.done():
            stopped.set_result(status)

    # Without a handler, KeyboardInterrupt could be raised inside the event loop's own code.
    with contextlib.suppress(NotImplementedError):
        for number, status in ((signal.SIGINT, INTERRUPTED), (signal.SIGTERM, 0)):
            asyncio.get_running_loop().add_signal_handler(number, stop, status)
    click.echo(f"{server.url}\nPress Ctrl-C to stop.")
    show(server.redirect.as_uri())
    try:
        return await stopped
    finally:
        await server.stop()
