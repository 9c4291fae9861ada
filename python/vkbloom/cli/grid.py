"""``vkbloom grid``: render all combinations of axis values to a Zarr store or image files."""

from __future__ import annotations

import asyncio
import io
import logging
import math
import queue
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Any, Final

import click

import vkbloom
from vkbloom import no_bloom
from vkbloom.checks import import_extra
from vkbloom.cli import axis_options
from vkbloom.cli.device_options import device_options
from vkbloom.cli.fields import SIZE
from vkbloom.cli.glow_options import (
    accompanying,
    glow_options,
    note_step,
    refuse_glow_of_scene,
)
from vkbloom.cli.image_files import (
    expand_option,
    input_colour_option,
    layer_option,
    read_picture,
    subimage_option,
)
from vkbloom.cli.option_files import FILE_OPTION, CommandWithFile
from vkbloom.cli.program import as_wrong_use, given
from vkbloom.cli.scene_options import scene_options
from vkbloom.cli.sequences import check_drawing
from vkbloom.cli.settings_options import DEFAULT_PRESETS, settings_options
from vkbloom.cli.terminal import detail_device, is_quiet, note, say
from vkbloom.grid.image_folder import FileForm, GridFiles
from vkbloom.grid.layout import Grid, Layout, ask
from vkbloom.grid.parts import WHOLE, Part, read_part
from vkbloom.grid.rendering import render_grid
from vkbloom.grid.sources import visit
from vkbloom.grid.zarr_grid import check_chunks
from vkbloom.io import image_writing, safe_writing
from vkbloom.io.images import Colour, Picture
from vkbloom.settings import SHADINGS, Shading

_STORE: Final = ".zarr"


def _part(_: click.Context, __: click.Parameter, value: str | None) -> Part | None:
    with as_wrong_use():
        return None if value is None else read_part(value)


