"""Print a digest of renders: one line of SHA-256 for each preset, size, dtype and variant.

``python -m tools.render_digest > before.txt``, a change, the same to ``after.txt``, and ``diff``:
renders of one adapter that differ in any bit differ in their line.
"""

from __future__ import annotations

import argparse
import dataclasses
import hashlib
import os
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

import vkbloom

SIZES = ((96, 64), (127, 61), (320, 180))
DTYPES = ("uint8", "float16", "float32")
VARIANTS = ("auto", "gpu", "fragment")
GLARE = vkbloom.Pyramid(glare=(vkbloom.Streaks(), vkbloom.Ghosts(), vkbloom.Halo()))
MORE: dict[str, vkbloom.Settings] = {
    "glare": GLARE,
    "no bloom": vkbloom.Separable(bloom=False),
    "rg11b10ufloat": vkbloom.Pyramid(format="rg11b10ufloat"),
    "half size": vkbloom.Pyramid(bloom_scale=0.5, threshold=1.0, knee=0.5),
    "thirds": vkbloom.Separable(bloom_scale=1 / 3, threshold=0.5, layers=((1.0, 1.0), (2.0, 0.5))),
    "direct": vkbloom.Separable(direct=True, loops=2),
}


def picture(size: tuple[int, int], channels: int, dtype: str) -> NDArray[Any]:
    """Return noise with a few bright spots, the same on each call."""
    width, height = size
    random = np.random.default_rng(width * height + channels)
    noise = random.random((height, width, channels), np.float32)
    if dtype == "uint8":
        return (noise**4 * 255).astype(np.uint8)
    return (noise**8 * 40).astype(dtype)


def digest(frames: vkbloom.Frames) -> str:
    """Return the SHA-256 of all framebuffers."""
    found = hashlib.sha256()
    for name, array in frames.items():
        found.update(f"{name} {array.shape} {array.dtype}".encode())
        found.update(np.ascontiguousarray(array).tobytes())
    return found.hexdigest()[:20]


def renders(renderer: vkbloom.Renderer) -> Iterator[tuple[str, vkbloom.Frames]]:
    """Yield a name and all framebuffers of each render."""
    for name, settings in {**vkbloom.presets, **MORE}.items():
        for size in SIZES:
            for dtype in DTYPES:
                channels = 3 if size[0] % 2 else 4
                image = picture(size, channels, dtype)
                label = f"{name} {size[0]}x{size[1]} {dtype}"
                yield label, renderer.apply(image, settings)
                final = renderer.apply(image[::-1], settings, attachments=("final",))
                yield f"{label} final", final
        image = picture((96, 64), 4, "float32")
        mask = picture((96, 64), 3, "float32")[..., 0].clip(0, 1)
        yield f"{name} mask", renderer.apply(image, settings, mask=mask)
        if name != "rg11b10ufloat":
            yield (
                f"{name} alpha",
                renderer.apply(image, dataclasses.replace(settings, alpha="blur")),
            )
    scene = vkbloom.Scene.ufo()
    for shading in ("forward", "deferred"):
        for name in ("tutorial", "outline", "deferred", "jimenez2014", "bevy_natural", "godot_4_5"):
            frames = renderer.render(scene, vkbloom.presets[name], (160, 90), shading=shading)
            yield f"{name} {shading}", frames


def main() -> None:
    """Print the digests."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--adapter", default="software")
    parser.add_argument("--variants", nargs="*", default=VARIANTS)
    arguments = parser.parse_args()
    for variants in arguments.variants:
        os.environ["VKBLOOM_VARIANT"] = variants
        with vkbloom.Renderer(arguments.adapter) as renderer:
            for name, frames in renders(renderer):
                print(variants, name, digest(frames), flush=True)


if __name__ == "__main__":
    main()
