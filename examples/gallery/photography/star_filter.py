"""
Rays of a star filter
=====================

`vkbloom.Streaks` adds rays to what glows, in any number of directions. As a field of the settings
they are framebuffers, too.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom

night = np.full((240, 360, 3), 0.003, np.float32)
rng = np.random.default_rng(3)
for y, x in rng.integers((20, 20), (220, 340), (7, 2)):
    night[y : y + 2, x : x + 2] = rng.uniform(5, 60) * np.array([1, 0.8, 0.5])

figure, places = plt.subplots(1, 3, figsize=(9, 2.3), layout="constrained")
for axes, directions in zip(places, (1, 4, 6), strict=True):
    rays = vkbloom.Streaks(directions=directions, angle=20, length=1, fade=0.88, intensity=2)
    settings = vkbloom.Pyramid(threshold=1, glare=(rays,), tonemap="reinhard", encoding="srgb")
    frames = vkbloom.apply(night, settings)
    axes.imshow(frames["final"].clip(0, 1))
    axes.set_title(f"{directions} directions")
    axes.axis("off")
print(list(frames))
plt.show()
