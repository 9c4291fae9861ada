"""``vkbloom apply``: add bloom to an image file."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import os
import shutil
import tempfile
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from fractions import Fraction
from pathlib import Path
from typing import Any, Final, TypeAlias, get_args

import click
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from vkbloom._background_writer import write_in_background
from vkbloom._cli import no_bloom, videos
from vkbloom._cli.fields import Command
from vkbloom._cli.glows import glow_options, read_glows
from vkbloom._cli.image_files import (
    check_input_colour,
    finish,
    input_colour_option,
    note_hidden,
    read_picture,
    reading_options,
    silence,
)
from vkbloom._cli.program import adapter_option, as_wrong_use, describe
from vkbloom._cli.sequences import PIPE, check_targets, displayed_name, is_stream, pairs
from vkbloom._cli.settings_options import StartOptions, taa_option, timed_start_options
from vkbloom._cli.terminal import complain, hides_progress, note, say, tell_device
from vkbloom._cli.time_steps import Pair, TimeSteps, order_in_time
from vkbloom._io import image_writing, safe_writing
from vkbloom._io.decoding import keep_profile
from vkbloom._io.displayed import PRIMARIES, Saved
from vkbloom._io.narrowing import narrow, narrowing_note
from vkbloom._io.picture import Colour, Highlights, Picture, SavedColour
from vkbloom._io.video.coding import Codec
from vkbloom._io.video.reading import is_video
from vkbloom._locks import cached_property
from vkbloom._presets.start import PRESET_OF_PHOTOS
from vkbloom._renderer.added_light import added_share, faint_note
from vkbloom._renderer.frame_files import settings_facts
from vkbloom._renderer.frames import Frames
from vkbloom._renderer.interruptible import open_renderer
from vkbloom._renderer.renderer import Renderer
from vkbloom._sequence.inputs import DEFAULT_RATE
from vkbloom._settings.settings import Settings

#: From an image to its mask and emission.
Glow: TypeAlias = Callable[[NDArray[Any]], dict[str, Any]]

# Errors of one file, after which a batch goes on. A lost device fails for all of them.
_FAILURES: Final = (OSError, ValueError, MemoryError, click.ClickException)
# 8-bit pictures of this many pixels or more become half floats, whose steps are finer.
_HALVED: Final = 1 << 26
_HALF: Final = np.dtype(np.float16)
_MAX_AMOUNT: Final = 2
# Of a photograph without lights the preset photo adds less, and nobody sees it.
_MIN_SHARE_OF_LIGHTS: Final = 0.005
_WITHOUT_LIGHTS: Final = "the presets mist, soft and dreamy need no lights"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Options:
    """The options of the command by their names."""

    subimage: int
    layer: str | None
    input_colour: Colour | None
    half: bool
    mask: str | None
    emission: str | None
    output_colour: SavedColour | None
    primaries: str
    view: str | None
    bits: int | None
    quality: int | None
    pipe_format: str
    framebuffers: str
    overwrite: bool
    skip_existing: bool
    expand: float | None
    amount: float
    start: StartOptions
    fps: Fraction | None

    @property
    def saved(self) -> Saved:
        """What the colours of a written file are to be."""
        return Saved(self.output_colour, self.primaries, self.view)

    @property
    def names(self) -> str | list[str]:
        """The framebuffers to write: `final`, and those of --framebuffers; "all"."""
        if self.framebuffers == "all":
            return "all"
        others = [name.strip() for name in self.framebuffers.split(",")]
        return [*dict.fromkeys(["final", *filter(None, others)])]


def of_format(target: str, pipe_format: str) -> str:
    """Return a file name with the extension of the format of OUT, which may be a stream."""
    is_nameless = target == PIPE or (is_stream(target) and not Path(target).suffix)
    return f"image.{pipe_format}" if is_nameless else target


def beside(target: Path, name: str) -> Path:
    """Return the file of a framebuffer beside OUT, which has `final`."""
    return target.with_name(f"{target.stem}_{name}{target.suffix}")


@dataclasses.dataclass(kw_only=True, eq=False)
class Run:
    """The files of one call; `failures` has the errors of a batch by the file that was read.

    `kept`: absolute names of files that no framebuffer may replace. `is_careful`: nor may it
    replace a picture of another program.
    """

    options: Options
    out: str
    folder: Path
    renderer: Callable[[], Renderer]
    several: bool
    kept: Collection[str]
    is_careful: bool
    steps: TimeSteps
    failures: dict[str, Exception] = dataclasses.field(default_factory=dict)

    @contextlib.contextmanager
    def _of_file(self, pair: Pair) -> Iterator[None]:
        """Keep an error of one of several files, so that the others are done."""
        try:
            yield
        except _FAILURES as error:
            if not self.several:
                raise
            self.failures[pair[0]] = error

    def sequence(self, files: list[Pair]) -> None:
        """Add bloom to files one after the other; each is written while the next one is made."""
        hidden = hides_progress() if self.several else True
        bar = tqdm(files, unit="image", leave=False, disable=hidden)
        for texts in write_in_background(self._make(bar)):
            for text in texts:
                note(text)

    def _make(self, files: Iterable[Pair]) -> Iterator[tuple[list[str], Callable[[], object]]]:
        """Yield of each file a list for notes, and the function that writes it and fills the list.

        Notes are printed by the thread that reads files, because it silences standard error.
        """
        for pair in files:
            read = None
            with self._of_file(pair):
                read = self._read(*pair)
            if read is None:
                continue
            picture, settings, expand = read
            # Opened after the first file is read, so that a wrong file fails at once.
            renderer = self.renderer()
            glow_of = self._glow_of(settings.alpha != "keep")
            with self._of_file(pair):
                with as_wrong_use():
                    glow = glow_of(picture.pixels)
                    wanted = no_bloom.with_bloom(self.options.names, settings)
                    given = {**glow, **self.steps.of(pair[1]), "framebuffers": wanted}
                    frames = renderer.apply(picture.pixels, settings, **given)
                self.steps.advance(pair[1], frames)
                self._tell(pair, picture, frames, expand)
                kept = no_bloom.only(frames, self.options.names)
                self._check_beside(pair[1], kept)
                texts: list[str] = []
                yield texts, functools.partial(self._write, pair, picture, kept, expand, texts)

    def _check_beside(self, target: str, names: Iterable[str]) -> None:
        """Raise ValueError if a framebuffer beside OUT would replace another file of this call."""
        for name in names:
            file = beside(Path(target), name)
            # Its own extension, or that of a format that holds all values.
            for one in [] if name == "final" else (file, file.with_suffix(".exr")):
                if os.path.abspath(one) in self.kept:
                    raise ValueError(
                        f"{one}: {name} would replace this file, which IN or OUT names"
                    )
                if self.is_careful and one.is_file() and safe_writing.is_of_another_program(one):
                    raise ValueError(
                        f"{one}: is a picture that vkbloom did not write; to replace it by {name}, "
                        "give --overwrite"
                    )

    def _tell(self, pair: Pair, picture: Picture, frames: Frames, expand: float | None) -> None:
        """Print a note about the bloom of a file."""
        name, target = pair
        text = ""
        if no_bloom.is_without(frames):
            colours = picture.pixels[:, :, :3]
            brightest = float(np.max(colours, initial=0, where=np.isfinite(colours)))
            is_exposed = bool(self.options.start.stages)
            text = no_bloom.reason(frames.settings, None if is_exposed else brightest)
            if self._is_plain(picture):
                text += f"; {_WITHOUT_LIGHTS}"
        elif self.options.amount and image_writing.is_straight(
            of_format(target, self.options.pipe_format), is_multiplied=picture.is_multiplied
        ):
            text = no_bloom.describe_hidden(frames["final"], frames.settings)
        # (An exposure changes the picture's light as well.)
        is_chosen = self.options.start.is_chosen and not self.options.start.stages
        has_glow = self.options.mask is not None or self.options.emission is not None
        if not text and is_chosen and not has_glow and self.options.amount:
            is_twice = self.options.amount == _MAX_AMOUNT
            text = faint_note(
                added_share(picture.pixels, frames),
                frames.settings,
                highlights=picture.highlights,
                expand=expand,
                option="--{}",
                stronger="raise --intensity" if is_twice else f"--amount {_MAX_AMOUNT}",
            )
        elif not text and self._is_plain(picture):
            share = added_share(picture.pixels, frames)
            if share is not None and share < _MIN_SHARE_OF_LIGHTS:
                text = f"the bloom adds {100 * share:.2g} % of the picture's light; "
                text += _WITHOUT_LIGHTS
        if text:
            note(f"{name}: {text}" if self.several else text)

    def _is_plain(self, picture: Picture) -> bool:
        """Whether a photograph gets the preset photo as it is, of which only lights glow."""
        options, start = self.options, self.options.start
        is_given = start.is_chosen or start.changes or start.stages or not options.amount
        has_glow = options.mask is not None or options.emission is not None
        return picture.is_photograph and not is_given and not has_glow

    def _read(self, source: str, target: str) -> tuple[Picture, Settings, float | None]:
        """Return the picture whose pixels get a bloom, its settings and its expansion."""
        options = self.options
        file = of_format(target, options.pipe_format)
        can_keep = options.saved == Saved() and image_writing.holds_profile(file)
        picture = read_picture(
            source,
            options.subimage,
            options.input_colour,
            layer=options.layer,
            prepare=keep_profile if can_keep else None,
        )
        start = options.start.of(picture.highlights)
        if start.settings.alpha == "keep":
            note_hidden(picture, source)
        picture = start.develop(picture)
        pixels = picture.pixels
        is_large = picture.numbers == "uint8" and pixels[..., 0].size >= _HALVED
        if (options.half or is_large) and pixels.dtype == np.float32:
            picture = dataclasses.replace(picture, pixels=narrow(pixels, _HALF))
            _tell_narrowing(source, pixels)
        return picture, *start

    @cached_property
    def _glow_of(self) -> Callable[[bool], Glow]:
        # The files are read once.
        return functools.cache(self._read_glow)

    def _read_glow(self, is_blended: bool) -> Glow:
        """Return a function that gives mask and emission for an image."""
        options = self.options
        glows = read_glows(
            options.mask, options.emission, options.input_colour, is_blended=is_blended
        )
        if options.half and options.emission is not None and glows.emission is not None:
            _tell_narrowing(options.emission, glows.emission)
        return glows.of

    def _write(
        self,
        pair: Pair,
        picture: Picture,
        frames: Frames,
        expand: float | None,
        notes: list[str],
    ) -> None:
        target = pair[1]
        with self._of_file(pair):
            file = Path(target)
            if target != self.out:
                file.parent.mkdir(exist_ok=True)
            if is_stream(target):
                suffix = Path(of_format(target, self.options.pipe_format)).suffix
                file = self.folder / f"output{suffix}"
            # Before OUT, so that --skip-existing finds all of them where it finds OUT.
            others = _save_others(frames, file)
            notes += image_writing.save(
                finish(picture, frames["final"], frames.settings),
                file,
                self.options.saved,
                settings_facts(frames.settings, expand, frames),
                self.options.quality,
                bits=self.options.bits,
            )
            if is_stream(target):
                _send(file, target)
            elif not self.several:
                for written in (file, *others):
                    say(f"wrote {written}")


def _save_others(frames: Frames, target: Path) -> list[Path]:
    """Write each framebuffer but `final` to its own file beside OUT, its values unchanged."""
    written: list[Path] = []
    for name, array in frames.items():
        if name != "final":
            written += frames._with({name: array}).save(beside(target, name))
    return written


def _tell_narrowing(source: str, pixels: NDArray[Any]) -> None:
    """Print a note about values that half floats cannot hold."""
    if (text := narrowing_note(pixels, _HALF)) is not None:
        note(f"{displayed_name(source)}: {text}")


def _send(file: Path, target: str) -> None:
    """Write a file's content to a stream."""
    with file.open("rb") as content, click.open_file(target, "wb") as stream:
        shutil.copyfileobj(content, stream)
        stream.flush()


