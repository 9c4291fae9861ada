"""
Glare of the eye
================

The same lamp for eyes of two ages, and adapted to night. All functions of the eye are in degrees:
the field of view decides how many pixels they cover.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom
from vkbloom import psf

night = np.zeros((120, 180, 3), np.float32)
night[59:61, 89:91] = 4000
eyes = {
    "20 years": psf.cie_total(age=20),
    "80 years": psf.cie_total(age=80),
    "Spencer et al., scotopic": psf.spencer("scotopic"),
}
figure, places = plt.subplots(1, 4, figsize=(9, 2.2), layout="constrained")
for axes, (name, eye) in zip(places, eyes.items(), strict=False):
    settings = vkbloom.Convolution(eye, composite="mix", pixels_per_degree=10)
    final = vkbloom.apply(night, settings)["final"]
    axes.imshow(final.clip(0, 1) ** (1 / 2.2))
    axes.set_title(name, fontsize=9)
    axes.axis("off")
degrees = np.geomspace(0.1, 30, 60)
for age in (20, 80):
    places[3].loglog(degrees, psf.cie_general(age=age).density(degrees)[:, 0], label=f"{age} years")
places[3].set_title("disability glare", fontsize=9)
places[3].set_xlabel("degrees")
places[3].legend()
plt.show()
