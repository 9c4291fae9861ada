"""``vkbloom apply`` of videos: from a video or images to a video or images."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import os
import re
from collections.abc import Callable, Generator, Iterator, Mapping
from collections.abc import Sequence as AnySequence
from contextlib import ExitStack, closing
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import click
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from vkbloom._background_writer import write_in_background
from vkbloom._cli import no_bloom
from vkbloom._cli.glows import read_glows
from vkbloom._cli.image_files import finish, read_picture
from vkbloom._cli.program import as_wrong_use
from vkbloom._cli.sequences import PIPE, expand, is_stream
from vkbloom._cli.settings_options import StartOptions
from vkbloom._cli.targets import check_target
from vkbloom._cli.terminal import hides_progress, note, say, tell_device
from vkbloom._io import image_writing, safe_writing
from vkbloom._io.displayed import Saved
from vkbloom._io.narrowing import narrow
from vkbloom._io.numbered_files import Pattern, gap_note, pattern_of
from vkbloom._io.picture import Colour, Picture
from vkbloom._io.video import writing
from vkbloom._io.video.coding import Codec, Coding
from vkbloom._io.video.reading import VideoFile, is_video
from vkbloom._presets.start import Start
from vkbloom._renderer.frame_files import settings_facts
from vkbloom._renderer.frames import Frames
from vkbloom._renderer.interruptible import open_renderer
from vkbloom._renderer.renderer import Renderer
from vkbloom._sequence.inputs import DEFAULT_RATE, Clock, Input, Taken
from vkbloom._sequence.sequence import Sequence
from vkbloom._sequence.work import work_of_images
from vkbloom._settings.settings import Settings

if TYPE_CHECKING:
    _ParamType = click.ParamType[Fraction]
else:
    _ParamType = click.ParamType

_MAX_DENOMINATOR: Final = 1001 * 1000
_RATE: Final = re.compile(r"[0-9]+(\.[0-9]+|/[0-9]+)?\Z")


class Rate(_ParamType):
    """Frames per second: 24, 23.976 or 24000/1001."""

    name = "rate"

    def convert(self, value: Any, param: Any, ctx: Any) -> Fraction:
        """Return the rate as a fraction; 23.976 and its like are those of NTSC."""
        if isinstance(value, Fraction):
            return value
        try:
            rate = Fraction(value) if _RATE.match(value) else Fraction(0)
        except (ValueError, ZeroDivisionError):
            rate = Fraction(0)
        if not Fraction(1, 1000) <= rate <= 100_000:
            self.fail(f"{value!r} is not a number of frames per second, such as 24 or 30000/1001")
        whole = Fraction(round(rate * Fraction(1001, 1000)) * 1000, 1001)
        return whole if rate.denominator > 1 and abs(rate - whole) < Fraction(1, 1000) else rate


@dataclasses.dataclass(frozen=True, kw_only=True)
class Job:
    """What a call does; names are those of the options.

    `is_named`: OUT was given as --out.
    """

    sources: list[str]
    out: str
    fps: Fraction | None
    codec: Codec | None
    saved: Saved
    quality: int | None
    bits: int | None
    start: StartOptions
    input_colour: Colour | None
    subimage: int
    layer: str | None
    half: bool
    mask: str | None
    emission: str | None
    overwrite: bool
    is_named: bool


class _Frame(NamedTuple):
    """A picture, decoded, and what is known of it.

    - `place`: Its number, counted from the first.
    - `coding`: That of a video; None: of an image.
    """

    picture: Picture
    place: int
    time: Fraction
    duration: Fraction
    coding: Coding | None
    aspect: Fraction


class _First(NamedTuple):
    """The first frame, its result, and where all start."""

    frame: _Frame
    final: Picture
    start: Start


class _Clip(NamedTuple):
    """What is read: frames, about how many, their rate, the unit of time, a file with audio.

    - `steps`: Frames per second in which stages in time count; None: frames have their own times.
    - `places`: The number of each frame, counted from the first; None: none is missing.
    """

    frames: Iterator[_Frame]
    expected: int | None
    rate: Fraction
    time_base: Fraction
    audio: str
    steps: float | None
    places: AnySequence[int] | None = None


def check(job: Job) -> None:
    """Raise an error for files and options that do not go together."""
    videos = [source for source in job.sources if is_video(source)]
    if videos and len(job.sources) > 1:
        raise click.UsageError(f"{videos[0]}: a video is a whole IN; leave out the others")
    if is_stream(job.out) and job.out != os.devnull and not is_video(job.out):
        raise click.UsageError("a video needs a file or a pattern of numbers as OUT")
    if PIPE in job.sources:
        raise click.UsageError("standard input has one image; name the files of a video")
    with as_wrong_use():
        if is_video(job.out):
            writing.check_options(job.out, job.codec, job.saved, job.quality, job.bits)
        else:
            _pattern_of(job.out)
            if job.codec is not None:
                raise ValueError("codec: OUT is no video")
            image_writing.check_options(job.out, job.saved, job.quality, job.bits)
    if is_video(job.out):
        _check_target(job)


def _check_target(job: Job) -> None:
    check_target(job.out)
    if not os.path.isfile(job.out) or job.overwrite:
        return
    for source in job.sources:
        if os.path.isfile(source) and os.path.samefile(source, job.out):
            raise click.UsageError(f"{job.out}: is read as IN; use --overwrite to replace it")
    if job.is_named:
        return
    try:
        with VideoFile(job.out) as file:
            is_own = file.comment == safe_writing.PROGRAM
    except (OSError, ValueError):
        is_own = False
    if not is_own:
        raise click.UsageError(
            f"{job.out}: is a file that vkbloom did not write; to replace it, give it as "
            f"-o {job.out}, or --overwrite"
        )


def _pattern_of(out: str) -> Pattern:
    pattern = pattern_of(os.path.basename(out))
    if pattern is None:
        raise ValueError(
            f"{out}: one file cannot hold the frames of a video; name a video such as out.mp4, or "
            "a pattern such as f.%04d.png"
        )
    return pattern


def run(job: Job, adapter: str) -> None:
    """Add bloom to the frames, one after the other."""
    check(job)
    with ExitStack() as stack:
        clip = _open(job, stack)
        bar = tqdm(
            _close_later(clip.frames, stack),
            total=clip.expected,
            unit="frame",
            leave=False,
            disable=hides_progress(),
        )
        made = _make(job, iter(bar), clip, adapter, stack)
        # Closed before the files are: Ctrl-C waits for the frame that the thread writes.
        with closing(write_in_background(made)) as written:
            count = sum(1 for _ in written)
    if is_video(job.out):
        say(f"wrote {job.out}, {count} frames")
    else:
        say(f"wrote {count} images of the pattern {job.out}")


def _close_later(frames: Iterator[_Frame], stack: ExitStack) -> Iterator[_Frame]:
    """Return the frames, whose files are closed with the stack."""
    close = getattr(frames, "close", None)
    if close is not None:
        stack.callback(close)
    return frames


def _open(job: Job, stack: ExitStack) -> _Clip:
    """Return the frames that are read."""
    if not is_video(job.sources[0]):
        return _open_images(job)
    source = job.sources[0]
    file = stack.enter_context(VideoFile(source))
    rate = job.fps or file.rate
    is_copied = file.has_audio and is_video(job.out) and job.fps is None
    if file.has_audio and is_video(job.out) and not is_copied:
        note(f"{source}: its audio is left out, since --fps changes the times")

    def frames() -> Iterator[_Frame]:
        with closing(file.frames()) as read:
            for place, frame in enumerate(read):
                picture = frame.decode(job.input_colour)
                if place == 0:
                    for text in picture.notes:
                        note(f"{source}: {text}")
                time, duration = frame.time, frame.duration
                if job.fps is not None:
                    time, duration = place / rate, 1 / rate
                yield _Frame(picture, place, time, duration, frame.coding, frame.aspect)

    unit = file.time_base if job.fps is None else 1 / rate
    steps = None if job.fps is None else float(rate)
    return _Clip(frames(), file.frames_expected, rate, unit, source if is_copied else "", steps)


def _open_images(job: Job) -> _Clip:
    files = [file for source in job.sources for file in expand(source)]
    if (missing := gap_note(files)) is not None:
        note(f"{job.sources[0]}: {missing}; they are time in which the frame before stays")
    rate = job.fps or DEFAULT_RATE
    numbers = [number for _, number in files if number is not None]
    is_numbered = len(numbers) == len(files) and len(job.sources) == 1
    places = [number - numbers[0] for number in numbers] if is_numbered else range(len(files))

    def frames() -> Iterator[_Frame]:
        following = [*places[1:], places[-1] + 1]
        for (name, _), place, after in zip(files, places, following, strict=True):
            picture = read_picture(name, job.subimage, job.input_colour, layer=job.layer)
            duration = (after - place) / rate
            yield _Frame(picture, place, place / rate, duration, None, Fraction(1))

    return _Clip(frames(), len(files), rate, 1 / rate, "", float(rate), places)


class _Reading(Input):
    """Frames as a sequence reads them, once; the origin of each is the frame and its picture."""

    is_repeatable = False

    def __init__(self, frames: Iterator[_Frame], clip: _Clip, start: Start, job: Job) -> None:
        self._frames, self._clip, self._start, self._job = frames, clip, start, job

    @property
    def settings(self) -> Settings:
        return self._start.settings

    def read(self, first: int) -> Generator[Taken, None, None]:
        for frame in itertools.islice(self._frames, first, None):
            picture = self.develop(frame)
            time, duration = float(frame.time), float(frame.duration)
            yield Taken(picture.pixels, time, duration, (frame, picture))

    def develop(self, frame: _Frame) -> Picture:
        """Return the picture whose pixels the bloom reads."""
        picture = self._start.develop(frame.picture)
        if not self._job.half:
            return picture
        return dataclasses.replace(picture, pixels=narrow(picture.pixels, np.dtype(np.float16)))

    def count(self) -> int | None:
        return None

    def place_of(self, number: int) -> int:
        return number if self._clip.places is None else self._clip.places[number]


def _make(
    job: Job, frames: Iterator[_Frame], clip: _Clip, adapter: str, stack: ExitStack
) -> Iterator[tuple[None, Callable[[], object]]]:
    """Yield of each frame the function that writes it."""
    begun = next(frames, None)
    if begun is None:
        return
    # Those of the first frame are those of all, so that nothing jumps.
    start = job.start.of(begun.picture.highlights)
    renderer = stack.enter_context(open_renderer(adapter))
    tell_device(renderer)
    is_blended = start.settings.alpha != "keep"
    glows = read_glows(job.mask, job.emission, job.input_colour, is_blended=is_blended)
    reading = _Reading(itertools.chain([begun], frames), clip, start, job)
    given = job.start.stages
    stages = {name: given.get(name) for name in ("exposure", "taa")}
    how = {"framebuffers": ["final"]}
    work = work_of_images(lambda: renderer, glows.of, how, stages)
    state = given.get("state")
    first = Taken(reading.develop(begun).pixels)
    _check_first(renderer, first.image, start.settings, {**glows.of(first.image), **given})
    write: Callable[[_Frame, Picture, Frames], object] | None = None
    sequence = Sequence(reading, work, Clock(clip.steps, None), state=state)
    for made, (frame, picture) in sequence.with_origins():
        final = finish(picture, made["final"], start.settings)
        if write is None:
            write = _writer_of(job, clip, _First(frame, final, start), stack)
        yield None, functools.partial(write, frame, final, made)


def _check_first(
    renderer: Renderer, image: NDArray[Any], settings: Settings, given: Mapping[str, Any]
) -> None:
    """Compute the first frame, so that wrong options fail, and print a note if it has no bloom."""
    names = no_bloom.with_bloom(["final"], settings)
    with as_wrong_use():
        made = renderer.apply(image, settings, **given, framebuffers=names)
    if no_bloom.is_without(made):
        note(f"in the first frame, {no_bloom.reason(settings)}")


def _writer_of(
    job: Job, clip: _Clip, first: _First, stack: ExitStack
) -> Callable[[_Frame, Picture, Frames], object]:
    """Return the function that writes a frame."""
    if not is_video(job.out):
        pattern, folder = _pattern_of(job.out), os.path.dirname(job.out)

        def save(frame: _Frame, picture: Picture, made: Frames) -> None:
            facts = settings_facts(first.start.settings, first.start.expand, made)
            file = Path(folder, pattern.name_of(frame.place))
            file.parent.mkdir(exist_ok=True)
            image_writing.save(picture, file, job.saved, facts, job.quality, bits=job.bits)

        return save
    codec, coding = writing.choose_coding(
        job.out, first.final, first.frame.coding, codec=job.codec, saved=job.saved, bits=job.bits
    )
    height, width = first.final.pixels.shape[:2]
    layout = writing.Layout(
        size=(width, height),
        rate=clip.rate.limit_denominator(_MAX_DENOMINATOR),
        time_base=clip.time_base,
        coding=coding,
        codec=codec,
        aspect=first.frame.aspect,
        quality=job.quality,
        audio=clip.audio,
    )
    video = stack.enter_context(writing.writing(job.out, layout))
    return lambda frame, picture, _: video.write(picture, frame.time, frame.duration)
