"""Draw the pictures of docs/concepts.md, docs/gallery.md and the saucer of docs/explorer.md.

python tools/docs_pictures.py docs/pictures

- flow_forward.png, flow_deferred.png: every framebuffer with those that it is made from, by the
  renderer's plan
- gallery.jpg: the saucer with each preset
- the flowchart of docs/plans.md, from a plan
- profiles.png: how the light of a point falls off with each preset
"""

from __future__ import annotations

import dataclasses
import os
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import OpenImageIO as oiio

import vkbloom
from vkbloom._views import pictures

mpl.use("agg")
from matplotlib import pyplot as plt

SIZE = (640, 360)
# A colour that is readable in the light and the dark theme.
INK = "#8a929a"


def edges(plan: vkbloom.Plan) -> dict[str, set[str]]:
    """Return which framebuffers each is made from, in the order that the data flows."""
    made_from: dict[str, set[str]] = defaultdict(set)
    for one in plan.passes:
        for target in one.writes:
            made_from[target] |= set(one.reads) - {target}
    return dict(made_from)


#: Column and row of each framebuffer in its figure.
FORWARD = {
    "glow": (0, 0),
    "blur_vertical": (1, 0),
    "bloom": (2, 0),
    "scene": (2, 1),
    "final": (3, 0.5),
    "glow_depth": (0, 1),
    "depth": (1, 1),
}
DEFERRED = {
    "brightness": (0, 0.8),
    "albedo": (0, 1.8),
    "normal": (0, 2.8),
    "position": (0, 3.8),
    "depth": (4, 3.3),
    "down_0": (1, 0),
    "down_1": (1, 1),
    "down_2": (2, 1.5),
    "up_1": (3, 1),
    "up_0": (3, 0),
    "bloom": (4, 0.6),
    "scene": (2.2, 3),
    "final": (5, 1.7),
}
_WIDTH, _HEIGHT, _CAPTION = 1.6, 0.9, 0.4  # of a box
_ACROSS, _DOWN = 2.2, 1.6  # from box to box


def edge(box: tuple[float, float], towards: tuple[float, float]) -> tuple[float, float]:
    """Return the point where a line between the centres of two boxes leaves the first."""
    x, y = towards[0] - box[0], towards[1] - box[1]
    # The name is below the picture.
    high = _HEIGHT / 2 + 0.05 + (_CAPTION if y < 0 else 0)
    share = min((_WIDTH / 2 + 0.05) / abs(x) if x else np.inf, high / abs(y) if y else np.inf)
    return box[0] + share * x, box[1] + share * y


def draw_flow(
    renderer: vkbloom.Renderer,
    shading: Any,
    settings: Any,
    layout: dict[str, tuple[float, float]],
    path: Path,
) -> None:
    """Draw framebuffers, with arrows to those made from them."""
    scene = dataclasses.replace(vkbloom.Scene.ufo(), glow_intensity=3.0)
    frames = renderer.render(scene, settings, SIZE, shading=shading)
    plan = renderer.plan(scene, settings, SIZE, shading=shading)
    places = {name: (_ACROSS * layout[name][0], -_DOWN * layout[name][1]) for name in frames}
    across = max(x for x, _ in places.values()) + _WIDTH + 0.2
    down = max(-y for _, y in places.values()) + _HEIGHT + _CAPTION + 0.2
    figure, axes = plt.subplots(figsize=(0.75 * across, 0.75 * down), layout="constrained")
    for name, (x, y) in places.items():
        array = frames[name]
        encoded = name == "final" and settings.encoding != "none"
        shown = pictures.picture(array, name, encoded=encoded)[:, :, :3]
        half = min(_WIDTH, _HEIGHT * array.shape[1] / array.shape[0]) / 2
        axes.imshow(
            shown if shown.shape[2] == 3 else shown[:, :, 0],
            extent=(x - half, x + half, y - _HEIGHT / 2, y + _HEIGHT / 2),
            cmap="gray",
            interpolation="antialiased",
        )
        text = f"{name}\n{array.shape[1]} x {array.shape[0]}, {array.dtype}"
        axes.text(x, y - _HEIGHT / 2 - 0.05, text, ha="center", va="top", color=INK, fontsize=7)
    for name, reads in edges(plan).items():
        # Skip images that are not framebuffers, such as the deferred glow.
        for read in reads & set(frames) if name in frames else ():
            ends = edge(places[name], places[read]), edge(places[read], places[name])
            axes.annotate("", *ends, arrowprops={"arrowstyle": "->", "color": INK, "lw": 1.2})
    axes.set_xlim(-_WIDTH / 2 - 0.1, across - _WIDTH / 2 - 0.1)
    axes.set_ylim(-down + _HEIGHT / 2 + 0.1, _HEIGHT / 2 + 0.1)
    axes.set_aspect("equal")
    axes.axis("off")
    figure.savefig(path, dpi=140, transparent=True)
    plt.close(figure)