@click.command(
    cls=Command,
    everyday=(
        "preset",
        "amount",
        "out",
        "quality",
        "expand",
        "mask",
        "framebuffers",
        "adapter",
        "quiet",
    ),
    begins=PRESET_OF_PHOTOS,
)
@click.argument("sources", metavar="IN... OUT", nargs=-1, required=True, type=click.Path())
@click.option(
    "-o", "--out", metavar="OUT", type=click.Path(), help="The file to write, instead of OUT."
)
@click.option(
    "--amount",
    metavar="A",
    type=click.FloatRange(0, _MAX_AMOUNT),
    default=1.0,
    help="Strength of the bloom: 1: as the preset has it; 0: none; 2: twice.",
)
@click.option(
    "--quality",
    metavar="N",
    type=click.IntRange(1, 100),
    help="Of JPEG, WebP, JPEG XL and videos; of h264 and h265, 100 is lossless [default 70].",
)
@click.option(
    "--pipe-format", metavar="EXTENSION", default="png", help="Format of standard output."
)
@click.option(
    "--framebuffers",
    metavar="all|NAME,...",
    default="final",
    help="What to write. final is OUT; each other framebuffer is a file beside OUT, with _NAME "
    "after OUT's stem, its values unchanged; .exr if OUT's format cannot hold them.",
)
@click.option(
    "--fps",
    type=videos.Rate(),
    metavar="N",
    help="Frames per second of images in a video, or with an exposure [default 24]; of a video, "
    "instead of its times.",
)
@click.option(
    "--codec",
    type=click.Choice(get_args(Codec)),
    help="Of a video [default ffv1, which is lossless, for .mkv; else h264, or h265 for more than "
    "8 bits]",
)
@input_colour_option
@click.option(
    "--output-colour",
    type=click.Choice(get_args(SavedColour)),
    help="Encoding of the colours in OUT.",
)
@click.option(
    "--primaries", type=click.Choice([*PRIMARIES]), default="rec709", help="Of the colours in OUT."
)
@click.option(
    "--view", metavar="VIEW", help="A display's view of OpenColorIO's built-in configuration."
)
@click.option("--half", is_flag=True, help="Hold pictures in half floats, in half the memory.")
@click.option(
    "--bits",
    type=click.Choice(["8", "10", "12", "16", "32"]),
    callback=lambda _, __, value: value and int(value),
    help="Size of a number in OUT [default that of IN]",
)
@click.option(
    "--overwrite",
    is_flag=True,
    help="OUT may be a file that is read as IN, or a picture that vkbloom did not write.",
)
@click.option(
    "--skip-existing", is_flag=True, help="Leave out images whose OUT is there and complete."
)
@reading_options
@glow_options
@adapter_option
@taa_option
@timed_start_options
def command(*, sources: tuple[str, ...], out: str | None, adapter: str, **given: Any) -> int:
    """Add bloom to the image IN and write the result to OUT.

    The extension selects the format: OpenEXR, Radiance HDR, PNG, JPEG, TIFF and others. IN and OUT
    may be folders, patterns of numbers (f.%04d.exr) or - for a pipe. IN may also be a
    glob, or several files.

    Without --preset, --method and --settings, each file of integers (JPEG, PNG) starts from the
    preset photo, and its highlights are expanded; each file of floats starts from bevy_natural.
    Further options change the settings.

    Bloom is computed in linear colours. Files of 8 or 16 bit integers are decoded to 32-bit floats
    with Rec. 709 colours. Files of floats are linear. OUT has the number type of IN, or the closest
    one of its format. Integers are encoded to sRGB, or by the ICC profile of IN if OUT can hold it,
    and clipped to 0..1; colours above 1 keep their hue. Floats (as in OpenEXR and Radiance HDR) are
    written linear. Alpha does not change, unless --alpha is given. OUT is replaced when the new
    file is complete; with a picture that vkbloom did not write, only as --out OUT or with
    --overwrite. Of several images, those that fail are listed at the end, and the exit status is 1.
    See docs/command-line.md.
    """
    inputs, target = _arguments(sources, out)
    codec = given.pop("codec")
    options = Options(**given)
    if any(map(is_video, (*inputs, target))):
        how = {"codec": codec, "is_named": out is not None}
        videos.run(_job_of(options, inputs, target, **how), adapter)
        return 0
    _check_only_of_videos(options, codec)
    work = _plan(options, inputs, target, is_named=out is not None)
    if not work:
        return 0
    numbers: list[int] = []
    if options.start.stages:
        work, numbers = order_in_time(work)
    by_target = {target: number for (_, target), number in zip(work, numbers, strict=False)}
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:

        @functools.cache
        def renderer() -> Renderer:
            opened = stack.enter_context(open_renderer(adapter))
            # Standard output may have the picture.
            tell_device(opened, err=is_stream(target))
            return opened

        several = len(work) > 1
        run = Run(
            options=options,
            out=target,
            folder=Path(folder),
            renderer=renderer,
            several=several,
            kept=_find_protected_files(options, work),
            is_careful=not (several or out is not None or options.overwrite),
            steps=TimeSteps(options.start.stages, by_target, float(options.fps or DEFAULT_RATE)),
        )
        run.sequence(work)
    written = [target for name, target in work if name not in run.failures]
    if len(work) > 1 and written:
        say(f"wrote {len(written)} images, {written[0]} to {written[-1]}")
    return _tell_failures(run.failures, work)


