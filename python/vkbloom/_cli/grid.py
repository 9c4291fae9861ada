"""``vkbloom grid``: render all combinations of axis values to a Zarr store or image files."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import click
import numpy as np

from vkbloom._cli import fields, glows, image_files, no_bloom, program, terminal
from vkbloom._cli.scene_options import scene_options
from vkbloom._cli.settings_options import DEFAULT_PRESETS, taa_option, timed_settings_options
from vkbloom._grid import filling, layout, order, sources
from vkbloom._grid.grid import grid as render_grid
from vkbloom._io import image_writing, safe_writing
from vkbloom._io.decoding import keep_profile
from vkbloom._io.picture import Picture
from vkbloom._presets.start import Start
from vkbloom._renderer.frame_files import settings_facts
from vkbloom._renderer.frames import Frames
from vkbloom._renderer.interruptible import open_renderer
from vkbloom._renderer.renderer import Renderer
from vkbloom._settings.fields import fields_of
from vkbloom._settings.settings import SHADINGS, Settings, field_info, presets
from vkbloom._spelling import did_you_mean

_PRESETS: Final = fields.NameOf("preset", presets)


@click.command(cls=fields.Command)
@click.argument("source", metavar="[IMAGE]", required=False, type=click.Path())
@click.option("-o", "--out", type=click.Path(), help="NAME.zarr, or a folder of image files")
@click.option(
    "--store", metavar="PATH|URL", help="A store of any name or kind, such as s3://bucket/NAME.zarr"
)
@click.option("--axis", "words", metavar="NAME=VALUES", multiple=True, help="Values, as above")
@click.option("--size", type=fields.SIZE, help="Size of a scene's frames [default 1280x720]")
@click.option("--time", default=0.0, help="Time of a scene's animation; its period is 1.")
@click.option("--shading", type=click.Choice(SHADINGS), default=SHADINGS[0])
@click.option("--framebuffers", metavar="all|NAME,...", default="final")
@click.option("--image-format", metavar="EXTENSION", default="png")
@click.option("--part", metavar="I/N", help="Render part I of N, from 1, as above")
@image_files.input_colour_option
@image_files.reading_options
@glows.glow_options
@program.adapter_option
@scene_options
@taa_option
@timed_settings_options
def command(
    *, source: str | None, out: str | None, store: str | None, words: tuple[str, ...], **given: Any
) -> None:
    """Render all combinations of the axes' values.

    The source is a scene, or IMAGE, read as vkbloom apply reads it: files of integers (JPEG, PNG)
    start from the preset photo and are expanded, except with an axis of presets. The points of the
    grid are rendered in the order that runs the fewest passes. A store can be opened while it is
    written. The same call again continues a store whose process was killed, and gives the same
    result. In a folder, files are replaced.

    The NAME of an axis is a settings field, time, preset, exposure (of names), taa or dt. Its
    values are FIRST:LAST:COUNT, or A,B,... (A;B;... if values contain commas). Repeat --axis for
    more axes; the dimensions have the order of the options. With an exposure or --taa, points are
    no frames in time: each is one frame, --dt after the start.

    Other processes may render other parts at the same time.
    """
    suffix = f".{given['image_format'].lstrip('.')}"
    with program.as_wrong_use():
        safe_writing.writer_of(f"image{suffix}")
        part = order.read_part(given["part"])
    folder = _folder_of(out, store)
    target = str(store or out)
    if not words:
        raise click.UsageError("there is no --axis; give one, such as exposure=-1:1:5")
    settings: Settings | None = given["settings"]
    axes = axis_values(words, given["settings"])
    if "preset" in axes:
        if settings not in map(presets.get, DEFAULT_PRESETS):
            raise click.UsageError("--axis preset sets all settings; leave out options of settings")
        settings = None
    # The presets of an axis differ in whether they expand.
    expand: float | None = given["expand"] if settings or program.is_given("expand") else None
    picture = None
    shared = {name: given[name] for name in ("size", "shading", "time")} | given["stages"]
    if source is None:
        for name in ("mask", "emission"):
            if given[name] is not None:
                raise click.UsageError(f"--{name}: the source is a scene; name an IMAGE")
        looked_at = given["scene"]()
    else:
        reading = {name: given[name] for name in ("subimage", "layer")}
        if folder is not None and image_writing.holds_profile(f"image{suffix}"):
            reading["prepare"] = keep_profile
        alpha = _alpha_of(axes, settings)
        picture = image_files.read_picture(source, colour=given["input_colour"], **reading)
        picture = Start(given["settings"].replace(alpha=alpha), expand).develop(picture)
        looked_at = picture.pixels
        files = given["mask"], given["emission"], given["input_colour"]
        shared |= glows.read_glows(*files, is_blended=alpha != "keep").of(looked_at)
    names = given["framebuffers"].split(",")
    shared["framebuffers"] = "all" if names == ["all"] else names
    with program.as_wrong_use():
        grid = layout.ask(looked_at, settings, axes, reduce=None, **shared)
    with open_renderer(given["adapter"]) as renderer:
        _note_no_bloom(grid, renderer)
        if folder is None:
            shared |= {"part": part, "progress": not terminal.is_quiet()}
            render_grid(looked_at, settings, axes, store=target, renderer=renderer, **shared)
        else:
            how: dict[str, Any] = {"suffix": suffix, "picture": picture, "expand": expand}
            _write_images(grid, folder, renderer, part=part, **how)
    which = f"part {part[0]}/{part[1]} of " if given["part"] else ""
    terminal.say(f"wrote {target}, {which}{math.prod(grid.shape)} points")


def _folder_of(out: str | None, store: str | None) -> Path | None:
    """Return the folder of a grid's image files; None for a store."""
    if (out is None) == (store is None):
        raise click.UsageError("give either --out or --store, where the grid is written")
    if out is None or out.endswith(".zarr"):
        return None
    folder = Path(out)
    if folder.suffix and not folder.is_dir():
        hint = f"name a folder, and give --image-format {folder.suffix[1:]}"
        raise click.UsageError(f"--out: {out} is not NAME.zarr; for an image of each point {hint}")
    return folder


