"""``vkbloom check --sequence``: flashes and flicker of files and videos."""

from __future__ import annotations

import itertools
import json
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from typing import Any, Final, NamedTuple, TypeAlias, TypeVar, get_args

import click
import numpy as np
from numpy.typing import NDArray

from vkbloom import testing
from vkbloom._cli.fields import TAA
from vkbloom._cli.program import as_wrong_use, is_given
from vkbloom._cli.sequences import expand
from vkbloom._cli.terminal import note
from vkbloom._io.array_files import read
from vkbloom._io.numbered_files import NumberedFile, as_frames, gap_note, gaps
from vkbloom._io.video.coding import HLG, PQ
from vkbloom._io.video.reading import VideoFile, is_video
from vkbloom._renderer.frames import Frames
from vkbloom._views.plain_values import plain
from vkbloom.testing._display import Display, Encoding
from vkbloom.testing._sequences import Standard

#: The most frames from the first to the last number of a sequence: half an hour at 60 a second.
MAX_FRAMES: Final = 108_000
_ABOVE_0: Final = click.FloatRange(0, min_open=True)
_LUMINANCE: Final = click.FloatRange(1, 1e4)
# Options of a display by the field of `Display`.
_DISPLAY: Final = {"encoding": "display", "white": "display_white", "peak": "display_peak"}

#: What videos are encoded for, by the code points of their curves.
_CURVES: Final[Mapping[int, Encoding]] = {PQ: "pq", HLG: "hlg"}
# Times in milliseconds, as of Matroska, are off by a half each.
_ROUNDED: Final = 0.0015
_MAX_RATE: Final = 240.0

# What the standards are called.
_NAMES: Final = {"wcag22": "WCAG 2.2", "bt1702": "ITU-R BT.1702", "iris": "EA's IRIS"}

_Command = TypeVar("_Command", bound=Callable[..., Any])

#: Yields what is made of each image, from the seconds before it on.
Make: TypeAlias = Callable[[Iterator[NDArray[Any]], Iterator[float]], Iterator[Frames]]


def sequence_options(command: _Command) -> _Command:
    """Add the options of --sequence to a command."""
    options = (
        click.option(
            "--fps",
            type=_ABOVE_0,
            default=60.0,
            help="Frames a second of --sequence; videos have their own.",
        ),
        click.option(
            "--degrees",
            type=_ABOVE_0,
            default=40.0,
            help="Width of --sequence in the field of view, by WCAG 2.2.",
        ),
        click.option(
            "--standard",
            type=click.Choice(get_args(Standard)),
            default="wcag22",
            help="Rules for flashes of --sequence.",
        ),
        click.option(
            "--display",
            type=click.Choice(get_args(Encoding)),
            help="What shows --sequence; by BT.1702.",
        ),
        click.option("--display-white", type=_LUMINANCE, help="Of a value of 1, in cd/m2."),
        click.option("--display-peak", type=_LUMINANCE, help="The largest luminance, in cd/m2."),
        click.option(
            "--taa",
            "antialiasing",
            type=TAA,
            help="Temporal anti-aliasing of --sequence, of an engine.",
        ),
    )
    for option in reversed(options):
        command = option(command)
    return command


def check_unused() -> None:
    """Raise click.UsageError for options of a sequence where none is judged."""
    options = {name: name.replace("_", "-") for name in ("standard", *_DISPLAY.values())}
    for name, option in {**options, "antialiasing": "taa"}.items():
        if is_given(name):
            raise click.UsageError(f"--{option} needs --sequence")


def is_made() -> bool:
    """Whether the options give the frames of a sequence a bloom, an exposure or anti-aliasing."""
    return any(map(is_given, ("preset", "method", "stored", "exposure", "antialiasing")))


class _Sequence(NamedTuple):
    """Pictures in time.

    - `pictures`: Yields each, (H, W, 3) of float32 in linear light, and for how many frames it is
      shown.
    - `length`: How many there are.
    - `gaps`: First and last number of each run that is missing; `missing`: the same in words.
    - `encoding`: What a video is encoded for; None: not known.
    """

    pictures: Callable[[], Iterator[tuple[NDArray[Any], int]]]
    length: int
    fps: float
    gaps: Sequence[tuple[int, int]] = ()
    missing: str | None = None
    encoding: Encoding | None = None

    def frames(self) -> Iterator[NDArray[Any]]:
        """Yield the picture of each frame."""
        for picture, count in self.pictures():
            yield from itertools.repeat(picture, count)

    def made_by(self, make: Make) -> _Sequence:
        """Return the sequence of what is made of each picture."""

        def pictures() -> Iterator[tuple[NDArray[Any], int]]:
            # Several are read before the first of them is made.
            counts: deque[int] = deque()
            steps: deque[float] = deque()

            def images() -> Iterator[NDArray[Any]]:
                wait = 0
                for picture, count in self.pictures():
                    # Before the first one is as much time as before the next.
                    steps.append((wait or count) / self.fps)
                    counts.append(wait := count)
                    yield picture

            def take_steps() -> Iterator[float]:
                while True:
                    yield steps.popleft()

            for made in make(images(), take_steps()):
                yield np.asarray(made["final"][..., :3], np.float32), counts.popleft()

        return self._replace(pictures=pictures)


