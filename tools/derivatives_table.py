"""Write which fields have a derivative, method by method (docs/derivatives_table.md).

python tools/derivatives_table.py docs/derivatives_table.md
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

import vkbloom
from vkbloom._gradients import on_device
from vkbloom._settings.fields import fields_of
from vkbloom._settings.registry import METHODS
from vkbloom.reference._derivatives import differentiable

IMAGE = np.random.default_rng(0).random((32, 40, 4)) * 2
KERNEL = np.random.default_rng(1).random((5, 5))


def of_method(name: str) -> vkbloom.Settings:
    """Return settings of a method with a threshold."""
    kind = METHODS[name]
    settings: Any = kind(psf=KERNEL) if name == "convolution" else kind()
    # The levels of two engines have a height of their own, which takes long.
    smaller = {"bevy": {"max_mip_dimension": 32}, "filament": {"resolution": 32}}
    settings = settings.replace(**smaller.get(name, {}))
    if name == "pyramid":
        settings = settings.replace(level_weights=(1.0,) * settings.levels)
    fields = fields_of(kind)
    if settings.threshold is None and not fields["threshold"].fixed:
        settings = settings.replace(threshold=0.4)
    return settings if fields["knee"].fixed else settings.replace(knee=0.5)


def is_linear(settings: vkbloom.Settings, name: str) -> bool:
    """Whether the final image is an affine function of the field, and not a constant."""
    if name == "threshold":  # of each pixel at another value
        return False
    if name == "reference_white":  # of one encoding alone
        settings = settings.replace(encoding="pq")
    middle = np.asarray(getattr(settings, name), np.float64)
    step = 0.05 * np.maximum(np.abs(middle), 0.1)
    finals = []
    for offset in (1, 2, 3):
        value = middle + offset * step
        field = tuple(map(as_field, value)) if value.ndim else float(value)
        try:
            changed = settings.replace(**{name: field})
        except ValueError:  # at the upper end of the range
            value = middle - offset * step
            field = tuple(map(as_field, value)) if value.ndim else float(value)
            changed = settings.replace(**{name: field})
        finals.append(vkbloom.reference.apply(IMAGE, changed)["final"])
    bend = finals[0] - 2 * finals[1] + finals[2]
    moves = np.abs(finals[2] - finals[0]).max() > 0
    return bool(moves and np.abs(bend).max() <= 1e-12 * max(1.0, np.abs(finals[1]).max()))


def as_field(value: Any) -> Any:
    """Return a number, or a tuple of numbers."""
    return tuple(map(as_field, value)) if np.ndim(value) else float(value)


def table() -> str:
    """Return the table."""
    lines = [
        "| method | by the image | linear | curved or piecewise | none |",
        "| --- | --- | --- | --- | --- |",
    ]
    with vkbloom.Renderer("software") as renderer:
        by_image = {
            method: "device" if on_device(renderer, of_method(method)) else "reference"
            for method in METHODS
        }
    for method in METHODS:
        settings = of_method(method)
        known = differentiable(settings)
        linear = [name for name in known if is_linear(settings, name)]
        columns = (
            linear,
            [name for name in known if name not in linear],
            [name for name in fields_of(type(settings)) if name not in known],
        )
        cells = (", ".join(f"`{name}`" for name in names) for names in columns)
        lines.append(f"| `{type(settings).__name__}` | {by_image[method]} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("path", type=Path)
    parser.parse_args().path.write_text(table(), encoding="utf-8")


if __name__ == "__main__":
    main()
