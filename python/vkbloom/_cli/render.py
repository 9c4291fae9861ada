"""``vkbloom render``: render a scene or its animation to image files."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import click
from tqdm import tqdm

import vkbloom
from vkbloom._cli import no_bloom
from vkbloom._cli.device_options import device_options
from vkbloom._cli.fields import SIZE, Command
from vkbloom._cli.program import as_wrong_use
from vkbloom._cli.scene_options import scene_options
from vkbloom._cli.settings_options import settings_options
from vkbloom._cli.terminal import hides_progress, note, say, tell_device
from vkbloom._settings.settings import SHADINGS, Shading


@click.command(cls=Command)
@click.option(
    "-o",
    "--out",
    required=True,
    type=click.Path(),
    help="The file or folder to write to. NAME.exr is one file with all framebuffers. Other "
    "formats have a file for each framebuffer. A name without extension is a folder of PNG files. "
    "A framebuffer that the format cannot hold is written as .exr.",
)
@click.option("--size", type=SIZE, default="1280x720", help="Size of the frame, in pixels.")
@click.option("--time", default=0.0, help="Time of the animation; its period is 1.")
@click.option(
    "--frames",
    "count",
    metavar="N",
    type=click.IntRange(min=1),
    help="Render N frames of one period of the animation, starting at --time, to numbered files.",
)
@click.option("--shading", type=click.Choice(SHADINGS), default=SHADINGS[0])
@click.option(
    "--framebuffers",
    metavar="all|NAME,...",
    help="The framebuffers to write [default all; final for an animation]",
)
@device_options
@scene_options
@settings_options
def command(
    *,
    out: str,
    size: tuple[int, int],
    time: float,
    count: int | None,
    shading: Shading,
    framebuffers: str | None,
    adapter: str,
    validation: bool,
    scene: Callable[[], vkbloom.Scene],
    settings: vkbloom.Settings,
) -> None:
    """Render a scene with its bloom and write the framebuffers."""
    if out == "-":
        raise click.UsageError("render does not write to a pipe; give --out a file or a folder")
    wanted = framebuffers or ("all" if count is None else "final")
    names = wanted if wanted == "all" else wanted.split(",")
    loaded = scene()
    written: list[Path] = []
    seconds: dict[str, list[float]] = {}
    with vkbloom.Renderer(adapter, validation=validation) as renderer:
        tell_device(renderer)
        disable = True if count is None else hides_progress()
        turn = tqdm(range(count or 1), unit="frame", leave=False, disable=disable)
        for index in turn:
            with as_wrong_use():
                frames = renderer.render(
                    loaded,
                    settings,
                    size,
                    time=time + index / (count or 1),
                    # The first frame of an animation shows whether there is a bloom.
                    framebuffers=names if index else no_bloom.with_bloom(names, settings),
                    shading=shading,
                )
                if index == 0 and loaded.glow is not None and no_bloom.is_without(frames):
                    note(no_bloom.reason(settings))
                shown = no_bloom.only(frames, names)
                target = out if count is None else _numbered(out, index, count)
                written += shown.save(target)
            for name, duration in frames.timings.items():
                seconds.setdefault(name, []).append(duration)
    times = _times(seconds, "CPU" if renderer.info.type == "cpu" else "GPU")
    for line in [*times, *_listed(written, is_animation=count is not None)]:
        say(line)


def _numbered(out: str, index: int, count: int) -> Path:
    """Return the file of one frame of an animation; create the folder if `out` is a folder."""
    target = Path(out)
    number = f"{index:0{max(4, len(str(count - 1)))}}"
    if target.is_dir() or not target.suffix or out.endswith(("/", os.sep)):
        target.mkdir(parents=True, exist_ok=True)
        return target / f"{number}.png"
    return target.with_name(f"{target.stem}_{number}{target.suffix}")


def _times(seconds: dict[str, list[float]], device: str) -> list[str]:
    """Return a table of each pass's mean time over the frames in which it ran."""
    lines = [f"  {'pass':<32}{f'ms on the {device}':>14}{'runs':>8}"]
    for name, durations in seconds.items():
        mean = sum(durations) / len(durations)
        lines.append(f"  {name:<32}{1e3 * mean:14.3f}{len(durations):8}")
    return lines


def _listed(written: list[Path], *, is_animation: bool) -> list[str]:
    if not is_animation or len(written) < 3:
        return [f"wrote {path}" for path in written]
    return [f"wrote {len(written)} files, {written[0]} to {written[-1]}"]