def _check_only_of_videos(options: Options, codec: str | None) -> None:
    """Raise click.UsageError for options of videos, or of frames in time, in a call for images."""
    if codec is not None:
        raise click.UsageError("--codec is only for videos")
    if options.fps is not None and not options.start.stages:
        raise click.UsageError(
            "--fps is only for videos, and for images with --exposure NAME or --taa"
        )
    if options.skip_existing and options.start.stages:
        raise click.UsageError("--skip-existing: each image continues the one before; leave it out")


def _job_of(options: Options, sources: list[str], out: str, **given: Any) -> videos.Job:
    """Return what the command does if IN or OUT is a video."""
    if options.names != ["final"] or options.skip_existing:
        name = "skip-existing" if options.skip_existing else "framebuffers"
        raise click.UsageError(f"--{name} is only for images; leave it out")
    check_input_colour(options.input_colour)
    names = {field.name for field in dataclasses.fields(videos.Job)}
    shared = {name: value for name, value in vars(options).items() if name in names}
    _check_colours(options.start.of(Highlights.STORED).settings, options)
    return videos.Job(**shared, sources=sources, out=out, saved=options.saved, **given)


def _tell_failures(failures: Mapping[str, Exception], work: Sequence[Pair]) -> int:
    """Print the images that failed, in their order, and return the exit status."""
    if not failures:
        return 0
    for name, _ in work:
        if name in failures:
            text = describe(failures[name])
            complain(text if name in text else f"{name}: {text}")
    complain(f"{len(failures)} of {len(work)} images failed")
    return 1


