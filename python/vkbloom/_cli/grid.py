"""``vkbloom grid``: render all combinations of axis values to a Zarr store or image files."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import click

import vkbloom
from vkbloom._cli import fields, image_files, no_bloom, program, terminal
from vkbloom._cli.axis_options import axis_values
from vkbloom._cli.device_options import device_options
from vkbloom._cli.scene_options import scene_options
from vkbloom._cli.settings_options import DEFAULT_PRESETS, settings_options
from vkbloom._grid import filling, identity, layout, order, progress, sources
from vkbloom._io import image_writing, safe_writing
from vkbloom._io.images import Picture
from vkbloom._renderer.frame_files import settings_facts
from vkbloom._renderer.interruptible import opened_renderer
from vkbloom._settings.settings import SHADINGS


@click.command(cls=fields.Command)
@click.argument("images", metavar="[IMAGE]...", nargs=-1, type=click.Path())
@click.option("-o", "--out", required=True, type=click.Path(), help="NAME.zarr, or a folder")
@click.option("--axis", "words", metavar="NAME=VALUES", multiple=True, help="Values, as above")
@click.option("--size", type=fields.SIZE, help="Size of a scene's frames [default 1280x720]")
@click.option("--time", default=0.0, help="Time of a scene's animation; its period is 1.")
@click.option("--shading", type=click.Choice(SHADINGS), default=SHADINGS[0])
@click.option("--framebuffers", metavar="all|NAME,...", default="final")
@click.option("--image-format", metavar="EXTENSION", default="png")
@click.option("--resume/--no-resume", default=True, help="Continue a grid that is there")
@click.option("--part", metavar="I/N", help="Render part I of N, from 1, as above")
@image_files.input_colour_option
@image_files.subimage_option
@image_files.layer_option
@image_files.expand_option
@device_options
@scene_options
@settings_options
def command(*, images: tuple[str, ...], out: str, words: tuple[str, ...], **given: Any) -> None:
    """Render all combinations of the axes' values.

    The source is a scene, or each IMAGE, read as vkbloom apply reads it: files of integers (JPEG,
    PNG) start from the preset photo and are expanded, except with an axis of presets. The points of
    the grid are rendered in the order that runs the fewest passes. A store can be opened while it
    is written. The same call again continues a grid that was killed, and gives the same result.

    The NAME of an axis is a settings field, time or preset. Its values are FIRST:LAST:COUNT,
    FIRST:LAST:COUNT:log, or A,B,... (A;B;... if values contain commas). Repeat --axis for more
    axes; the dimensions have the order of the options.

    Other processes may render other parts at the same time.
    """
    is_store = out.endswith(".zarr")
    suffix = f".{given['image_format'].lstrip('.')}"
    with program.as_wrong_use():
        image_writing.check_writable(f"image{suffix}")
        part = order.read_part(given["part"])
    if not is_store and Path(out).suffix and not Path(out).is_dir():
        hint = f"name a folder, and give --image-format {Path(out).suffix[1:]}"
        raise click.UsageError(f"--out: {out} is not NAME.zarr; for an image of each point {hint}")
    if not words and len(images) < 2:
        raise click.UsageError("there is no --axis; give one, such as exposure=-1:1:5")
    settings: vkbloom.Settings | None = given["settings"]
    axes = axis_values(words, given["settings"])
    if "preset" in axes:
        if settings not in map(vkbloom.presets.get, DEFAULT_PRESETS):
            raise click.UsageError("--axis preset sets all settings; leave out options of settings")
        settings = None
    # The presets of an axis differ in whether they expand.
    expand: float | None = given["expand"] if settings or program.given("expand") else None
    pictures, source = _source(images, expand, given)
    names = given["framebuffers"].split(",")
    shared = {name: given[name] for name in ("size", "shading", "time")}
    shared["framebuffers"] = "all" if names == ["all"] else names
    with program.as_wrong_use():
        grid = layout.ask(source, settings, axes, reduce=None, **shared)
    how: dict[str, Any] = {"resume": given["resume"] or given["part"] is not None, "part": part}
    _note_no_bloom(grid, given["adapter"], given["validation"])
    with opened_renderer(given["adapter"], given["validation"]) as renderer:
        if is_store:
            how |= {"store": out, "progress": not terminal.is_quiet()}
            stored = vkbloom.grid(source, settings, axes, renderer=renderer, **shared, **how)
            ran = stored.attrs["passes_run"]
        else:
            how |= {"suffix": suffix, "pictures": pictures, "expand": expand}
            ran = _write_images(grid, out, renderer, **how)
    which = f"part {part[0]}/{part[1]} of " if given["part"] else ""
    points = math.prod(grid.shape)
    terminal.say(f"wrote {out}, {which}{points} points; passes run {ran}")


def _source(
    images: Sequence[str],
    expand: float | None,
    given: Mapping[str, Any],
) -> tuple[list[Picture], Any]:
    """Return the pictures, and the source of the grid."""
    if not images:
        return [], given["scene"]()
    colour, reading = given["input_colour"], {n: given[n] for n in ("subimage", "layer")}
    reading["expand"] = expand
    pictures = [image_files.read_picture(image, colour=colour, **reading) for image in images]
    # Labels are the file names, or numbers if a file is given twice.
    labels = images if len(set(images)) == len(images) else range(len(images))
    named = {str(label): item.pixels for label, item in zip(labels, pictures, strict=True)}
    return pictures, named if len(images) > 1 else pictures[0].pixels


def _note_no_bloom(grid: layout.Grid, adapter: str, validation: bool) -> None:
    """Print a note if the first and the last point of a grid have no bloom."""
    corners = {tuple(0 for _ in grid.shape), tuple(count - 1 for count in grid.shape)}
    lit = [point for point in map(grid.point, sorted(corners)) if point.settings.bloom]
    # A renderer of its own, so that the passes of the grid are counted from the first.
    with vkbloom.Renderer(adapter, validation=validation) as renderer:
        frames = [frames for _, frames in sources.visit(renderer, grid.source, lit, ("bloom",))]
    if lit and all(map(no_bloom.is_without, frames)):
        terminal.note(f"at the first and the last point, {no_bloom.reason(lit[-1].settings)}")


def prepare(folder: Path, wanted: Mapping[str, Any], *, resume: bool) -> None:
    """Create a folder for the images of a grid with this identity, or examine an existing one."""
    folder.mkdir(parents=True, exist_ok=True)
    index = folder / "grid.json"
    if all(safe_writing.is_temporary(path) for path in folder.iterdir()):
        safe_writing.write_file(index, json.dumps(wanted, indent=1).encode())
    elif not index.exists():
        raise ValueError(f"{folder}: the folder is not empty, and its content is not a grid")
    elif not resume:
        raise FileExistsError(f"{folder}: already has a grid; resume it, or name another folder")
    try:
        result = identity.differences(json.loads(index.read_bytes()), wanted)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{index}: damaged, {error}") from error
    if result:
        raise ValueError(f"{folder}: contains another grid; {'; '.join(result)}")


def _write_images(grid: layout.Grid, target: str, renderer: vkbloom.Renderer, **how: Any) -> int:
    """Write a part's points as ``<index along each axis>_<framebuffer>``; return passes run.

    A framebuffer that the format cannot hold is written as ``.exr``.
    """
    laid = layout.lay_out(grid, renderer)
    out, suffix, pictures = Path(target), how["suffix"], how["pictures"]
    prepare(out, identity.identity(grid, laid, ()) | {"suffix": suffix}, resume=how["resume"])
    single = (1,) * len(grid.shape)
    points = [block.start for block in order.blocks(grid.shape, single, laid.ranking, how["part"])]
    digits = [max(3, len(str(count - 1))) for count in grid.shape]
    stems = {index: "".join(map("{:0{}}_".format, index, digits)) for index in points}
    there = {path.stem for path in out.iterdir()}
    todo = [i for i in points if not {f"{stems[i]}{name}" for name in laid.variables} <= there]
    done = len(points) - len(todo)
    with progress.Progress(len(points), done, shown=not terminal.is_quiet()) as bar:
        path = map(grid.point, todo)
        for index, frames in sources.visit(renderer, grid.source, path, grid.wanted):
            picture = pictures[int(grid.point(index).entry)] if pictures else None
            _save(
                frames,
                {name: out / f"{stems[index]}{name}{suffix}" for name in frames},
                picture,
                how["expand"],
            )
            bar.add(filling.Tally(1, len(frames.timings)))
    return bar.tally.ran


def _save(
    frames: vkbloom.Frames,
    files: Mapping[str, Path],
    picture: Picture | None,
    expand: float | None,
) -> None:
    """Write a point's files, each atomically."""
    settings, info = frames.settings, frames.info
    for name, path in files.items():
        if name == "final" and picture is not None:
            encoding = picture.encoding if settings.encoding == "none" else settings.encoding
            final = Picture.of_values(frames[name], picture.numbers, encoding)
            facts = settings_facts(settings, expand)
            image_writing.save(dataclasses.replace(final, grey=picture.grey), path, None, facts)
        else:
            # Without the timings, so that the same call writes the same file.
            vkbloom.Frames({name: frames[name]}, timings={}, settings=settings, info=info).save(
                path
            )
