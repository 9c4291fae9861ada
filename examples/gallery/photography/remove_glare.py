"""
Glare removed from a photograph
===============================

If the point spread of a lens is known, `vkbloom.deglare` finds the picture that it would show
without its glare.
"""

import matplotlib.pyplot as plt
import numpy as np
from skimage import data

import vkbloom

photo = (data.rocket()[::4, ::4] / 255) ** 2.2
photo = photo.astype(np.float32) + 8 * (photo > 0.9)
lens = vkbloom.psf.harvey_shack(surfaces=14)
settings = vkbloom.Convolution(lens, composite="mix", intensity=0.3, pixels_per_degree=8)
glared = vkbloom.apply(photo, settings)["final"]
clean = vkbloom.deglare(glared, lens, share=0.3, pixels_per_degree=8, iterations=20)

figure, places = plt.subplots(1, 3, figsize=(9, 2.3), layout="constrained")
pictures = {"photograph": photo, "with glare": glared, "glare removed": clean}
for axes, (name, picture) in zip(places, pictures.items(), strict=True):
    error = np.abs(picture - photo).max()
    axes.imshow(picture.clip(0, 1) ** (1 / 2.2))
    axes.set_title(f"{name}, off by {error:.2g}")
    axes.axis("off")
plt.show()