def _plan(options: Options, sources: list[str], out: str, *, is_named: bool) -> list[Pair]:
    """Check the options, and return the files to read, each with the file to write.

    `is_named`: OUT was given as --out, and not as the last of several words.
    """
    check_input_colour(options.input_colour)
    if is_stream(out) and options.names != ["final"]:
        raise click.UsageError("a pipe takes only final; leave out --framebuffers")
    work = pairs(sources, out)
    if options.names != ["final"]:
        _check_stems(work)
    settings, _ = options.start.of_file(work[0][0])
    _check_colours(settings, options)
    if options.skip_existing:
        left = [pair for pair in work if not _is_done(pair, options)]
        say(f"skipped {len(work) - len(left)} of {len(work)} images, whose OUT is complete")
        work = left
    elif not (is_named or options.overwrite) and [target for _, target in work] == [out]:
        _check_not_replaced(work[0][0], out)
    check_targets(work, out, overwrite=options.overwrite)
    with as_wrong_use():
        for target in {Path(target).suffix: target for _, target in work}.values():
            file = of_format(target, options.pipe_format)
            image_writing.check_options(file, options.saved, options.quality, options.bits)
    return work


def _is_done(pair: Pair, options: Options) -> bool:
    """Return whether OUT, and what --framebuffers writes beside it, are there and complete."""
    source, target = pair
    if is_stream(target) or not os.path.isfile(target):
        return False
    file = Path(target)
    names = options.names
    if names == "all":
        # Those of a method are known when it is planned; every bloom has this one.
        names = ["final", "bloom"] if options.start.of_file(source)[0].bloom else ["final"]
    others = [beside(file, name) for name in names if name != "final"]
    # libpng prints what is wrong with a damaged file.
    with silence():
        for other in others:
            there = [one for one in (other, other.with_suffix(".exr")) if one.is_file()]
            if not there or safe_writing.is_damaged(there[0]):
                return False
        if safe_writing.is_damaged(file):
            return False
        is_picture = safe_writing.is_picture(file)
    if not is_picture:
        note(f"{target}: is left as it is, though it is no image")
    return True


