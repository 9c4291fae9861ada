"""
A law that fails
================

A bloom that stores its light in 0..1 loses the energy of bright lights.
`vkbloom.testing.assert_laws` says so, with figures: a test of one line.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom
from vkbloom import testing

settings = vkbloom.Separable(format="rgba32float", blur_strength=1.0)


def right(image):
    return vkbloom.apply(image, settings)["bloom"]


def clamped(image):
    return vkbloom.apply(image.clip(0, 1), settings)["bloom"]


testing.assert_laws(right, "unclamped", "symmetric", size=(64, 64))
try:
    testing.assert_laws(clamped, "unclamped", "symmetric", size=(64, 64))
except AssertionError as error:
    print(error)

lights = np.geomspace(0.1, 100, 12)
figure, axes = plt.subplots(figsize=(9, 2.8), layout="constrained")
for bloom in (right, clamped):
    image = np.zeros((32, 32, 3), np.float32)
    image[16, 16] = 1
    sums = [bloom(np.float32(light) * image)[..., 0].sum() for light in lights]
    axes.loglog(lights, sums, label=bloom.__name__)
axes.set(xlabel="brightness of a light", ylabel="sum of its bloom")
axes.legend()
plt.show()
