"""
A lamp that makes the picture flicker
=====================================

A lamp blinks 6 times a second. Its bloom carries the flicker over the picture, and so does an
automatic exposure. `vkbloom.testing.flicker` measures the contrast at each frequency, here of the
half without the lamp.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom
from vkbloom import testing

FPS = 24
frames = []
for number in range(3 * FPS):
    image = np.full((36, 64, 3), 0.1, np.float32)
    image[12:24, 8:20] += 4 + 2 * np.sin(2 * np.pi * 6 * number / FPS)
    frames.append(image)

plain = vkbloom.Pyramid(bloom=False)
bloom = vkbloom.Pyramid(levels=5, intensity=0.2)
cases = {
    "without bloom": (plain, None),
    "bloom": (bloom, None),
    "automatic exposure": (plain, "o3de"),
}
figure, axes = plt.subplots(figsize=(9, 2.8), layout="constrained")
for name, (settings, exposure) in cases.items():
    made = vkbloom.sequence(frames, settings, fps=FPS, exposure=exposure, framebuffers="final")
    halves = [one["final"][:, 32:] for one in made][2 * FPS :]  # when it has adapted
    found = testing.flicker(halves, FPS)
    axes.plot(found.frequencies, found.contrast, "o-", label=name)
axes.set(xlabel="Hz", ylabel="contrast")
axes.legend()
plt.show()
