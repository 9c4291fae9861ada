"""
A fast pyramid for a slow convolution
=====================================

A pyramid of levels costs little at any width. `vkbloom.fit_pyramid` finds level weights whose point
spread comes close to a given one, here that of the eye.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom
from vkbloom import psf

eye = psf.spencer()
figure, axes = plt.subplots(figsize=(9, 2.8), layout="constrained")
kernel = eye.array((128, 128))[64, 64:, 1]
axes.loglog(np.arange(1, 64), kernel[1:], "k", label="the eye, by Spencer et al.")
light = np.zeros((128, 128, 3), np.float32)
light[64, 64] = 1
for levels in (3, 5):
    found = vkbloom.fit_pyramid(eye, levels, size=(128, 128), direct=True, loss="log")
    print(levels, found.settings.intensity, found.settings.level_weights)
    spread = vkbloom.apply(light, found.settings)["final"][64, 65:, 1]
    axes.loglog(np.arange(1, 64), spread, label=f"{levels} levels, {found.loss:.3f} decades")
axes.set(xlabel="distance in pixels", ylabel="light of a point")
axes.legend()
plt.show()
