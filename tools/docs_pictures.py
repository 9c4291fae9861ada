"""Draw the pictures of the presets, for the docs.

python tools/docs_pictures.py docs/pictures

- gallery.jpg: a street at night with each preset
- presets.png, profiles.png: how the light of a point spreads with each preset
- psf_presets.png: the functions of docs/evidence/psf_atlas.md
- hero.jpg: the saucer without bloom beside the saucer with bloom
- measured.jpg: a photograph, its glow, the bloom alone, and its contour lines
- the flowchart of docs/plans.md, from a plan
"""

from __future__ import annotations

import dataclasses
import os
import sys
import tempfile
from pathlib import Path

import matplotlib as mpl
import numpy as np
from picture_sheet import write_sheet
from skimage import data

import vkbloom
from vkbloom._io.srgb import encode_srgb
from vkbloom._views import pictures

mpl.use("agg")
from matplotlib import patheffects
from matplotlib import pyplot as plt

SIZE = (640, 360)
CELL = (480, 270)
HERO = (1280, 640)
# The intensity of the first picture of README, in which a glance finds the bloom.
MEASURED = 0.65
# The square around a point in pixels, and the range of its logarithmic scale.
SIDE, DECADES = 240, 5


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


def draw_measured(renderer: vkbloom.Renderer, path: Path) -> None:
    """Draw the first picture of README, which can be read on a telephone: scikit-image's rocket."""
    with tempfile.TemporaryDirectory() as folder:
        photograph = vkbloom.write(Path(folder) / "rocket.png", data.rocket())
        before = vkbloom.read(photograph, expand=4)
    frames = renderer.apply(before, vkbloom.presets["photo"].replace(intensity=MEASURED))
    part = np.s_[177:427, 60:560]
    bloom = frames["bloom"][part][..., :3] * MEASURED
    stops = np.log2(np.maximum(bloom @ (0.2126, 0.7152, 0.0722), 1e-6))
    figure, cells = plt.subplots(2, 2, figsize=(HERO[0] / 100, HERO[1] / 100), facecolor="black")
    figure.subplots_adjust(0, 0, 1, 1, 0.006, 0.012)
    shown = before[part], frames["final"][part], bloom, 0.1 * bloom
    outline = patheffects.withStroke(linewidth=5, foreground="black")
    texts = "a photograph", "with bloom", "the bloom alone", "measured, in stops"
    for axes, light, text in zip(cells.flat, shown, texts, strict=True):
        axes.set_axis_off()
        axes.imshow(encode_srgb(np.clip(light[..., :3], 0, 1)), aspect="auto")
        axes.text(9, 9, text, color="white", fontsize=34, va="top", path_effects=[outline])
    lines = cells[1, 1].contour(stops, levels=range(-9, 1), cmap="plasma", linewidths=2.5)
    cells[1, 1].clabel(lines, levels=range(-8, 1, 2), fontsize=20)
    figure.savefig(path, dpi=100, pil_kwargs={"quality": 88})
    plt.close(figure)


def night() -> np.ndarray:
    """Return a street at night, (H, W, 3): houses with windows, lamps, a moon, a sign, a car."""
    width, height = CELL
    random = np.random.default_rng(5)
    y, x = np.mgrid[:height, :width]
    picture = np.ones((height, width, 1)) * (0.004, 0.006, 0.014) * (1 + 2 * y / height)[..., None]
    left = 0
    while left < width:
        right, top = left + random.integers(40, 90), random.integers(60, 150)
        picture[top:230, left:right] = (0.012, 0.011, 0.010)
        for row in range(top + 8, 222, 16):
            for column in range(left + 6, min(right, width) - 8, 14):
                if random.random() < 0.35:
                    picture[row : row + 7, column : column + 6] = random.uniform(
                        0.3, 2.5
                    ) * np.array((1, 0.75, 0.4))
        left = right
    picture[230:] = 0.02
    picture[(x - 400) ** 2 + (y - 36) ** 2 < 13**2] = (6, 6, 5.4)
    for lamp in (50, 170, 290, 410):
        picture[190:236, lamp - 1 : lamp + 1] = 0.03
        picture[187:191, lamp - 4 : lamp + 4] = (60, 42, 20)
        pool = np.exp(-(((x - lamp) / 40) ** 2) - ((y - 246) / 10) ** 2)[..., None]
        picture += 0.25 * pool * (1, 0.7, 0.35)
    picture[128:132, 205:262] = (0.5, 8, 6)
    picture[150:154, 205:262] = (10, 0.4, 3)
    picture[240:243, 226:230] = picture[240:243, 240:244] = (90, 88, 80)
    return picture.astype(np.float32)


def draw_gallery(renderer: vkbloom.Renderer, path: Path) -> None:
    """Draw the street with each preset, and without bloom."""
    tiles = []
    for name, settings in {"no bloom": vkbloom.Separable(bloom=False), **vkbloom.presets}.items():
        changed = settings.replace(tonemap="aces", encoding="srgb")
        final = renderer.apply(night(), changed, framebuffers="final")["final"]
        tiles.append((pictures.picture(final, "final", encoding="srgb"), name))
    write_sheet(path, tiles, 4)


