"""Recover the kernel of a lens from a pair: an image, and its picture through the lens.

`vkbloom.recover_psf` finds the values, which are not negative, and how sure each of them is.

python examples/gradients/recovered_psf.py recovered_psf.png
"""

from __future__ import annotations

import sys

import numpy as np
from numpy.typing import NDArray

import vkbloom

SIDE = 15


def lens() -> NDArray[np.float64]:
    """Return a star with a soft centre, whose sum is 1."""
    y, x = np.indices((SIDE, SIDE)) - SIDE // 2
    soft = np.exp(-(x**2 + y**2) / 4.0)
    rays = 0.3 * (np.abs(x) == np.abs(y)) * np.exp(-np.hypot(x, y) / 5)
    kernel: NDArray[np.float64] = soft + rays
    return kernel / kernel.sum()


def main(path: str) -> None:
    """Write the kernel that was found and the true one side by side."""
    truth = lens()
    image = (np.random.default_rng(2).random((48, 64, 3), np.float32) ** 10 * 10).astype(np.float32)
    with vkbloom.Renderer() as renderer:
        settings = vkbloom.Convolution(truth.astype(np.float32), normalize=False)
        picture = renderer.apply(image, settings, framebuffers="bloom")["bloom"][..., :3]
    result = vkbloom.recover_psf(image, picture, size=(SIDE, SIDE))
    found = result.kernels[0, 0].mean(axis=2)
    print(f"largest error: {np.abs(found - truth).max() / truth.max():.4f} of the kernel's maximum")
    print(f"largest standard deviation: {result.error.max() / truth.max():.4f}")
    both = np.concatenate([found, truth], axis=1)[..., None].repeat(3, axis=2)
    shown = (both / truth.max()).astype(np.float32)
    vkbloom.write(path, np.clip(shown, 0, 1).repeat(16, axis=0).repeat(16, axis=1))


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "recovered_psf.png")