def _alpha_of(axes: Mapping[str, Sequence[Any]], settings: Settings | None) -> str:
    """Return an alpha for which an image is read; points of an axis have one image."""
    values = axes.get("alpha") or [settings.alpha if settings else "keep"]
    if len({value == "keep" for value in values}) > 1:
        raise click.UsageError(
            "--axis alpha: keep has colours as in the file, max and blur have them multiplied by "
            "alpha; leave out keep, or the others"
        )
    return str(values[0])


def axis_values(words: Sequence[str], settings: Settings) -> dict[str, Sequence[Any]]:
    """Return the values of each ``NAME=VALUES``."""
    begun = [settings]
    for word in words:
        if word.startswith("preset="):
            begun = [presets[value] for value in _values(word, _PRESETS)]
    results: dict[str, Sequence[Any]] = {}
    for word in words:
        name = word.partition("=")[0].strip().replace("-", "_")
        if name in results:
            raise click.UsageError(f"--axis: {name} is given twice; list all values in one")
        results[name] = _values(word, _type_of(name, begun))
    return results


def _type_of(name: str, begun: Sequence[Settings]) -> Any:
    """Return the type of a field's option, so that axes and options have one syntax."""
    others: dict[str, Any] = {"preset": _PRESETS, "time": click.FLOAT, "dt": click.FLOAT}
    others |= {"exposure": fields.EXPOSURE, "taa": fields.TAA}
    if name in others:
        return others[name]
    lacking = [settings for settings in begun if name not in fields_of(type(settings))]
    if lacking and not name.startswith("glare."):
        near = did_you_mean(name, fields_of(type(lacking[0])))
        raise click.UsageError(f"--axis: {lacking[0].method} has no field {name!r}{near}")
    with program.as_wrong_use():
        return fields.option_type(field_info(begun[0], name))


def _values(word: str, kind: Any) -> Sequence[Any]:
    text = word.partition("=")[2]
    values = [part.strip() for part in text.split(";" if ";" in text else ",") if part]
    if not values:
        raise click.UsageError(f"--axis: {word!r} is not NAME=FIRST:LAST:COUNT or NAME=A,B,...")
    try:
        if text.count(":") == 2 and "," not in text and ";" not in text:
            first, last, count = text.split(":")
            spaced: list[float] = np.linspace(float(first), float(last), int(count)).tolist()
            return spaced
        return [kind.convert(part, None, None) for part in values]
    except (click.BadParameter, ValueError) as error:
        hint = "; a range is FIRST:LAST:COUNT" if ":" in text else ""
        raise click.UsageError(f"--axis {word}: {error}{hint}") from error


def _note_no_bloom(grid: layout.Grid, renderer: Renderer) -> None:
    """Print a note if the first and the last point of a grid have no bloom."""
    corners = {tuple(0 for _ in grid.shape), tuple(count - 1 for count in grid.shape)}
    lit = [point for point in map(grid.point, sorted(corners)) if point.settings.bloom]
    frames = [
        frames for _, frames in sources.visit(renderer, grid.source, lit, ("bloom",), grid.before)
    ]
    if lit and all(map(no_bloom.is_without, frames)):
        terminal.note(f"at the first and the last point, {no_bloom.reason(lit[-1].settings)}")


def _write_images(
    grid: layout.Grid,
    folder: Path,
    renderer: Renderer,
    *,
    suffix: str,
    part: order.Part,
    picture: Picture | None,
    expand: float | None,
) -> None:
    """Write a part's points as ``<index along each axis>_<framebuffer>``.

    A framebuffer that the format cannot hold is written as ``.exr``.
    """
    folder.mkdir(parents=True, exist_ok=True)
    ranking = layout.lay_out(grid, renderer).ranking
    single = (1,) * len(grid.shape)
    points = [block.start for block in order.blocks(grid.shape, single, ranking, part)]
    digits = [max(3, len(str(count - 1))) for count in grid.shape]
    with filling.progress_bar(len(points), shown=not terminal.is_quiet()) as count:
        path = map(grid.point, points)
        for index, frames in sources.visit(renderer, grid.source, path, grid.wanted, grid.before):
            stem = "".join(map("{:0{}}_".format, index, digits))
            for name in frames:
                _save(frames, name, folder / f"{stem}{name}{suffix}", picture, expand)
            count(1)


def _save(
    frames: Frames, name: str, path: Path, picture: Picture | None, expand: float | None
) -> None:
    """Write a framebuffer of a point; `final` in the colours of the image's file."""
    settings = frames.settings
    if name == "final" and picture is not None:
        final = image_files.finish(picture, frames[name], settings)
        image_writing.save(final, path, None, settings_facts(settings, expand, frames))
    else:
        # Without the timings, so that the same call writes the same file.
        frames._with({name: frames[name]}, timings={}).save(path)
