"""
The bloom of darktable
======================

`vkbloom.DarktableBloom` is the module Bloom of darktable, with the same three sliders. It works on
the lightness of a picture that was developed, so highlights are not expanded.
"""

import matplotlib.pyplot as plt
from skimage import data

import vkbloom

vkbloom.write("photo.png", data.rocket()[190:, 150:530])
photo = vkbloom.read("photo.png")

figure, places = plt.subplots(1, 3, figsize=(9, 2.2), layout="constrained")
for axes, strength in zip(places, (0, 50, 100), strict=True):
    settings = vkbloom.DarktableBloom(blur_size=20, threshold=70, strength=strength)
    final = vkbloom.apply(photo, settings, encoding="srgb")["final"]
    axes.imshow(final.clip(0, 1))
    axes.set_title(f"strength={strength}")
    axes.axis("off")
plt.show()
