"""Draw exposures and anti-aliasing in time, for the page on them; called by conf.py."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

import vkbloom
from vkbloom._io.srgb import encode_srgb

#: Frames in a second.
RATE = 10 if "VKBLOOM_DOCS_SMALL" in os.environ else 24
#: Stops of the light by the second at which it changes: a lamp is lit, and goes out.
LIGHT = {0.0: 0.0, 2.0: 5.0, 5.0: 0.0}
SECONDS = 8.0
#: Post Processing v2 changes nothing with its defaults.
ENGINES: Mapping[str, Any] = {
    "bevy": "bevy",
    "hdrp": "hdrp",
    "ppv2": vkbloom.PostProcessingExposure(minimum=-9, maximum=9),
    "godot": "godot",
    "o3de": "o3de",
    "granite": "granite",
}
METERED, SHOWN = (64, 36), (256, 144)
Image = NDArray[np.float32]
#: Of the bloom of a strip.
THRESHOLD = 1.0
#: When the frames of a strip are, in seconds.
MOMENTS = (1.9, 2.1, 2.7, 4.9, 5.3, 7.9)
#: The light of small lamps and of what is around them, their radius in pixels, and how far they are
#: from each other.
LAMP, AROUND, RADIUS, APART = 60.0, 0.05, 0.75, 37


def stops_at(seconds: float) -> float:
    """Return the stops of the light."""
    return next(stops for begin, stops in reversed(LIGHT.items()) if seconds >= begin)


def picture(size: tuple[int, int]) -> Image:
    """Return the light of the built-in scene, with lamps six times as bright as white."""
    scene = dataclasses.replace(vkbloom.Scene.ufo(), glow_intensity=6.0)
    frames = vkbloom.render(
        scene, "tutorial", size, shading="deferred", time=0.1, framebuffers=["scene"], bloom=False
    )
    return np.ascontiguousarray(frames["scene"][..., :3], np.float32)


def clip(size: tuple[int, int]) -> list[Image]:
    """Return the picture while its light changes."""
    light = picture(size)
    count = round(SECONDS * RATE)
    return [light * np.float32(2.0 ** stops_at(number / RATE)) for number in range(count)]


def follow(exposure: Any, images: Sequence[Image]) -> list[float]:
    """Return the stops of each frame."""
    frames = vkbloom.sequence(
        images, "bevy_natural", fps=RATE, exposure=exposure, framebuffers="exposure"
    )
    return [made.exposure for made in frames]


def draw_lines(
    place: Path, times: Sequence[float], lines: Mapping[str, Sequence[float]], label: str
) -> None:
    """Write a plot of numbers by time, in colours that can be told apart on light and dark."""
    with mpl.rc_context({"font.size": 9, "axes.grid": True, "grid.alpha": 0.3}):
        figure = Figure(figsize=(7.6, 3.4), dpi=130, layout="constrained")
        axes = figure.subplots()
        styles = ("-", "--", "-.", ":")
        for place_of, (name, values) in enumerate(lines.items()):
            style = "k-" if name == "light" else styles[place_of % len(styles)]
            axes.plot(times, values, style, label=name, linewidth=1 if name == "light" else 1.8)
        axes.set(xlabel="seconds", ylabel=label, xlim=(times[0], times[-1]))
        axes.legend(loc="center left", bbox_to_anchor=(1, 0.5), frameon=False)
        figure.savefig(place)


def shown(image: NDArray[Any]) -> NDArray[np.uint8]:
    """Return linear light as bytes in sRGB."""
    clipped = np.clip(np.nan_to_num(image[..., :3].astype(np.float64)), 0, 1)
    return np.rint(255 * encode_srgb(clipped)).astype(np.uint8)


def strip(rows: Sequence[Sequence[NDArray[np.uint8]]], gap: int = 4) -> NDArray[np.uint8]:
    """Return pictures of one size in rows."""
    height = rows[0][0].shape[0]
    wide = np.full((height, gap, 3), 255, np.uint8)
    made = []
    for row in rows:
        cells = [part for cell in row for part in (cell, wide)][:-1]
        made += [np.concatenate(cells, axis=1)]
        made += [np.full((gap, made[0].shape[1], 3), 255, np.uint8)]
    return np.concatenate(made[:-1])


def frames_at(images: Sequence[Image], name: str, **how: Any) -> list[NDArray[np.uint8]]:
    """Return a framebuffer of the frames at `MOMENTS`."""
    wanted = {round(moment * RATE) for moment in MOMENTS}
    settings = vkbloom.Pyramid(threshold=THRESHOLD, knee=0.5, intensity=0.6, tonemap="aces")
    frames = vkbloom.sequence(images, settings, fps=RATE, framebuffers=["final", name], **how)
    return [shown(made[name]) for number, made in enumerate(frames) if number in wanted]


def lamps(taa: vkbloom.Antialiasing, size: tuple[int, int], count: int) -> Iterator[Image]:
    """Yield still lamps of a pixel or two, as a camera with the engine's offsets draws them.

    A pixel has the light of one point in it.
    """
    width, height = size
    places = [
        (x + 0.13 * row, y + 0.29 * column)
        for row, y in enumerate(np.arange(APART / 2, height, APART))
        for column, x in enumerate(np.arange(APART / 2, width, APART))
    ]
    for number in range(count):
        right, down = taa.offset(number)
        image = np.full((height, width, 3), AROUND, np.float32)
        y, x = np.mgrid[:height, :width]
        for lamp_x, lamp_y in places:
            away = np.hypot(x + 0.5 - right - lamp_x, y + 0.5 - down - lamp_y)
            image[away < RADIUS] = LAMP
        yield image


def resolve(order: Any, size: tuple[int, int], count: int) -> vkbloom.Sequence:
    """Return the frames of the lamps: without anti-aliasing, or with it before or after bloom."""
    taa = vkbloom.BevyAntialiasing(order=order or "before")
    settings = vkbloom.Pyramid(threshold=1.0, levels=4, intensity=1.0)
    images = list(lamps(taa, size, count))
    return vkbloom.sequence(images, settings, fps=RATE, taa=taa if order else None)


def write(folder: Path) -> None:
    """Write the pictures, and the texts that show them."""
    folder.mkdir(parents=True, exist_ok=True)
    write_following(folder)
    write_strip(folder)
    write_threshold(folder)
    write_orders(folder)


def include(folder: Path, name: str, words: str, suffix: str = "png") -> None:
    """Write the text that shows a picture, with what it is below."""
    place = "/".join((*folder.parts[-2:], f"{name}.{suffix}"))
    text = f"![{words}]({place})\n"
    if words.endswith("."):
        text += f"\n{words}\n"
    folder.parent.joinpath(f"{folder.name}_{name}.md").write_text(text, encoding="utf-8")


def write_following(folder: Path) -> None:
    """Write how exposures follow light, and how those without a meter go."""
    images = clip(METERED)
    times = [number / RATE for number in range(len(images))]
    light = [stops_at(time) for time in times]
    lines = {"light": light} | {name: follow(one, images) for name, one in ENGINES.items()}
    draw_lines(folder / "following.png", times, lines, "stops")
    include(folder, "following", "The light in stops, and the exposure of six engines by time")
    fixed: dict[str, Any] = {
        "fixed, 1 stop": vkbloom.FixedExposure(value=1),
        "fixed, EV100 of 2": vkbloom.FixedExposure(value=2, unit="ev100"),
        "keyframed": vkbloom.KeyframedExposure(keys=((1, 0), (2, -3), (5, -3), (7, 2))),
    }
    made = {name: follow(one, images) for name, one in fixed.items()}
    draw_lines(folder / "fixed.png", times, made, "stops")
    include(folder, "fixed", "Two fixed exposures and one with keys, in stops by time")


def write_strip(folder: Path) -> None:
    """Write frames of the clip without an exposure, and with two."""
    images = clip(SHOWN)
    ways: tuple[dict[str, Any], ...] = ({}, {"exposure": "hdrp"}, {"exposure": "o3de"})
    rows = [frames_at(images, "final", **how) for how in ways]
    vkbloom.write(folder / "strip.jpg", strip(rows), quality=88)
    (_, before), (begin, bright), (end, _) = LIGHT.items()
    moments = ", ".join(f"{moment:g}" for moment in MOMENTS)
    words = (
        f"Frames of a clip at {moments} s. Its light rises by {bright - before:g} stops at "
        f"{begin:g} s, and falls back at {end:g} s. Above without an exposure, then with that of "
        "HDRP, and with that of O3DE."
    )
    include(folder, "strip", words, "jpg")


def write_threshold(folder: Path) -> None:
    """Write what passes one threshold where the bloom reads light, and where it is exposed."""
    images = clip(SHOWN)
    rows = [frames_at(images, "glow", exposure=ENGINES[name]) for name in ("o3de", "hdrp")]
    vkbloom.write(folder / "threshold.jpg", strip(rows), quality=88)
    words = (
        f"What passes a threshold of {THRESHOLD:g} at the same moments. Above of light (O3DE), "
        "below of exposed light (HDRP)."
    )
    include(folder, "threshold", words, "jpg")


def write_orders(folder: Path) -> None:
    """Write the bloom of small lamps for each order, and the light around one by time."""
    size, count = (256, 144), 2 * RATE
    orders = {"no TAA": None, "TAA before bloom": "before", "TAA after bloom": "after"}
    light: dict[str, list[float]] = {}
    cells = []
    for name, order in orders.items():
        frames = [made["final"] for made in resolve(order, size, count)]
        cells.append(shown(frames[-1]))
        # Around the lamp at the upper left.
        light[name] = [float(frame[:APART, :APART].mean()) for frame in frames]
    vkbloom.write(folder / "orders.png", strip([cells]))
    last = {name: np.array(values[RATE:]) for name, values in light.items()}
    off = ", ".join(f"{100 * one.std() / one.mean():.2g} %" for one in last.values())
    means = ", ".join(f"{one.mean():.2g}" for one in last.values())
    words = (
        "Still lamps as large as a pixel or two, drawn with the offsets of Bevy's camera. From the "
        f"left: {', '.join(orders)}. The mean light around a lamp is {means}. Over a second it "
        f"differs from that by {off} (standard deviation)."
    )
    include(folder, "orders", words)
    times = [number / RATE for number in range(count)]
    draw_lines(folder / "shimmer.png", times, light, "light around a lamp")
    include(folder, "shimmer", "The light around one lamp by time, for each order")
