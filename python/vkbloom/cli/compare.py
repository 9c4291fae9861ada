"""``vkbloom compare``: how much two image files differ."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable
from typing import Any

import click
from rich.console import Console

from vkbloom.checks import check_number
from vkbloom.cli import fields
from vkbloom.cli.image_files import check_part_is_given, note, read, subimage_option
from vkbloom.cli.program import blaming_the_call
from vkbloom.io import image_writing
from vkbloom.io.images import Picture, StoredImage
from vkbloom.views.comparison import Comparison, compare, difference
from vkbloom.views.tolerances import Tolerances, failures


def _limit(name: str, text: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Make an option of a limit, which is a number or none."""
    return click.option(
        f"--{name.replace('_', '-')}",
        type=fields.form_of(float | None),
        help=f"{text} [default none]",
    )


def tolerances_of(
    *,
    max_error: float | None = None,
    min_ssim: float | None = None,
    min_psnr: float | None = None,
    max_flip: float | None = None,
    fail_percent: float | None = None,
) -> Tolerances:
    """Return what the limits of the command line mean; without any, all values must be equal."""
    if max_error is not None:
        check_number("max_error", max_error, 0.0, math.inf)
    if fail_percent is not None:
        # `max_error` says from which difference on a pixel counts.
        atol, hard_fail = max_error or 0.0, None
    else:
        atol, hard_fail = 0.0, max_error
        has_none = (max_error, min_ssim, min_psnr, max_flip) == (None, None, None, None)
        fail_percent = 0.0 if has_none else 100.0
    return Tolerances(
        atol=atol,
        fail_percent=fail_percent,
        hard_fail=hard_fail,
        ssim=min_ssim,
        psnr=min_psnr,
        flip=max_flip,
    )


@click.command()
@click.argument("first", metavar="A", type=click.Path())
@click.argument("second", metavar="B", type=click.Path())
@click.option(
    "--diff",
    metavar="OUT",
    type=click.Path(),
    help="Write a picture of the absolute differences; those of alpha are white, and what is NaN "
    "or infinite in one image only is magenta.",
)
@click.option(
    "--diff-scale",
    metavar="X",
    type=click.FLOAT,
    help="What they are multiplied with [default so that the largest becomes 1]",
)
@click.option(
    "--allow-nan",
    is_flag=True,
    help="Let NaN, and infinity of one sign, pass where both images have it.",
)
@click.option(
    "--data-range",
    metavar="X",
    type=click.FLOAT,
    help="Of SSIM and PSNR [default 1; of floats what they span together with 0 and 1]",
)
@click.option("--json", "as_json", is_flag=True, help="Print one object.")
@subimage_option
@_limit("max_error", "Largest difference of a value that is allowed, integers counting as 0 to 1")
@_limit("min_ssim", "Smallest structural similarity that is allowed, -1 to 1")
@_limit("min_psnr", "Smallest peak signal-to-noise ratio that is allowed, in dB")
@_limit("max_flip", "Largest mean FLIP that is allowed, 0 to 1")
@_limit(
    "fail_percent",
    "Percentage of pixels that may differ by more than max_error (by anything without one), "
    "0 to 100",
)
def command(
    *,
    first: str,
    second: str,
    diff: str | None,
    diff_scale: float | None,
    allow_nan: bool,
    data_range: float | None,
    as_json: bool,
    subimage: int,
    **limits: float | None,
) -> int:
    """Compare the image files A, the reference, and B.

    Prints the largest error with its place and the mean error, the share of pixels that differ,
    PSNR and SSIM (scikit-image's, over all channels) and the mean FLIP (OpenImageIO's, of the
    colours alone: of integers, as sRGB, LDR-FLIP; of floats, as linear, HDR-FLIP). Integers
    count as 0 to 1. Values are compared as they are stored. Of files with several parts, as
    vkbloom render writes them, --subimage says which one is compared.

    The exit status is 1 if a limit is exceeded, and without any limit, as of cmp, if a single
    value differs. It is always 1 for images of different size, number of channels or kind
    (integers against floats), for NaN and infinity in one of them, and in both at the same place
    without --allow-nan. A figure that has a limit and cannot be computed, such as SSIM of an
    image under 7 pixels, fails too.
    """
    with blaming_the_call():
        tolerances = tolerances_of(**limits)
        if diff is not None:
            image_writing.check_writable(diff)
    if diff is None and diff_scale is not None:
        raise click.UsageError("--diff-scale is for --diff")
    a, b = read(first, subimage), read(second, subimage)
    check_part_is_given(first, a)
    check_part_is_given(second, b)
    # FLIP of a large picture of floats takes half a minute.
    with blaming_the_call(), Console(stderr=True).status("Comparing"):
        found = compare(
            a.pixels,
            b.pixels,
            threshold=tolerances.atol or 0.0,
            allow_nan=allow_nan,
            data_range=data_range,
        )
    found = _with_windows(found, a, b)
    failed = tuple(reason for _, reason in failures(found, tolerances, tolerances.metrics))
    scale = None
    if diff is not None and found.max_error is None:
        note(f"{diff} is not written: there are no differences of single values")
    elif diff is not None:
        scale = _write_difference(a, b, diff, diff_scale)
    if as_json:
        click.echo(json.dumps(_object(first, second, found, failed, scale), indent=2))
    else:
        for line in _lines(first, second, a, found, failed):
            click.echo(line)
        if scale is not None:
            click.echo(f"wrote {diff}, differences times {scale:.6g}")
    return 1 if failed else 0