@click.command(cls=CommandWithFile)
@click.argument("images", metavar="[IMAGE]...", nargs=-1, type=click.Path())
@click.option(
    "-o",
    "--out",
    required=True,
    type=click.Path(),
    help="NAME.zarr or a URL that fsspec supports is a Zarr store. Any other name is a folder of "
    "image files.",
)
@click.option(
    "--axis",
    "axis_words",
    metavar="NAME=VALUES",
    multiple=True,
    help="A settings field, time or preset, and its values: FIRST:LAST:COUNT, "
    "FIRST:LAST:COUNT:log, or A,B,... (A;B;... if values contain commas). Repeat it for more axes; "
    "the dimensions have the order of the options.",
)
@click.option(
    FILE_OPTION,
    metavar="FILE",
    expose_value=False,
    help="A TOML or YAML file with options by their long names. It may have the tables settings, "
    "camera, axes, reduce and chunks, and the list images. Options on the command line override "
    "it.",
)
@click.option("--size", type=SIZE, help="Size of a scene's frames, in pixels [default 1280x720]")
@click.option(
    "--time", default=0.0, show_default=True, help="Time of a scene's animation; its period is 1."
)
@click.option("--shading", type=click.Choice(SHADINGS), default=SHADINGS[0], show_default=True)
@click.option(
    "--attachments",
    metavar="all|none|NAME,...",
    default="final",
    show_default=True,
    help="The framebuffers to keep.",
)
@click.option(
    "--reduce",
    "reduce_words",
    metavar="[NAME=]KIND[:FRAMEBUFFER][@REFERENCE]",
    multiple=True,
    help=f"A figure to compute: {', '.join(axis_options.REDUCTIONS)}. The last three need a "
    "REFERENCE: an image file, or a point of the grid as AXIS=VALUE,...",
)
@click.option(
    "--chunk",
    "chunk_words",
    metavar="AXIS=COUNT",
    multiple=True,
    help="Grid points per chunk of the store [default: chunks of about 1 MiB along the axes that "
    "vary fastest]",
)
@click.option(
    "--image-format",
    "suffix",
    metavar="EXTENSION",
    default="png",
    show_default=True,
    help="Format of image files: png, exr, tif, ...",
)
@click.option(
    "--resume/--no-resume",
    default=True,
    show_default=True,
    help="Continue an interrupted grid, and render damaged points again; without, a grid that is "
    "there is an error.",
)
@click.option(
    "--part",
    metavar="I/N",
    callback=_part,
    help="Render part I of N, from 1, of the same grid; with --resume. Other processes may "
    "render other parts at the same time. auto/N takes I, and auto also N, from the environment of "
    "a job array, such as SLURM_ARRAY_TASK_ID.",
)
@click.option(
    "--workers",
    metavar="N",
    type=click.IntRange(min=1),
    help="Render in N processes, through Dask.",
)
@click.option("--scheduler", metavar="ADDRESS", help="Render on the cluster of a Dask scheduler.")
@click.option(
    "--sheet", metavar="FILE", type=click.Path(), help="Also write a contact sheet (PNG)."
)
@click.option(
    "--curves",
    metavar="FILE",
    type=click.Path(),
    help="Also plot the figures along the axes: a PNG, SVG or PDF.",
)
@input_colour_option
@click.option("--raw", is_flag=True, help="Do not decode the values of 8-bit files.")
@subimage_option
@layer_option
@expand_option
@glow_options
@device_options
@scene_options
@settings_options
def command(
    *,
    images: tuple[str, ...],
    out: str,
    axis_words: tuple[str, ...],
    size: tuple[int, int] | None,
    time: float,
    shading: Shading,
    attachments: str,
    reduce_words: tuple[str, ...],
    chunk_words: tuple[str, ...],
    suffix: str,
    resume: bool,
    part: Part | None,
    workers: int | None,
    scheduler: str | None,
    sheet: str | None,
    curves: str | None,
    input_colour: Colour | None,
    raw: bool,
    subimage: int,
    layer: str | None,
    expand: float | None,
    mask: str | None,
    emission: str | None,
    adapter: str,
    validation: bool,
    scene: Callable[[], vkbloom.Scene],
    settings: vkbloom.Settings,
) -> None:
    """Render all combinations of the axes' values.

    The source is a scene, or each IMAGE, read as vkbloom apply reads it: files of integers (JPEG,
    PNG) start from the preset photo and are expanded, except with an axis of presets. The points of
    the grid are rendered in the order that runs the fewest passes. A store can be opened while it
    is written. The same call again continues a grid that was killed, and gives the same result.
    """
    if workers and scheduler:
        raise click.UsageError("--workers and --scheduler exclude each other; give one of them")
    output = _Output(out, suffix, resume or part is not None, part, sheet, curves)
    output.check(needs_store=bool(reduce_words or chunk_words), has_frames=attachments != "none")
    chunks = axis_options.chunk_counts(chunk_words)
    begun, axes = _begun_and_axes(axis_words, settings, len(images))
    reduce = axis_options.named_reductions(reduce_words, settings)
    # The presets of an axis differ in whether they expand.
    expand = expand if "preset" not in axes or given("expand") else None
    pictures = _pictures(images, subimage, input_colour, layer=layer, raw=raw, expand=expand)
    requested = _source(images, pictures, scene), begun, axes
    shared: dict[str, Any] = {
        "size": size,
        "shading": shading,
        "time": time,
        "attachments": _names(attachments),
        "reduce": reduce,
        **_glows(pictures, mask, emission, begun, colour=input_colour, raw=raw),
    }
    with as_wrong_use():
        grid = ask(*requested, **shared)
        check_chunks(grid, chunks)
    output.check_shape(grid.shape)
    if not workers and not scheduler:
        _note_no_bloom(grid, adapter, validation)
    with _client(workers, scheduler) as client:
        device = {"client": client, "adapter": adapter, "validation": validation}
        if output.is_store:
            output.store(math.prod(grid.shape), requested, chunks=chunks, **shared, **device)
        else:
            output.write_images(grid, pictures, expand, **device)


