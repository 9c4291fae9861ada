"""
A point spread that varies over the field
=========================================

Towards the corners of a lens, points become comets. With `vkbloom.psf.Varying` each light is spread
by the kernel of its own place; with `vkbloom.psf.Gathered` each pixel collects by its own.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom
from vkbloom import psf


def coma(u, v):
    y, x = np.mgrid[-10:11, -10:11]
    spread = sum(
        np.exp(-((x - 6 * t * u) ** 2 + (y - 6 * t * v) ** 2) / (1 + 12 * t * (u * u + v * v)))
        for t in np.linspace(0, 1, 8)
    )
    return spread / spread.sum()


stars = np.zeros((120, 180, 3), np.float32)
stars[12::24, 12::26] = 30
figure, places = plt.subplots(1, 3, figsize=(9, 2.3), layout="constrained")
for axes, lens in zip(
    places,
    (psf.Varying(function=coma, tolerance=0.005), psf.Gathered(function=coma, tolerance=0.005)),
    strict=False,
):
    frames = vkbloom.apply(stars, vkbloom.Convolution(lens, composite="mix", intensity=1))
    axes.imshow(frames["final"].clip(0, 1) ** (1 / 2.2))
    axes.set_title(f"{type(lens).__name__}, {frames.info['psf_kernels']} kernels")
places[2].imshow(lens.at(179, 119, frame=(180, 120)))
places[2].imshow(lens.at(179, 119, frame=(180, 120))[..., 0], cmap="gray")
places[2].set_title("kernel of the last pixel")
for axes in places:
    axes.axis("off")
plt.show()
