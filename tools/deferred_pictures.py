"""Make the pictures of docs/deferred.md: the G-buffer, tone mapping, textures and dither."""

from __future__ import annotations

import argparse
import dataclasses
import tempfile
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import textured_model
from numpy.typing import NDArray

import vkbloom
from vkbloom.io.srgb import encode_srgb

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
    """Return a glow of 1 and of 8 times its colour, clipped at 1 and mapped by the ACES curve."""
    curve = SETTINGS.replace(tonemap="aces", exposure=-1.0, encoding="gamma22")
    return [
        render(renderer, intensity, settings)["final"][..., :3] / 255
        for settings in (SETTINGS, curve)
        for intensity in (1.0, 8.0)
    ]


def house() -> vkbloom.Scene:
    """Return the textured model, seen from above."""
    with tempfile.TemporaryDirectory() as folder:
        camera = vkbloom.Camera(position=(0.0, 0.7, -9.0), rotation=(-14.0, 35.0, 0.0))
        return vkbloom.Scene.from_gltf(textured_model.write(Path(folder)), camera=camera)


def textures(renderer: vkbloom.Renderer) -> list[NDArray[np.float64]]:
    """Return a textured model's albedo, brightness, scene and final, all sRGB."""
    settings = SETTINGS.replace(intensity=0.5, tonemap="aces", encoding="srgb", dither=True)
    frames = renderer.render(house(), settings, SIZE, shading="deferred")
    linear = (
        frames[name][..., :3].astype(np.float64) for name in ("albedo", "brightness", "scene")
    )
    shown = [encode_srgb(np.clip(image, 0, 1)) for image in linear]
    return [*shown, frames["final"][..., :3] / 255]


def dithering(renderer: vkbloom.Renderer) -> list[NDArray[np.float64]]:
    """Return a picture 5 stops too dark, without and with dither, then brightened 24 times."""
    settings = SETTINGS.replace(intensity=0.5, exposure=-5.0)
    finals = (
        renderer.render(house(), settings.replace(dither=dither), SIZE, shading="deferred")["final"]
        for dither in (False, True)
    )
    return [final[20:260, 160:480, :3] / (255 / 24) for final in finals]


def save(panels: list[NDArray[np.float64]], target: Path) -> None:
    """Write panels, two in each row, as a JPEG file."""
    rows = [np.concatenate(panels[row : row + 2], 1) for row in range(0, len(panels), 2)]
    sheet = np.concatenate(rows, 0)
    picture = np.round(np.clip(sheet, 0, 1) * 255).astype(np.uint8)
    buffer = oiio.ImageBuf(np.ascontiguousarray(picture))
    buffer.specmod().attribute("Compression", "jpeg:85")
    if not buffer.write(str(target)):
        raise OSError(f"{target}: {buffer.geterror()}")
    print(target)


def main() -> None:
    """Write deferred_*.jpg and dither.jpg."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=Path("docs/pictures"))
    folder = parser.parse_args().folder
    with vkbloom.Renderer("software") as renderer:
        save(gbuffer(renderer), folder / "deferred_gbuffer.jpg")
        save(tone_mapping(renderer), folder / "deferred_tone_mapping.jpg")
        save(textures(renderer), folder / "deferred_textures.jpg")
        save(dithering(renderer), folder / "dither.jpg")


if __name__ == "__main__":
    main()