def _with_windows(found: Comparison, a: StoredImage, b: StoredImage) -> Comparison:
    """Add a mismatch where pixels of one size have different places."""
    windows = [(*image.origin, *image.display) for image in (a, b)]
    if a.pixels.shape[:2] != b.pixels.shape[:2] or windows[0] == windows[1]:
        return found
    places = " against ".join(
        f"data at {x},{y} and display {width} x {height} at {left},{top}"
        for x, y, left, top, width, height in windows
    )
    reason = f"the windows differ, {places}"
    return dataclasses.replace(found, mismatches=(*found.mismatches, reason))


def _write_difference(a: StoredImage, b: StoredImage, path: str, scale: float | None) -> float:
    """Write the difference picture and return its scale."""
    with blaming_the_call():
        picture, used = difference(a.pixels, b.pixels, scale)
    for text in image_writing.save(Picture.of_values(picture), path):
        note(text)
    return used


def _object(
    first: str,
    second: str,
    found: Comparison,
    failed: tuple[str, ...],
    scale: float | None,
) -> dict[str, Any]:
    """Return what --json prints; JSON has no infinity, so that it becomes None."""
    figures = {
        name: None if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in dataclasses.asdict(found).items()
    }
    return {
        "a": first,
        "b": second,
        "passed": not failed,
        "failures": failed,
        "identical": found.identical,
        **figures,
        "diff_scale": scale,
    }


def _lines(
    first: str,
    second: str,
    a: StoredImage,
    found: Comparison,
    failed: tuple[str, ...],
) -> list[str]:
    """Return the report for people."""
    height, width = a.pixels.shape[:2]
    lines = [f"{first} and {second}"]
    lines.append(f"  {width} x {height}, {', '.join(a.channels)}, {a.pixels.dtype}")
    if found.percent_over is not None:
        lines += _figures(found, a.channels)
    for reason in failed:
        lines.append(f"FAILED: {reason}")
    if not failed:
        lines.append("identical" if found.identical else "passed")
    return lines


def _figures(found: Comparison, channels: tuple[str, ...]) -> list[str]:
    largest = _shown(found.max_error)
    if found.max_error_at is not None and found.max_error_values is not None:
        x, y, channel = found.max_error_at
        values = " against ".join(f"{value:.6g}" for value in found.max_error_values)
        largest += f" at x {x}, y {y}, channel {channels[channel]}: {values}"
    over = f" by more than {found.threshold:g}" if found.threshold else ""
    rows = {
        "max error": largest,
        "mean error": _shown(found.mean_error),
        "pixels": f"{_shown(found.percent_over)} % differ{over}",
        "PSNR": f"{_shown(found.psnr)} dB" if found.psnr is not None else "",
        "SSIM": _shown(found.ssim),
        "FLIP": _shown(found.flip),
    }
    for name, reason in found.not_computed.items():
        rows[name.upper()] = f"not computed: {reason}"
    return [f"  {label:<11}{text}" for label, text in rows.items()]


def _shown(value: float | None) -> str:
    return "no values to compare" if value is None else f"{value:.6g}"