@dataclass(frozen=True)
class _Output:
    """What the options say of the files to write."""

    name: str
    suffix: str
    resume: bool
    part: Part | None
    sheet: str | None
    curves: str | None

    @property
    def is_store(self) -> bool:
        return self.name.endswith(_STORE) or "://" in self.name

    def check(self, *, needs_store: bool, has_frames: bool) -> None:
        """Raise click.UsageError for options that do not go together."""
        if not self.is_store:
            if needs_store:
                raise click.UsageError(f"--reduce and --chunk need a store; use --out NAME{_STORE}")
            if self.sheet or self.curves:
                raise click.UsageError(f"--sheet and --curves need a store; use --out NAME{_STORE}")
            _check_image_files(self.name, self.suffix)
        if self.sheet and not has_frames:
            raise click.UsageError("--sheet needs framebuffers; leave out --attachments none")
        check_drawing("--sheet", self.sheet, (".png",))
        check_drawing("--curves", self.curves, (".png", ".svg", ".pdf"))

    def check_shape(self, shape: tuple[int, ...]) -> None:
        """Raise click.UsageError if there is no axis along which to plot."""
        if self.curves and max(shape, default=1) < 2:
            raise click.UsageError("--curves needs an --axis of more than one value")

    def store(self, points: int, requested: tuple[Any, Any, Any], **options: Any) -> None:
        """Render into a store, and draw the sheet and the curves from it."""
        dataset = vkbloom.grid_to_zarr(
            *requested,
            self.name,
            resume=self.resume,
            part=self.part,
            on_mended=note,
            progress=not is_quiet(),
            **options,
        )
        self._tell(points, dataset.attrs["passes_run"], dataset.attrs["passes_saved"])
        if self.sheet:
            safe_writing.write_file(Path(self.sheet), vkbloom.contact_sheet(dataset))
            say(f"wrote {self.sheet}")
        if self.curves:
            kind = Path(self.curves).suffix[1:].lower()
            drawn = io.BytesIO()
            vkbloom.response_curves(dataset).savefig(drawn, format=kind)
            safe_writing.write_file(Path(self.curves), drawn.getvalue())
            say(f"wrote {self.curves}")

    def write_images(
        self, grid: Grid, pictures: Sequence[Picture], expand: float | None, **device: Any
    ) -> None:
        """Render into image files."""
        forms = [FileForm(one.encoding, one.numbers, one.grey, expand) for one in pictures]

        def prepared(layout: Layout) -> GridFiles:
            suffix = f".{self.suffix.lstrip('.')}"
            part = self.part or WHOLE
            files = GridFiles(Path(self.name), suffix, grid, layout, forms, part=part)
            files.prepare(resume=self.resume)
            return files

        tally = render_grid(grid, prepared, progress=not is_quiet(), **device)
        self._tell(math.prod(grid.shape), tally.ran, tally.saved)

    def _tell(self, points: int, ran: int, saved: int) -> None:
        which = f"part {self.part[0]}/{self.part[1]} of " if self.part else ""
        say(f"wrote {self.name}, {which}{points} points; passes run {ran}, saved {saved}")


def _begun_and_axes(
    words: Sequence[str], settings: vkbloom.Settings, image_count: int
) -> tuple[vkbloom.Settings | None, dict[str, Any]]:
    """Return the settings that the axes vary, None where an axis has presets; and the axes."""
    if not words and image_count < 2:
        raise click.UsageError("there is no --axis; give one, such as exposure=-1:1:5")
    axes = axis_options.axis_values(words, settings)
    if "preset" not in axes:
        return settings, axes
    if settings not in map(vkbloom.presets.get, DEFAULT_PRESETS):
        raise click.UsageError(
            "--axis preset sets all settings; leave out options of settings, and vary fields by "
            "further axes"
        )
    return None, axes


