"""
Is a Gaussian separable?
========================

A blur by rows and then by columns takes 2 N samples for each pixel instead of N^2. Two passes and
one pass show the same picture: their structural similarity is 1.
"""

import matplotlib.pyplot as plt
import numpy as np
from skimage.metrics import structural_similarity

import vkbloom

scene = vkbloom.render(vkbloom.Scene.ufo(), "tutorial", (320, 180))["scene"]
image = (scene[..., :3] / np.float32(255)) ** 2.2
weights = vkbloom.gaussian_weights(4.0)
two = vkbloom.Separable(weights=weights, blur_strength=1.0)
one = two.replace(direct=True)

figure, places = plt.subplots(1, 3, figsize=(9, 2), layout="constrained")
blooms = [vkbloom.apply(image, settings)["bloom"][..., :3] for settings in (two, one)]
similarity = structural_similarity(*blooms, channel_axis=2, data_range=1)
samples = 2 * len(weights) - 1
titles = (f"{2 * samples} samples", f"{samples**2} samples")
for axes, bloom, title in zip(places, blooms, titles, strict=False):
    axes.imshow(bloom.clip(0, 1) ** (1 / 2.2))
    axes.set_title(title)
places[2].imshow(abs(blooms[0] - blooms[1]).max(axis=2), vmin=0, vmax=1 / 255)
places[2].set_title(f"difference, SSIM {similarity:.6f}")
for axes in places:
    axes.axis("off")
plt.show()
