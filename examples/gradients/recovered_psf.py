"""Recover the kernel of a lens from a pair: an image, and its picture through the lens.

The bloom is linear in the kernel, so a pullback gives the derivative by each of its values, and
L-BFGS finds the values, which are not negative.

python examples/gradients/recovered_psf.py recovered_psf.png
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

import vkbloom

SIDE = 15


def lens() -> NDArray[np.float64]:
    """Return a star with a soft centre, whose sum is 1."""
    y, x = np.indices((SIDE, SIDE)) - SIDE // 2
    soft = np.exp(-(x**2 + y**2) / 4.0)
    rays = 0.3 * (np.abs(x) == np.abs(y)) * np.exp(-np.hypot(x, y) / 5)
    kernel: NDArray[np.float64] = soft + rays
    return kernel / kernel.sum()


def recover(
    renderer: vkbloom.Renderer, image: NDArray[Any], picture: NDArray[Any]
) -> NDArray[np.float64]:
    """Return the kernel whose bloom of the image is the picture."""

    def loss(values: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        kernel = values.reshape(SIDE, SIDE).astype(np.float32)
        settings = vkbloom.Convolution(kernel, normalize=False)
        frames, pullback = vkbloom.vjp(image, settings, renderer=renderer)
        residual = frames["final"] - picture
        slope = pullback({"final": residual})["kernel"].sum(axis=2)
        return 0.5 * float(np.vdot(residual, residual)), slope.ravel().astype(np.float64)

    start = np.full(SIDE * SIDE, 1 / SIDE**2)
    found = optimize.minimize(
        loss,
        start,
        jac=True,
        method="L-BFGS-B",
        bounds=[(1e-9, None)] * start.size,
        options={"maxiter": 60},
    )
    kernel: NDArray[np.float64] = found.x.reshape(SIDE, SIDE)
    return kernel


def main(path: str) -> None:
    """Write the kernel that was found and the true one side by side."""
    truth = lens()
    image = (np.random.default_rng(2).random((48, 64, 3), np.float32) ** 10 * 10).astype(np.float32)
    with vkbloom.Renderer() as renderer:
        settings = vkbloom.Convolution(truth.astype(np.float32), normalize=False)
        picture = renderer.apply(image, settings, framebuffers="final")["final"]
        found = recover(renderer, image, picture)
    print(f"largest error: {np.abs(found - truth).max() / truth.max():.4f} of the kernel's maximum")
    both = np.concatenate([found, truth], axis=1)[..., None].repeat(3, axis=2)
    shown = (both / truth.max()).astype(np.float32)
    vkbloom.write(path, np.clip(shown, 0, 1).repeat(16, axis=0).repeat(16, axis=1))


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "recovered_psf.png")
