"""Remove the glare of a known lens from a noisy picture.

python examples/gradients/glare_removal.py glare_removal.png
"""

from __future__ import annotations

import sys

import numpy as np
from numpy.typing import NDArray

import vkbloom

PSF = vkbloom.psf.gaussian(sigma=4)
SHARE = 0.4


def night(height: int = 72, width: int = 128) -> NDArray[np.float32]:
    """Return a dark scene with lamps and a dim gradient."""
    random = np.random.default_rng(4)
    image = np.full((height, width, 3), 0.02, np.float32)
    image[height // 2 :] += np.linspace(0, 0.15, width, dtype=np.float32)[None, :, None]
    for _ in range(14):
        y, x = random.integers(2, height - 3), random.integers(2, width - 3)
        image[y : y + 2, x : x + 2] = random.uniform(4, 20) * random.uniform(0.4, 1, 3)
    return image


def main(path: str) -> None:
    """Write the picture, the cleaned image and the truth side by side."""
    truth = night()
    picture = vkbloom.apply(truth, vkbloom.Convolution(PSF, composite="mix", intensity=SHARE))[
        "final"
    ]
    # Of the sensor.
    noise = np.random.default_rng(5).normal(scale=0.005, size=picture.shape)
    picture = (picture + noise).astype(np.float32)
    found = vkbloom.deglare(picture, PSF, share=SHARE)
    before, after = (float(np.abs(one - truth).mean()) for one in (picture, found))
    print(f"mean error: {before:.4f} with glare, {after:.4f} without")
    rows = np.concatenate([picture, found, truth], axis=1)
    vkbloom.write(path, np.clip(rows, 0, 1).repeat(3, axis=0).repeat(3, axis=1))


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "glare_removal.png")
