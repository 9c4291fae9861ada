"""
Levels of a pyramid
===================

`vkbloom.Pyramid` halves the picture level by level, and adds the levels up on the way back. Each
halving doubles the reach of the same few samples.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom

image = np.zeros((128, 192, 3), np.float32)
image[60:68, 90:102] = (1, 0.8, 0.5)
frames = vkbloom.apply(image, vkbloom.Pyramid(levels=5))
down = [name for name in frames if name.startswith("down")]
up = [name for name in frames if name.startswith("up")]

figure, places = plt.subplots(2, 5, figsize=(9, 2.8), layout="constrained")
for row, names in zip(places, (down, [*up[::-1], "bloom"]), strict=True):
    for axes, name in zip(row, names, strict=True):
        picture = frames[name][..., :3]
        axes.imshow((picture / picture.max()).clip(0, 1) ** (1 / 2.2), interpolation="nearest")
        axes.set_title(f"{name}, {picture.shape[1]} x {picture.shape[0]}", fontsize=9)
        axes.axis("off")
plt.show()
