"""
Looks beside each other
=======================

`vkbloom.presets` is a mapping of names to settings. Given a path, `vkbloom.apply` reads the file as
the preset needs it: with expanded highlights, if it adds light above white.
"""

import matplotlib.pyplot as plt
from skimage import data

import vkbloom

vkbloom.write("photo.png", data.rocket()[190:, 150:530])
looks = ["mist", "soft", "dreamy", "film_halation", "star6", "anamorphic"]
assert set(looks) <= set(vkbloom.presets)

figure, places = plt.subplots(2, 3, figsize=(9, 5.2), layout="constrained")
for axes, look in zip(places.flat, looks, strict=True):
    final = vkbloom.apply("photo.png", look, encoding="srgb", framebuffers="final")["final"]
    axes.imshow(final.clip(0, 1))
    axes.set_title(look)
    axes.axis("off")
plt.show()
