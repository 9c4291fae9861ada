"""
Halation of film
================

Light that passes the emulsion comes back from the base of the film: a red rim around highlights.
`vkbloom.Halation` has its size on the film in micrometres.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom

image = np.full((200, 300, 3), 0.02, np.float32)
y, x = np.mgrid[:200, :300]
image[np.hypot(y - 100, x - 150) < 30] = 4
image[90:110, 20:60] = (0.1, 0.3, 0.8)

figure, places = plt.subplots(1, 3, figsize=(9, 2.3), layout="constrained")
for axes, size in zip(places, (100, 200, 400), strict=True):
    film = vkbloom.Halation(strength=(1.0, 0.15, 0.02), sizes=(size,) * 3, intensity=0.5)
    final = vkbloom.apply(image, film, tonemap="reinhard", encoding="srgb")["final"]
    axes.imshow(final.clip(0, 1))
    axes.set_title(f"{size} micrometres")
    axes.axis("off")
plt.show()
