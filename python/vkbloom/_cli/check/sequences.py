"""``vkbloom check --sequence``: flashes and flicker of files."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final, TypeVar, get_args

import click
import numpy as np
from numpy.typing import NDArray

from vkbloom import testing
from vkbloom._cli.program import as_wrong_use, is_given
from vkbloom._cli.sequences import expand
from vkbloom._cli.terminal import note
from vkbloom._io.array_files import read
from vkbloom._io.numbered_files import NumberedFile, as_frames, gap_note, gaps
from vkbloom._views.plain_values import plain
from vkbloom.testing._display import Display, Encoding
from vkbloom.testing._sequences import Standard

#: The most frames from the first to the last number of a sequence: half an hour at 60 a second.
MAX_FRAMES: Final = 108_000
_ABOVE_0: Final = click.FloatRange(0, min_open=True)
_LUMINANCE: Final = click.FloatRange(1, 1e4)
# Options of a display by the field of `Display`.
_DISPLAY: Final = {"encoding": "display", "white": "display_white", "peak": "display_peak"}

# What the standards are called.
_NAMES: Final = {"wcag22": "WCAG 2.2", "bt1702": "ITU-R BT.1702", "iris": "EA's IRIS"}

_Command = TypeVar("_Command", bound=Callable[..., Any])


def sequence_options(command: _Command) -> _Command:
    """Add the options of --sequence to a command."""
    options = (
        click.option("--fps", type=_ABOVE_0, default=60.0, help="Frames a second of --sequence."),
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
    )
    for option in reversed(options):
        command = option(command)
    return command


def check_unused() -> None:
    """Raise click.UsageError for options of a sequence where none is judged."""
    for name in ("standard", *_DISPLAY.values()):
        if is_given(name):
            raise click.UsageError(f"--{name.replace('_', '-')} needs --sequence")


def judge(pattern: str, how: Mapping[str, Any], *, as_json: bool) -> int:
    """Print flashes and flicker of a sequence of files; return 1 if it fails, else 0."""
    fps, degrees, standard = how["fps"], how["degrees"], how["standard"]
    files = as_frames(expand(pattern))
    shown = _count_frames(pattern, files)

    def frames() -> Iterator[NDArray[Any]]:
        for (file, _), count in zip(files, shown, strict=True):
            picture = read(file)[..., :3].astype(np.float32)
            yield from itertools.repeat(picture, count)

    with as_wrong_use():
        display = _display_of(how)
    flashes = testing.flash(frames(), fps, degrees=degrees, standard=standard, display=display)
    seen = testing.flicker(frames(), fps)
    strongest = int(seen.contrast.argmax())
    missing = gap_note(files)
    if as_json:
        values = {
            "frames": len(files),
            "missing": sum(shown) - len(files),
            "gaps": [(gap.start, gap.stop - 1) for gap in gaps(files)],
            "fps": fps,
            "standard": standard,
            "flash": flashes,
            "flicker": seen,
        }
        click.echo(json.dumps(plain(values), indent=2))
    else:
        wide = f", {degrees:g} degrees wide" if standard == "wcag22" else ""
        click.echo(f"{len(files)} frames at {fps:g} a second{wide}, by {_NAMES[standard]}")
        if missing is not None:
            click.echo(f"{missing}; the frame before each is shown until the next one")
        click.echo(str(flashes))
        click.echo(
            f"flicker: contrast up to {seen.contrast[strongest]:.3g}, at "
            f"{seen.frequencies[strongest]:.3g} Hz"
            + ("" if seen.jod is None else f"; {seen.jod:.2f} JOD beside a still")
        )
    if missing is not None:
        note(f"{pattern}: {missing}; what they show is not judged")
    return int(flashes.failed)


def _display_of(how: Mapping[str, Any]) -> Display | None:
    """Return the display of the options; None: none is given."""
    given = {field: how[name] for field, name in _DISPLAY.items() if how[name] is not None}
    if given and how["standard"] == "wcag22":
        raise click.UsageError(
            "--standard wcag22 judges relative luminance; --display needs --standard bt1702"
        )
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
