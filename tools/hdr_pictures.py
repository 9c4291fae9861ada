"""Make the pictures of docs/hdr.md: HDR images without bloom and with several methods.

The images are not part of the project. Pass the files as arguments, for example from the OpenEXR
image collection: ``python tools/hdr_pictures.py Desk.exr BrightRings.exr``.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

import vkbloom

PICTURES = Path(__file__).parents[1] / "docs" / "pictures"
CURVE = {"tonemap": "aces", "encoding": "srgb", "exposure": -1.0}

#: What each quarter of a picture shows, row by row.
PANELS = (
    vkbloom.Separable(bloom=False, **CURVE),
    vkbloom.Pyramid(composite="mix", intensity=0.1, **CURVE),
    vkbloom.Pyramid(threshold=2.0, knee=0.5, firefly_filter=True, intensity=0.15, **CURVE),
    vkbloom.DualKawase(threshold=2.0, offset=1.5, intensity=0.15, **CURVE),
)


def panels(renderer: vkbloom.Renderer, image: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return the four panels in one picture, each shown at half its size."""
    shown = []
    for settings in PANELS:
        final = renderer.apply(image, settings, attachments=("final",))["final"]
        height, width = (side // 2 * 2 for side in final.shape[:2])
        blocks = final[:height, :width].reshape(height // 2, 2, width // 2, 2, 3)
        shown.append(np.round(np.clip(blocks.mean(axis=(1, 3)), 0, 1) * 255).astype(np.uint8))
    return np.concatenate([np.concatenate(shown[:2], 1), np.concatenate(shown[2:], 1)], 0)


def main(paths: list[Path]) -> None:
    """Write docs/pictures/hdr_NAME.jpg for each file."""
    with vkbloom.Renderer("software") as renderer:
        for path in paths:
            pixels = oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT)
            picture = panels(renderer, np.ascontiguousarray(pixels[..., :3]))
            target = PICTURES / f"hdr_{path.stem.lower()}.jpg"
            buffer = oiio.ImageBuf(np.ascontiguousarray(picture))
            buffer.specmod().attribute("Compression", "jpeg:85")
            if not buffer.write(str(target)):
                raise OSError(f"{target}: {buffer.geterror()}")
            print(target)


if __name__ == "__main__":
    main([Path(name) for name in sys.argv[1:]])
