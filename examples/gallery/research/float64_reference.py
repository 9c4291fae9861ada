"""
The device and the reference
============================

`vkbloom.reference` computes every method in NumPy and float64, written from the formulas. So the
error of a device is a figure.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom
from vkbloom import reference

image = (np.random.default_rng(0).random((60, 90, 3)) ** 6 * 4).astype(np.float32)
figure, axes = plt.subplots(figsize=(9, 3), layout="constrained")
for format in ("rgba32float", "rgba16float", "rg11b10ufloat"):
    settings = vkbloom.Pyramid(threshold=0.8, levels=4, intensity=0.5, format=format)
    frames = vkbloom.apply(image, settings)
    exact = reference.apply(image, settings.replace(format="rgba32float"))
    errors = {name: np.abs(frames[name] - exact[name]).max() for name in exact}
    axes.semilogy(list(errors), np.maximum(list(errors.values()), 1e-9), "o-", label=format)
axes.set(ylabel="largest difference")
axes.legend()

# The parts of the reference: passes of the blur, composite, and the gain of a flat picture.
passes = reference.passes(exact["glow"], settings, format="rgba32float")
bloom = reference.blur(exact["glow"], settings, format="rgba32float")
final = reference.composite(image, bloom, settings)
print(list(passes), np.abs(final - exact["final"]).max(), reference.gain(settings))
plt.show()
