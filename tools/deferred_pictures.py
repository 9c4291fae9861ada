"""Make the pictures of docs/deferred.md: the G-buffer, and a glow before and after tone mapping."""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

import vkbloom

SIZE = (640, 360)
SETTINGS = vkbloom.presets["deferred"].replace(bloom_scale=0.25, intensity=2.0)


def render(
    renderer: vkbloom.Renderer, intensity: float, settings: vkbloom.Settings
) -> vkbloom.Frames:
    """Return the built-in scene with a glow of that many times its colour."""
    scene = dataclasses.replace(vkbloom.Scene.ufo(), glow_intensity=intensity)
    return renderer.render(scene, settings, SIZE, shading="deferred")


def gbuffer(renderer: vkbloom.Renderer) -> list[NDArray[np.float64]]:
    """Return albedo, normal, position and brightness as colours: -1..1 and -4..4 become 0..1."""
    frames = render(renderer, 1.0, SETTINGS)
    albedo, normal, position, brightness = (
        frames[name][..., :3].astype(np.float64)
        for name in ("albedo", "normal", "position", "brightness")
    )
    body = (frames["depth"] < 1)[..., np.newaxis]
    centred = position - np.where(body, position, 0).sum((0, 1)) / body.sum()
    return [
        albedo,
        np.where(body, normal / 2 + 0.5, 0),
        np.where(body, centred / 8 + 0.5, 0),
        brightness,
    ]


def tone_mapping(renderer: vkbloom.Renderer) -> list[NDArray[np.float64]]:
    """Return a glow of 1 and of 8 times its colour, cut off at 1 and through the ACES curve."""
    curve = SETTINGS.replace(tonemap="aces", exposure=-1.0, encoding="gamma22")
    return [
        render(renderer, intensity, settings)["final"][..., :3] / 255
        for settings in (SETTINGS, curve)
        for intensity in (1.0, 8.0)
    ]


def save(panels: list[NDArray[np.float64]], target: Path) -> None:
    """Write four panels in two rows as a JPEG file."""
    whole = np.concatenate([np.concatenate(panels[:2], 1), np.concatenate(panels[2:], 1)], 0)
    picture = np.round(np.clip(whole, 0, 1) * 255).astype(np.uint8)
    buffer = oiio.ImageBuf(np.ascontiguousarray(picture))
    buffer.specmod().attribute("Compression", "jpeg:85")
    if not buffer.write(str(target)):
        raise OSError(f"{target}: {buffer.geterror()}")
    print(target)


def main() -> None:
    """Write deferred_gbuffer.jpg and deferred_tone_mapping.jpg."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=Path("docs/pictures"))
    folder = parser.parse_args().folder
    with vkbloom.Renderer("software") as renderer:
        save(gbuffer(renderer), folder / "deferred_gbuffer.jpg")
        save(tone_mapping(renderer), folder / "deferred_tone_mapping.jpg")


if __name__ == "__main__":
    main()
