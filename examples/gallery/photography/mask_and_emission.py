"""
Only some lights glow
=====================

A mask says where a picture glows. An emission takes the picture's place as the source of the bloom,
as the emissive materials of a game do.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom

image = np.full((180, 270, 3), 0.05, np.float32)
image[60:80, 60:80] = image[60:80, 190:210] = 6
mask = np.zeros((180, 270), bool)
mask[:, :135] = True
emission = np.zeros_like(image)
emission[110:114, 40:230] = (0.5, 2, 8)

settings = vkbloom.Pyramid(threshold=1, intensity=2, tonemap="reinhard", encoding="srgb")
finals = {
    "all": vkbloom.apply(image, settings),
    "mask=": vkbloom.apply(image, settings, mask=mask),
    "emission=": vkbloom.apply(image, settings, emission=emission),
}
figure, places = plt.subplots(1, 3, figsize=(9, 2.3), layout="constrained")
for axes, (name, frames) in zip(places, finals.items(), strict=True):
    axes.imshow(frames["final"].clip(0, 1))
    axes.set_title(name)
    axes.axis("off")
plt.show()
