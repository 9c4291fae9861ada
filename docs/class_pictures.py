"""Draw what the code of the page for teachers computes, for this page; called by conf.py."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

from vkbloom._io.srgb import encode_srgb

mpl.use("agg")
from matplotlib import pyplot as plt

PAGE = Path(__file__).with_name("class.md")
DARK = "#222222"
Array = NDArray[Any]


def run(page: Path) -> dict[str, Any]:
    """Return the variables of a page's code, run from top to bottom."""
    names: dict[str, Any] = {"__name__": "page"}
    blocks = re.findall(r"^```python\n(.*?)^```", page.read_text(), re.DOTALL | re.MULTILINE)
    with contextlib.redirect_stdout(io.StringIO()):
        for block in blocks:
            exec(block, names)
    return names


def encode(light: Array) -> Array:
    """Return linear light as a display takes it, clipped to 0..1."""
    return encode_srgb(np.clip(light[..., :3].astype(np.float32), 0, 1))


def draw_row(path: Path, pictures: list[Array], height: float = 1.8) -> None:
    """Write pictures side by side, pixel by pixel, on a ground for light and dark pages."""
    widths = [one.shape[1] / one.shape[0] for one in pictures]
    size = height * sum(widths) + 0.06 * (len(pictures) - 1), height
    figure, cells = plt.subplots(
        1, len(pictures), figsize=size, facecolor=DARK, width_ratios=widths, squeeze=False
    )
    figure.subplots_adjust(0, 0, 1, 1, 0.04, 0)
    for axes, picture in zip(cells.flat, pictures, strict=True):
        axes.set_axis_off()
        axes.imshow(picture, aspect="auto", interpolation="nearest")
    figure.savefig(path, dpi=100)
    plt.close(figure)


def draw_profiles(path: Path, profiles: dict[str, Array]) -> None:
    """Write the brightness over the distance, on a logarithmic scale."""
    with plt.style.context("dark_background"):
        figure, axes = plt.subplots(figsize=(7, 3), layout="constrained", facecolor=DARK)
        axes.set_facecolor(DARK)
        for (name, values), style in zip(profiles.items(), ("-", "--", "-."), strict=True):
            axes.semilogy(np.where(values > 1e-7, values, np.nan), style, label=name, linewidth=2)
        axes.set(xlabel="distance in pixels", ylabel="brightness", ylim=(1e-6, 1))
        axes.legend()
        figure.savefig(path, dpi=100)
        plt.close(figure)


def write(folder: Path) -> None:
    """Write the pictures."""
    folder.mkdir(parents=True, exist_ok=True)
    made = run(PAGE)
    frame, frames, two = made["frame"], made["frames"], made["two"]
    peak = two["blur_vertical"][..., :3].max(), two["bloom"][..., :3].max()
    rows = {
        "threshold": [encode(frame), encode(made["glow"])],
        "blur": [encode(frames[f"down_{level}"]) for level in range(5)] + [encode(frames["bloom"])],
        "composition": [encode(frame), encode(0.6 * frames["bloom"]), encode(frames["final"])],
        "separable": [
            encode(two[name] / most)
            for name, most in zip(("blur_vertical", "bloom"), peak, strict=True)
        ],
        "hdr": [encode(made["bright"]), encode(made["clipped"])],
    }
    for name, pictures in rows.items():
        draw_row(folder / f"{name}.png", pictures)
    gap = np.full((4, *made["of_light"].shape[1:]), 0.13)
    both = np.concatenate([made["of_light"], gap, made["of_code"]]).clip(0, 1)
    draw_row(folder / "linear.png", [both])
    draw_profiles(folder / "pyramid.png", made["profiles"])
