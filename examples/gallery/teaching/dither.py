"""
Eight bits and dither
=====================

A wide soft bloom has fewer steps than 8 bits show well: there are bands. Noise of one level before
rounding hides them, and keeps the mean.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom

image = np.zeros((90, 160, 3), np.uint8)
image[40:50, 70:90] = 90
smooth = vkbloom.Pyramid(levels=5, intensity=0.6, format="rgba16float")

figure, places = plt.subplots(1, 2, figsize=(9, 2.6), layout="constrained")
for axes, dither in zip(places, (False, True), strict=True):
    final = vkbloom.apply(image, smooth, dither=dither)["final"]
    assert final.dtype == np.uint8
    axes.imshow(final[..., 0], cmap="gray", vmin=0, vmax=8, interpolation="nearest")
    axes.set_title(f"dither={dither}, mean {final.mean():.3f}")
    axes.axis("off")
plt.show()
