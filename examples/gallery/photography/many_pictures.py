"""
Many pictures
=============

`vkbloom.Renderer.map` takes any iterable of pictures, reads ahead, and keeps the device busy. Only
the framebuffers that are asked for are read back.
"""

import matplotlib.pyplot as plt
import numpy as np
from skimage import data

import vkbloom


def parts_of_a_photograph():
    photo = (data.rocket() / np.float32(255)) ** 2.2
    for column in range(0, 480, 40):
        yield np.ascontiguousarray(photo[260:420, column : column + 160])


settings = vkbloom.presets["photo"].replace(threshold=0.6, intensity=0.6, encoding="srgb")
with vkbloom.Renderer("software") as renderer:
    made = [
        frames["final"]
        for frames in renderer.map(parts_of_a_photograph(), settings, framebuffers="final")
    ]
figure, places = plt.subplots(2, 6, figsize=(9, 3.1), layout="constrained")
for axes, final in zip(places.flat, made, strict=True):
    axes.imshow(final.clip(0, 1))
    axes.axis("off")
plt.show()
