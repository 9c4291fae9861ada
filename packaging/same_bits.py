"""Print a digest of every framebuffer of a set of small renders, to compare drivers and CPUs.

The inputs are made of integers, so that they are the same bits on every CPU; NumPy's own functions
need not be. Two runs that print the same lines drew the same bits.
"""

from __future__ import annotations

import argparse
import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import vkbloom

SIZE = (97, 61)
TYPES = (np.uint8, np.float16, np.float32)
# Of the settings that are tried in each type: what encodes, maps, thresholds and dithers.
VARIED = {
    "Separable": vkbloom.Separable(threshold=0.5, knee=0.25, tonemap="aces", encoding="srgb"),
    "Pyramid": vkbloom.Pyramid(firefly_filter=True, tonemap="exponential", encoding="gamma22"),
    "DualKawase": vkbloom.DualKawase(composite="screen", tonemap="agx", exposure=0.5, dither=True),
    "neutral": vkbloom.Pyramid(tonemap="khronos_neutral", encoding="srgb", composite="mix"),
}


def image(dtype: type) -> NDArray[np.generic]:
    """Make noise with a few bright pixels: integers over powers of two."""
    width, height = SIZE
    index = np.arange(width * height * 4, dtype=np.uint64)
    noise = ((index * 2654435761) >> 13) % 256
    bright = 1 + 15 * (((index // 4 * 40503) >> 7) % 29 == 0).astype(np.uint64)
    levels = noise.reshape(height, width, 4)
    if dtype is np.uint8:
        return levels.astype(np.uint8)
    pixels = (levels * bright.reshape(height, width, 4)).astype(np.float32) / 256
    pixels[..., 3] = 1
    return pixels.astype(dtype)


def renders(
    renderer: vkbloom.Renderer, only: Sequence[str] | None
) -> Iterator[tuple[str, vkbloom.Frames]]:
    """Render everything, or only what is named, with a name each."""

    def chosen(mapping: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
        return ((name, mapping[name]) for name in mapping if only is None or name in only)

    pixels = image(np.float16)
    for name, settings in chosen(vkbloom.presets):
        yield f"{name} float16", renderer.apply(pixels, settings)
    for name, settings in chosen(VARIED):
        for dtype in TYPES:
            yield f"{name} {np.dtype(dtype).name}", renderer.apply(image(dtype), settings)
    if only is not None and "scene" not in only:
        return
    scene = vkbloom.Scene.ufo()
    aces = vkbloom.Separable(tonemap="aces", encoding="srgb")
    yield "scene forward", renderer.render(scene, aces, SIZE)
    deferred = vkbloom.presets["deferred"]
    yield "scene deferred", renderer.render(scene, deferred, SIZE, shading="deferred")


def main() -> None:
    """Print JSON: the adapter, and for each render the digests of its framebuffers."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--adapter", default="software")
    parser.add_argument("--only", nargs="+", help="presets and settings, by name; by default all")
    parser.add_argument("--arrays", type=Path, help="an NPZ file to write all framebuffers to")
    options = parser.parse_args()
    digests: dict[str, dict[str, str]] = {}
    arrays = {}
    with vkbloom.Renderer(options.adapter) as renderer:
        for name, frames in renders(renderer, options.only):
            digests[name] = {}
            for key, array in frames.items():
                if key == "kernel":  # NumPy computes it, not the driver
                    continue
                digest = hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()[:16]
                digests[name][key] = digest
                arrays[f"{name} {key}"] = array
        if options.arrays:
            np.savez(options.arrays, **arrays)
        print(json.dumps({"adapter": renderer.info.summary, "renders": digests}, indent=1))


if __name__ == "__main__":
    main()
