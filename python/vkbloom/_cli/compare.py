"""``vkbloom compare``: measure the differences of two image files."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable
from typing import Any

import click
from rich.console import Console

from vkbloom._cli import fields
from vkbloom._cli.image_files import other_parts, read, subimage_option
from vkbloom._cli.program import as_wrong_use
from vkbloom._cli.terminal import Form, is_quiet, json_option, note, say
from vkbloom._io import image_writing, safe_writing
from vkbloom._io.picture import Picture
from vkbloom._numbers import check_number
from vkbloom._views.comparison import Comparison, compare, difference
from vkbloom._views.diagnosis import Diagnosis, diagnose
from vkbloom._views.plain_values import plain
from vkbloom._views.tolerances import Tolerances, failures


def _limit(name: str, text: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Make the option of a limit: a number, or none."""
    return click.option(
        f"--{name.replace('_', '-')}",
        type=fields.or_none(click.FLOAT),
        help=f"{text} [default none]",
    )


def tolerances_of(
    *, max_error: float | None = None, min_ssim: float | None = None, max_flip: float | None = None
) -> Tolerances:
    """Make `Tolerances` from the command line's limits; without a limit, values must be equal."""
    if max_error is not None:
        check_number("max_error", max_error, 0.0, math.inf)
    percent = 0.0 if (max_error, min_ssim, max_flip) == (None, None, None) else 100.0
    return Tolerances(
        atol=0.0, fail_percent=percent, hard_fail=max_error, ssim=min_ssim, flip=max_flip
    )


@click.command()
@click.argument("first", metavar="A", type=click.Path())
@click.argument("second", metavar="B", type=click.Path())
@click.option(
    "--diff", metavar="OUT", type=click.Path(), help="Write a picture of the absolute differences."
)
@click.option("--allow-nan", is_flag=True, help="Accept NaN and infinity that both images have.")
@json_option("Print one object.")
@subimage_option
@_limit("max_error", "Largest allowed difference of a value; integers are scaled to 0..1")
@_limit("min_ssim", "Smallest allowed structural similarity, -1 to 1")
@_limit("max_flip", "Largest allowed mean FLIP, 0 to 1")
def command(
    *,
    first: str,
    second: str,
    diff: str | None,
    allow_nan: bool,
    form: Form,
    subimage: int,
    **limits: float | None,
) -> int:
    """Compare the image files A (the reference) and B.

    Prints the largest error and its position, the mean error, the percentage of pixels that
    differ, PSNR and SSIM (scikit-image, over all channels) and the mean FLIP (OpenImageIO, of the
    colours without alpha: LDR-FLIP of integers as sRGB, HDR-FLIP of floats as linear). It names the
    cause if a single one explains the difference: a gain, shift, gamma, clamp, flip, another order
    of channels, premultiplied alpha, NaN or rounding; with the residual that remains. Integers
    are scaled to 0..1. Stored values are compared without decoding. For files with several parts,
    as vkbloom render writes them, --subimage chooses the part to compare.

    The exit status is 1 if a limit is exceeded. Without a limit it is 1 if any value differs, as
    with cmp. It is always 1 if the images differ in size, number of channels or type (integers
    against floats), if one has NaN or infinity where the other has not, and, without --allow-nan,
    if both have it. It is also 1 if a figure with a limit cannot be computed, such as the SSIM of
    an image smaller than 7 pixels.
    """
    with as_wrong_use():
        tolerances = tolerances_of(**limits)
        if diff is not None:
            safe_writing.writer_of(diff)
    a, b = read(first, subimage), read(second, subimage)
    for file, picture in ((first, a), (second, b)):
        if parts := other_parts(picture):
            told = f"{file}: has several parts; choose one with --subimage: {parts}"
            raise click.UsageError(told)
    # FLIP of a large picture of floats takes half a minute.
    with as_wrong_use(), Console(stderr=True, quiet=is_quiet()).status("Comparing"):
        result = compare(a.pixels, b.pixels, allow_nan=allow_nan)
        cause = diagnose(a.pixels, b.pixels)
    result = _with_windows(result, a, b)
    failed = tuple(reason for _, reason in failures(result, tolerances, tolerances.metrics))
    scale = None
    if diff is not None and result.max_error is None:
        note(f"{diff} is not written: the images have no values to compare")
    elif diff is not None:
        scale = _write_difference(a, b, diff)
    if form == "json":
        shown = _object((first, second), result, failed, scale, cause)
        click.echo(json.dumps(shown, indent=2))
    else:
        for line in _lines((first, second), a, result, failed, cause):
            click.echo(line)
        if scale is not None:
            say(f"wrote {diff}, differences times {scale:.6g}")
    return 1 if failed else 0