def judge(source: str, how: Mapping[str, Any], *, as_json: bool, make: Make | None = None) -> int:
    """Print flashes and flicker of files or of a video; return 1 if it fails, else 0.

    `make`: What gives them a bloom or a stage in time.
    """
    degrees, standard = how["degrees"], how["standard"]
    if is_video(source):
        shown = _open_video(source, how["fps"] if is_given("fps") else None)
    else:
        shown = _open_files(source, how["fps"])
    with as_wrong_use():
        display = _display_of(how, shown.encoding)
    if make is not None:
        shown = shown.made_by(make)
    fps, frames = shown.fps, shown.frames
    flashes = testing.flash(frames(), fps, degrees=degrees, standard=standard, display=display)
    seen = testing.flicker(frames(), fps)
    strongest = int(seen.contrast.argmax())
    if as_json:
        values = {
            "frames": shown.length,
            "missing": sum(last - first + 1 for first, last in shown.gaps),
            "gaps": shown.gaps,
            "fps": fps,
            "standard": standard,
            "flash": flashes,
            "flicker": seen,
        }
        click.echo(json.dumps(plain(values), indent=2))
    else:
        wide = f", {degrees:g} degrees wide" if standard == "wcag22" else ""
        click.echo(f"{shown.length} frames at {fps:.6g} a second{wide}, by {_NAMES[standard]}")
        if shown.missing is not None:
            click.echo(f"{shown.missing}; the frame before each is shown until the next one")
        click.echo(str(flashes))
        click.echo(
            f"flicker: contrast up to {seen.contrast[strongest]:.3g}, at "
            f"{seen.frequencies[strongest]:.3g} Hz"
            + ("" if seen.jod is None else f"; {seen.jod:.2f} JOD beside a still")
        )
    if shown.missing is not None:
        note(f"{source}: {shown.missing}; what they show is not judged")
    return int(flashes.failed)


def _open_files(pattern: str, fps: float) -> _Sequence:
    files = as_frames(expand(pattern))
    counts = _count_frames(pattern, files)

    def pictures() -> Iterator[tuple[NDArray[Any], int]]:
        for (file, _), count in zip(files, counts, strict=True):
            yield read(file)[..., :3].astype(np.float32), count

    runs = [(gap.start, gap.stop - 1) for gap in gaps(files)]
    return _Sequence(pictures, len(files), fps, runs, gap_note(files))


def _open_video(path: str, fps: float | None) -> _Sequence:
    """Return the frames of a video; `fps`: in place of its own times."""
    with VideoFile(path) as video:
        times, own = video.times(), float(video.rate)
    with VideoFile(path) as video, closing(video.frames()) as frames:
        encoding = _CURVES.get(next(frames).coding.curve)
    rate, is_regular = (fps, True) if fps is not None else _rate_of(times, own)
    most = round((times[-1] - times[0]) * rate) + 1
    if not is_regular and most > MAX_FRAMES:
        raise ValueError(
            f"{path}: {most} frames of 1 / {rate:.6g} s, the shortest, are too many; at most "
            f"{MAX_FRAMES} are judged; give --fps"
        )

    def pictures() -> Iterator[tuple[NDArray[Any], int]]:
        """Yield each picture when the time of the next one is known."""
        with VideoFile(path) as video, closing(video.frames()) as frames:
            for now, later in itertools.pairwise(itertools.chain(frames, [None])):
                assert now is not None
                wait = 1 if later is None or is_regular else float(later.time - now.time) * rate
                yield now.decode().pixels[..., :3].astype(np.float32), max(1, round(wait))

    return _Sequence(pictures, len(times), rate, encoding=encoding)


def _rate_of(times: Sequence[float], own: float) -> tuple[float, bool]:
    """Return the frames per second of a video, and whether it has a picture for each of them.

    Where times vary, the shortest one from picture to picture is that of a frame.
    """
    steps = [after - before for before, after in itertools.pairwise(times)]
    if not steps or max(abs(step - 1 / own) for step in steps) <= _ROUNDED:
        return own, True
    if max(steps) - min(steps) <= _ROUNDED:
        return len(steps) / (times[-1] - times[0]), True
    return min(1 / max(min(steps), 1e-6), _MAX_RATE), False


def _display_of(how: Mapping[str, Any], encoding: Encoding | None) -> Display | None:
    """Return the display of the options; None: none is given.

    What a video is encoded for stands for --display, by the standards that have one.
    """
    given = {field: how[name] for field, name in _DISPLAY.items() if how[name] is not None}
    if given and how["standard"] == "wcag22":
        raise click.UsageError(
            "--standard wcag22 judges relative luminance; --display needs --standard bt1702"
        )
    if encoding is not None and how["standard"] != "wcag22":
        given.setdefault("encoding", encoding)
    return Display(**given) if given else None


def _count_frames(pattern: str, files: list[NumberedFile]) -> list[int]:
    """Return for how many frames each file is shown: until the number of the next one."""
    numbers = [number for _, number in files if number is not None]
    if len(numbers) < len(files):
        return [1] * len(files)
    if numbers[-1] - numbers[0] >= MAX_FRAMES:
        raise ValueError(
            f"{pattern}: the numbers {numbers[0]} to {numbers[-1]} are not of one sequence; at "
            f"most {MAX_FRAMES} frames are judged"
        )
    return [after - before for before, after in itertools.pairwise(numbers)] + [1]
