"""``vkbloom check --sequence``: judge the frames of a sequence in time."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray

import vkbloom
from vkbloom import testing
from vkbloom._cli.sequences import expanded
from vkbloom._views.plain_values import plain


def judge(pattern: str, fps: float, degrees: float, *, as_json: bool) -> int:
    """Print flashes and flicker of a sequence of files; return 1 if it fails WCAG 2.2, else 0."""
    files = [path for path, _ in expanded(pattern)]

    def frames() -> Iterator[NDArray[Any]]:
        return (vkbloom.read(file)[..., :3].astype(np.float32) for file in files)

    flashes = testing.flash(frames(), fps, degrees=degrees)
    seen = testing.flicker(frames(), fps)
    strongest = int(seen.contrast.argmax())
    if as_json:
        values = {"frames": len(files), "fps": fps, "flash": flashes, "flicker": seen}
        click.echo(json.dumps(plain(values), indent=2))
    else:
        click.echo(f"{len(files)} frames at {fps:g} a second, {degrees:g} degrees wide")
        click.echo(str(flashes))
        click.echo(
            f"flicker: contrast up to {seen.contrast[strongest]:.3g}, at "
            f"{seen.frequencies[strongest]:.3g} Hz"
            + ("" if seen.jod is None else f"; {seen.jod:.2f} JOD beside a still")
        )
    return int(flashes.general or flashes.red)