def _with_windows(comparison: Comparison, a: Picture, b: Picture) -> Comparison:
    """Add a mismatch if images of one size have different data or display windows."""
    windows = [(*image.header.origin, *image.header.display) for image in (a, b)]
    if a.pixels.shape[:2] != b.pixels.shape[:2] or windows[0] == windows[1]:
        return comparison
    told = " against ".join(
        f"data at {x},{y} and display {width} x {height} at {left},{top}"
        for x, y, left, top, width, height in windows
    )
    reason = f"the windows differ, {told}"
    return dataclasses.replace(comparison, mismatches=(*comparison.mismatches, reason))


def _write_difference(a: Picture, b: Picture, path: str) -> float:
    """Write the difference picture and return its scale."""
    picture, scale = difference(a.pixels, b.pixels)
    for text in image_writing.save(Picture.of_values(picture), path):
        note(text)
    return scale


def _object(
    files: tuple[str, str],
    comparison: Comparison,
    failed: tuple[str, ...],
    scale: float | None,
    cause: Diagnosis,
) -> dict[str, Any]:
    """Return the object that --json prints. JSON has no infinity, so it becomes None."""
    return {
        "a": files[0],
        "b": files[1],
        "passed": not failed,
        "failures": failed,
        "identical": comparison.identical,
        "diagnosis": plain(cause),
        **plain(comparison),
        "diff_scale": scale,
    }


def _lines(
    files: tuple[str, str],
    a: Picture,
    comparison: Comparison,
    failed: tuple[str, ...],
    cause: Diagnosis,
) -> list[str]:
    """Return the lines of the text report."""
    height, width = a.pixels.shape[:2]
    lines = [" and ".join(files)]
    lines.append(f"  {width} x {height}, {', '.join(a.header.channels)}, {a.pixels.dtype}")
    if comparison.percent_over is not None:
        lines += _figures(comparison, a.header.channels)
    lines.append(f"  cause      {cause.summary}")
    for reason in failed:
        lines.append(f"FAILED: {reason}")
    if not failed:
        lines.append("identical" if comparison.identical else "passed")
    return lines


def _figures(comparison: Comparison, channels: tuple[str, ...]) -> list[str]:
    largest = _format(comparison.max_error)
    if comparison.max_error_at is not None and comparison.max_error_values is not None:
        x, y, channel = comparison.max_error_at
        values = " against ".join(f"{value:.6g}" for value in comparison.max_error_values)
        largest += f" at x {x}, y {y}, channel {channels[channel]}: {values}"
    rows = {
        "max error": largest,
        "mean error": _format(comparison.mean_error),
        "pixels": f"{_format(comparison.percent_over)} % differ",
        "PSNR": f"{_format(comparison.psnr)} dB" if comparison.psnr is not None else "",
        "SSIM": _format(comparison.ssim),
        "FLIP": _format(comparison.flip),
    }
    for name, reason in comparison.not_computed.items():
        rows[name.upper()] = f"not computed: {reason}"
    return [f"  {label:<11}{text}" for label, text in rows.items()]


def _format(value: float | None) -> str:
    return "no values to compare" if value is None else f"{value:.6g}"
