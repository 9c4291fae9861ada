"""``vkbloom render``: render a scene to image files."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from vkbloom._cli import no_bloom
from vkbloom._cli.fields import SIZE, Command
from vkbloom._cli.program import adapter_option, as_wrong_use
from vkbloom._cli.scene_options import scene_options
from vkbloom._cli.settings_options import taa_option, timed_settings_options
from vkbloom._cli.terminal import note, say, tell_device
from vkbloom._framebuffers import leading
from vkbloom._renderer import frame_files
from vkbloom._renderer.interruptible import open_renderer
from vkbloom._scene import Scene
from vkbloom._settings.settings import SHADINGS, Settings, Shading


@click.command(cls=Command)
@click.option(
    "-o",
    "--out",
    required=True,
    type=click.Path(),
    help="The file or folder to write to. NAME.exr is one file with all framebuffers. Of another "
    "format, NAME.png is final, and NAME_glow.png and others are beside it. A name without "
    "extension is a folder of PNG files. A framebuffer that the format cannot hold is written as "
    ".exr.",
)
@click.option("--size", type=SIZE, default="1280x720", help="Size of the frame, in pixels.")
@click.option("--time", default=0.0, help="Time of the animation; its period is 1.")
@click.option("--shading", type=click.Choice(SHADINGS), default=SHADINGS[0])
@click.option("--framebuffers", metavar="all|NAME,...", default="all", help="What to write.")
@adapter_option
@scene_options
@taa_option
@timed_settings_options
def command(
    *,
    out: str,
    size: tuple[int, int],
    time: float,
    shading: Shading,
    framebuffers: str,
    adapter: str,
    scene: Callable[[], Scene],
    settings: Settings,
    stages: dict[str, Any],
) -> None:
    """Render a scene with its bloom and write the framebuffers.

    vkbloom grid --axis time=0:1:60 renders an animation.
    """
    if out == "-":
        raise click.UsageError("render does not write to a pipe; give --out a file or a folder")
    if "dt" in stages and "exposure" not in stages:
        raise click.UsageError("--dt is the step of an exposure; give --exposure NAME")
    names = "all" if framebuffers == "all" else framebuffers.split(",")
    loaded = scene()
    with open_renderer(adapter) as renderer:
        tell_device(renderer)
        with as_wrong_use():
            frames = renderer.render(
                loaded,
                settings,
                size,
                time=time,
                framebuffers=no_bloom.with_bloom(names, settings),
                shading=shading,
                **stages,
            )
            if loaded.glow is not None and no_bloom.is_without(frames):
                note(no_bloom.reason(settings))
            kept = no_bloom.only(frames, names)
            written = frame_files.save(kept, out, to_path=leading(kept))
        device = "CPU" if renderer.info.type == "cpu" else "GPU"
    say(f"  {'pass':<32}{f'ms on the {device}':>14}")
    for name, seconds in frames.timings.items():
        say(f"  {name:<32}{1e3 * seconds:14.3f}")
    for path in written:
        say(f"wrote {path}")