def _note_no_bloom(grid: Grid, adapter: str, validation: bool) -> None:
    """Print a note if the first and the last point of a grid have no bloom."""
    corners = (tuple(0 for _ in grid.shape), tuple(count - 1 for count in grid.shape))
    points = [point for point in map(grid.point, dict.fromkeys(corners)) if point.settings.bloom]
    with vkbloom.Renderer(adapter, validation=validation) as renderer:
        detail_device(renderer)
        zero = [
            no_bloom.is_without(frames)
            for _, frames in visit(renderer, grid.source, points, ("bloom",))
        ]
    if points and all(zero):
        note(f"at the first and the last point, {no_bloom.reason(points[-1].settings)}")


def _check_image_files(out: str, image_format: str) -> None:
    """Raise click.UsageError for an unknown format, and for a folder named like an image."""
    with as_wrong_use():
        image_writing.check_writable(f"image.{image_format.lstrip('.')}")
    suffix = Path(out).suffix
    if not suffix or Path(out).is_dir():
        return
    try:
        image_writing.check_writable(out)
    except ValueError:
        return
    raise click.UsageError(
        f"--out: {out} is an image's name, not a folder's; a grid writes an image for each point: "
        f"name a folder, and give --image-format {suffix[1:]}"
    )


def _pictures(
    images: Sequence[str], subimage: int, colour: Colour | None, **options: Any
) -> list[Picture]:
    return [read_picture(one, subimage, colour, **options) for one in images]


def _source(
    images: Sequence[str], pictures: Sequence[Picture], scene: Callable[[], vkbloom.Scene]
) -> Any:
    if not images:
        return scene()
    if len(images) == 1:
        return pictures[0].pixels
    # Labels are the file names, or numbers if a file is given twice.
    labels = images if len(set(images)) == len(images) else map(str, range(len(images)))
    return {label: picture.pixels for label, picture in zip(labels, pictures, strict=True)}


def _glows(
    pictures: Sequence[Picture],
    mask: str | None,
    emission: str | None,
    settings: vkbloom.Settings | None,
    *,
    colour: Colour | None,
    raw: bool,
) -> dict[str, Any]:
    """Return the arguments `mask` and `emission` of a grid of images."""
    if pictures:
        note_step(settings, mask, emission)
        return accompanying(mask, emission, colour, raw=raw)(pictures[0].pixels)
    refuse_glow_of_scene(mask, emission)
    return {}


def _names(attachments: str) -> str | tuple[str, ...]:
    if attachments == "all":
        return attachments
    return () if attachments == "none" else tuple(attachments.split(","))


@contextmanager
def _client(workers: int | None, scheduler: str | None) -> Iterator[Any]:
    """Yield a client of the requested cluster, or None if none was requested."""
    if not workers and not scheduler:
        yield None
        return
    distributed = import_extra("distributed", "grid", "--workers and --scheduler")
    if scheduler:
        with distributed.Client(scheduler) as client:
            yield client
        return
    with (
        _loop_without_interrupts() as loop,
        distributed.LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            # None would still serve a dashboard on Dask's default port, and warn if it is taken.
            dashboard_address="127.0.0.1:0",
            # Failures arrive as exceptions; Dask would also log cancelled tasks as errors.
            silence_logs=logging.CRITICAL,
            loop=loop,
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


@contextmanager
def _loop_without_interrupts() -> Iterator[Any]:
    """Yield an event loop whose thread and child processes get no SIGINT.

    A terminal sends Ctrl-C to every process of the group. This process ends the workers in order;
    workers that get SIGINT themselves each print a traceback.
    """
    loop_of = import_extra("tornado.ioloop", "grid", "--workers")
    started: queue.Queue[Any] = queue.Queue()

    def run() -> None:
        async def serve() -> None:
            stopped = asyncio.Event()
            started.put((loop_of.IOLoop.current(), stopped))
            await stopped.wait()

        asyncio.run(serve())

    # Start it now: starting it with the first worker process would unblock SIGINT there.
    resource_tracker.ensure_running()
    # Threads and processes inherit the signal mask of the thread that starts them.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        thread = threading.Thread(target=run, name="vkbloom-cluster", daemon=True)
        thread.start()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    loop, stopped = started.get()
    try:
        yield loop
    finally:
        loop.add_callback(stopped.set)
        thread.join()