def _find_protected_files(options: Options, work: Sequence[Pair]) -> set[str]:
    """Return absolute names of files that no framebuffer may replace."""
    names = {target for _, target in work if not is_stream(target)}
    if not options.overwrite:
        names |= {source for source, _ in work if not is_stream(source)}
    return {os.path.abspath(name) for name in names}


def _check_stems(work: Sequence[Pair]) -> None:
    """Raise click.UsageError if framebuffers of two images would have the same files."""
    known: dict[str, str] = {}
    for _, target in work:
        other = known.setdefault(os.path.splitext(target)[0], target)
        if other != target:
            raise click.UsageError(
                f"{target}: its framebuffers would replace those of {other}; use a pattern such as "
                "f.%04d.png as OUT"
            )


def _check_not_replaced(source: str, out: str) -> None:
    """Raise click.UsageError if OUT, the last word, is a picture that vkbloom did not write.

    ``vkbloom apply *.jpg`` of two photographs would otherwise replace the second one.
    """
    if not os.path.isfile(out) or (os.path.isfile(source) and os.path.samefile(source, out)):
        return
    with silence():
        is_of_another = safe_writing.is_of_another_program(Path(out))
    if is_of_another:
        raise click.UsageError(
            f"{out}: is a picture that vkbloom did not write; to replace it, give it as -o {out}, "
            "or --overwrite; to add bloom to it as well, name a folder as OUT"
        )


def _check_colours(settings: Settings, options: Options) -> None:
    """Raise click.UsageError for options that do not go together."""
    names = ("output_colour", "view", "primaries")
    used = [name for name in names if getattr(options, name) not in (None, "rec709")]
    if settings.encoding != "none" and settings.alpha != "keep":
        raise click.UsageError(
            f"--alpha {settings.alpha} needs linear colours; leave out --encoding: OUT is encoded "
            "for its format"
        )
    if settings.encoding != "none" and used:
        raise click.UsageError(
            f"--encoding {settings.encoding} already encodes the output; leave out "
            f"--{used[0].replace('_', '-')}"
        )


def _arguments(sources: tuple[str, ...], out: str | None) -> tuple[list[str], str]:
    """Return the INs and OUT, which is the last argument or that of --out."""
    if out is not None:
        return [*sources], out
    if len(sources) < 2:
        raise click.UsageError("Missing argument 'OUT'.")
    return [*sources[:-1]], sources[-1]