def draw_gallery(renderer: vkbloom.Renderer, path: Path) -> None:
    """Draw the deferred saucer with each preset, and without bloom."""
    scene = dataclasses.replace(vkbloom.Scene.ufo(), glow_intensity=6.0)
    look = {"tonemap": "aces", "encoding": "srgb", "exposure": -0.5}
    size, columns, label = (480, 270), 2, 34
    every = {"no bloom": vkbloom.Separable(bloom=False), **vkbloom.presets}
    rows = -(-len(every) // columns)
    sheet = np.full((rows * (size[1] + label), columns * size[0], 3), 24, np.uint8)
    labels = []
    for index, (name, settings) in enumerate(every.items()):
        row, column = divmod(index, columns)
        changed = settings.replace(**look)
        # Such a bloom stands for the whole picture, not for its lights alone. Without bloom a scene
        # has no lamps, but its picture before the bloom has.
        if not settings.bloom or (settings.composite == "mix" and settings.intensity == 1):
            lit = renderer.render(scene, None, size, shading="deferred", framebuffers=["scene"])
            final = renderer.apply(lit["scene"], changed, framebuffers=["final"])["final"]
            final = np.rint(255 * np.clip(final.astype(np.float32), 0, 1)).astype(np.uint8)
        else:
            final = renderer.render(
                scene, changed, size, shading="deferred", framebuffers=["final"]
            )["final"]
        top, left = row * (size[1] + label), column * size[0]
        sheet[top : top + size[1], left : left + size[0]] = final[:, :, :3]
        labels.append((left + 8, top + size[1] + 25, name))
    sheet = pictures.labelled(sheet, labels, 24)
    image = oiio.ImageBuf(sheet)
    image.specmod().attribute("CompressionQuality", 88)
    if not image.write(str(path)):
        raise SystemExit(f"{path}: {image.geterror()}")


def draw_profiles(renderer: vkbloom.Renderer, path: Path) -> None:
    """Draw each preset's bloom of 3 x 3 pixels of 1000 over the distance from them."""
    width, height = SIZE
    image = np.zeros((height, width, 3), np.float32)
    y, x = height // 2, width // 2
    # KinoBloom removes a single pixel as a firefly.
    image[y - 1 : y + 2, x - 1 : x + 2] = 1000
    figure, axes = plt.subplots(figsize=(8, 4.6), layout="constrained")
    for index, (name, settings) in enumerate(vkbloom.presets.items()):
        exact = settings.replace(format="rgba32float", bloom=True)
        bloom = renderer.apply(image, exact, framebuffers=["bloom"])["bloom"]
        profile = bloom[y, x:, 0]
        seen = profile > 1e-6 * bloom.max()
        axes.loglog(
            np.arange(len(profile))[seen] + 0.5,
            profile[seen] / 9000,
            label=name,
            color=mpl.colormaps["tab20"](index % 20 / 20 + 0.01),
            linestyle="-" if index < 20 else "--",
            linewidth=1.4,
        )
    axes.set_xlabel("distance, pixels (+ 0.5)")
    axes.set_ylabel("share of the light of the point, per pixel")
    axes.set_ylim(1e-7, 1)
    axes.grid(alpha=0.3)
    figure.legend(fontsize=7, loc="outside right upper")
    figure.savefig(path, dpi=110)
    plt.close(figure)


def write_flowchart(page: Path) -> None:
    """Put the forward system's flowchart in the place of the one in a page."""
    os.environ["VKBLOOM_VARIANT"] = "fragment"
    with vkbloom.Renderer("software") as renderer:
        plan = renderer.plan(vkbloom.Scene.ufo(), vkbloom.Separable(), SIZE)
    del os.environ["VKBLOOM_VARIANT"]
    before, _, rest = page.read_text().partition("```mermaid\n")
    page.write_text(f"{before}```mermaid\n{plan.to_mermaid()}\n```{rest.partition('```')[2]}")


def main(folder: Path) -> None:
    """Write all pictures."""
    write_flowchart(folder.parent / "plans.md")
    with vkbloom.Renderer("software") as renderer:
        draw_flow(renderer, "forward", vkbloom.Separable(), FORWARD, folder / "flow_forward.png")
        draw_flow(
            renderer,
            "deferred",
            vkbloom.Pyramid(levels=3, tonemap="aces", encoding="srgb"),
            DEFERRED,
            folder / "flow_deferred.png",
        )
        draw_gallery(renderer, folder / "gallery.jpg")
        draw_profiles(renderer, folder / "profiles.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
