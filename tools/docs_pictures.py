"""Draw the pictures of the presets, for docs/gallery.md and docs/presets.md.

python tools/docs_pictures.py docs/pictures

- gallery.jpg: the saucer with each preset
- presets.png, profiles.png: how the light of a point spreads with each preset
- hero.jpg: the saucer without bloom beside the saucer with bloom
- the flowchart of docs/plans.md, from a plan
"""

from __future__ import annotations

import dataclasses
import os
import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np

import vkbloom
from vkbloom._views import pictures

mpl.use("agg")
from matplotlib import pyplot as plt

SIZE = (640, 360)
CELL = (480, 270)
HERO = (1280, 640)
# The square around a point in pixels, and the range of its logarithmic scale.
SIDE, DECADES = 300, 5


def draw_hero(renderer: vkbloom.Renderer, path: Path) -> None:
    """Draw the wipe of the first page; its words can be read on a telephone."""
    scene = dataclasses.replace(vkbloom.Scene.ufo(), glow_intensity=6.0)
    lit = vkbloom.presets["bevy_natural"].replace(intensity=0.5, tonemap="aces", encoding="srgb")
    off, on = (
        renderer.render(scene, one, HERO, shading="deferred", framebuffers="final")["final"]
        for one in (lit.replace(intensity=0), lit)
    )
    width, half = HERO[0], HERO[0] // 2
    figure = plt.figure(figsize=(width / 100, HERO[1] / 100))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    axes.imshow(np.concatenate([off[:, :half, :3], on[:, half:, :3]], axis=1))
    axes.axvline(half - 0.5, color="white", linewidth=3)
    axes.text(24, 60, "no bloom", color="white", fontsize=34)
    axes.text(width - 24, 60, "bloom", color="white", fontsize=34, ha="right")
    figure.savefig(path, dpi=100, pil_kwargs={"quality": 88})
    plt.close(figure)


def write_sheet(path: Path, tiles: list[tuple[np.ndarray, str]], columns: int) -> None:
    """Write pictures in rows, with their names below."""
    height, width = tiles[0][0].shape[:2]
    rows = -(-len(tiles) // columns)
    size = (columns * width / 100, rows * (height / 100 + 0.3))
    figure, axes = plt.subplots(rows, columns, figsize=size, layout="constrained")
    for axis in axes.flat:
        axis.set_axis_off()
    for axis, (tile, name) in zip(axes.flat, tiles, strict=False):
        axis.imshow(tile)
        axis.set_title(name, y=0, verticalalignment="top", fontsize=12)
    figure.savefig(path, dpi=100)
    plt.close(figure)


def draw_gallery(renderer: vkbloom.Renderer, path: Path) -> None:
    """Draw the deferred saucer with each preset, and without bloom."""
    scene = dataclasses.replace(vkbloom.Scene.ufo(), glow_intensity=6.0)
    tiles = []
    for name, settings in {"no bloom": vkbloom.Separable(bloom=False), **vkbloom.presets}.items():
        changed = settings.replace(tonemap="aces", encoding="srgb", exposure=-0.5)
        # Such a bloom stands for the whole picture, not for its lights alone. Without bloom a scene
        # has no lamps, but its picture before the bloom has.
        if not settings.bloom or (settings.composite == "mix" and settings.intensity == 1):
            lit = renderer.render(scene, None, CELL, shading="deferred", framebuffers="scene")
            final = renderer.apply(lit["scene"], changed, framebuffers="final")["final"]
        else:
            final = renderer.render(scene, changed, CELL, shading="deferred")["final"]
        tiles.append((pictures.picture(final, "final", encoded=True), name))
    write_sheet(path, tiles, 3)


def draw_points(renderer: vkbloom.Renderer, folder: Path) -> None:
    """Draw each preset's bloom of 3 x 3 pixels of 1000, and its brightness by the distance."""
    width, height = SIZE
    image = np.zeros((height, width, 3), np.float32)
    y, x = height // 2, width // 2
    # KinoBloom removes a single pixel as a firefly.
    image[y - 1 : y + 2, x - 1 : x + 2] = 1000
    figure, axes = plt.subplots(figsize=(8, 4.6), layout="constrained")
    tiles = []
    for index, (name, settings) in enumerate(vkbloom.presets.items()):
        exact = settings.replace(format="rgba32float", bloom=True)
        bloom = renderer.apply(image, exact, framebuffers="bloom")["bloom"][..., 0]
        profile = bloom[y, x:]
        seen = profile > 1e-6 * bloom.max()
        axes.loglog(
            np.arange(len(profile))[seen] + 0.5,
            profile[seen] / 9000,
            label=name,
            color=mpl.colormaps["tab20"](index % 20 / 20 + 0.01),
            linestyle="-" if index < 20 else "--",
            linewidth=1.4,
        )
        middle = bloom[y - SIDE // 2 : y + SIDE // 2, x - SIDE // 2 : x + SIDE // 2]
        decades = np.log10(np.maximum(middle / bloom.max(), 10.0**-DECADES))
        # 32 levels of grey show the shape and keep the file small.
        grey = np.rint(31 * (1 + decades / DECADES)) * (255 / 31)
        tiles.append((np.repeat(grey[..., np.newaxis], 3, axis=2).astype(np.uint8), name))
    axes.set_xlabel("distance, pixels (+ 0.5)")
    axes.set_ylabel("share of the light of the point, per pixel")
    axes.set_ylim(1e-7, 1)
    axes.grid(alpha=0.3)
    figure.legend(fontsize=7, loc="outside right upper")
    figure.savefig(folder / "profiles.png", dpi=110)
    plt.close(figure)
    write_sheet(folder / "presets.png", tiles, 4)


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
        draw_hero(renderer, folder / "hero.jpg")
        draw_gallery(renderer, folder / "gallery.jpg")
        draw_points(renderer, folder)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