def draw_points(renderer: vkbloom.Renderer, folder: Path) -> None:
    """Draw each preset's bloom of 3 x 3 pixels of 1000, and its brightness by the distance."""
    width, height = SIZE
    image = np.zeros((height, width, 3), np.float32)
    y, x = height // 2, width // 2
    # KinoBloom removes a single pixel as a firefly.
    image[y - 1 : y + 2, x - 1 : x + 2] = 1000
    # Six lines in each are as many as the eye tells apart.
    rows = -(-len(vkbloom.presets) // 18)
    figure, grid = plt.subplots(
        rows,
        3,
        figsize=(11, 3.75 * rows),
        sharex=True,
        sharey=True,
        squeeze=False,
        layout="constrained",
    )
    random, tiles = np.random.default_rng(1), []
    for index, (name, settings) in enumerate(vkbloom.presets.items()):
        exact = settings.replace(format="rgba32float", bloom=True)
        bloom = renderer.apply(image, exact, framebuffers="bloom")["bloom"][..., 0]
        profile = bloom[y, x:]
        seen = profile > 1e-6 * bloom.max()
        axes = grid.flat[index // 6]
        axes.loglog(np.flatnonzero(seen) + 0.5, profile[seen] / 9000, label=name)
        middle = bloom[y - SIDE // 2 : y + SIDE // 2, x - SIDE // 2 : x + SIDE // 2]
        decades = np.log10(np.maximum(middle / bloom.max(), 10.0**-DECADES))
        # Dithered, since levels of 8 bits would be rings that no bloom has.
        grey = 254 * np.maximum(1 + decades / DECADES, 0) + random.random(decades.shape)
        tiles.append((np.repeat(grey[..., np.newaxis], 3, axis=2).astype(np.uint8), name))
    for axes in grid.flat:
        axes.set_ylim(1e-7, 1)
        axes.grid(alpha=0.3)
        axes.set_visible(bool(axes.lines))
        axes.tick_params(labelbottom=True)
        if axes.lines:
            axes.legend(fontsize=8)
    figure.supxlabel("distance, pixels (+ 0.5)")
    figure.supylabel("share of the light of the point, per pixel")
    figure.savefig(folder / "profiles.png", dpi=110)
    plt.close(figure)
    write_sheet(folder / "presets.png", tiles, 5)


def draw_functions(renderer: vkbloom.Renderer, path: Path) -> None:
    """Draw profile, encircled energy and transfer function of each preset without a threshold."""
    image = np.zeros((512, 512, 3), np.float32)
    blooms = {}
    for name, settings in vkbloom.presets.items():
        exact = settings.replace(format="rgba32float", threshold=None)
        # Bevy's prefilter makes 0.0001 of black.
        black = renderer.apply(image, exact, framebuffers="bloom")["bloom"]
        image[256, 256] = 1
        lit = renderer.apply(image, exact, framebuffers="bloom")["bloom"]
        image[256, 256] = 0
        blooms[name] = (lit - black)[..., 1].astype(np.float64)
    # KinoBloom removes a single pixel as a firefly.
    blooms = {name: bloom for name, bloom in blooms.items() if bloom.sum() > 0}
    figure, grid = plt.subplots(
        -(-len(blooms) // 6),
        3,
        figsize=(12, 2.5 * -(-len(blooms) // 6)),
        sharex="col",
        sharey="col",
        squeeze=False,
        layout="constrained",
    )
    distance = np.hypot(*(np.indices((512, 512)) - 256)).round().astype(int).ravel()
    for index, (name, bloom) in enumerate(blooms.items()):
        profile, within, transfer = grid[index // 6]
        light = np.bincount(distance, bloom.ravel())[:256]
        mean = light / np.bincount(distance)[:256]
        profile.loglog(np.arange(256) + 0.5, np.where(mean > 0, mean, np.nan), label=name)
        within.semilogx(np.arange(256) + 0.5, light.cumsum() / bloom.sum(), label=name)
        line = np.abs(np.fft.rfft(bloom.sum(axis=0))) / bloom.sum()
        transfer.plot(np.fft.rfftfreq(512), line, label=name)
    for row in grid:
        row[0].set_ylim(1e-8, 10)
        row[2].set_ylim(0, 1.05)
        row[2].legend(fontsize=8, loc="upper left", bbox_to_anchor=(1, 1))
        for axes in row:
            axes.grid(alpha=0.3)
    names = ("share of the pixel, mean", "encircled energy, share", "modulation transfer")
    for axes, text in zip(grid[0], names, strict=True):
        axes.set_title(text)
    units = ("distance, pixels (+ 0.5)", "distance, pixels (+ 0.5)", "cycles per pixel, along x")
    for axes, text in zip(grid[-1], units, strict=True):
        axes.set_xlabel(text)
    figure.savefig(path, dpi=80)
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
        draw_hero(renderer, folder / "hero.jpg")
        draw_measured(renderer, folder / "measured.jpg")
        draw_gallery(renderer, folder / "gallery.jpg")
        draw_points(renderer, folder)
        draw_functions(renderer, folder / "psf_presets.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
