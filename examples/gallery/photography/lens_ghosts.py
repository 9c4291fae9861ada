"""
Ghosts, a halo and dirt
=======================

A bright light in the frame is reflected between the surfaces of a lens. `vkbloom.Ghosts` draws
mirrored copies, `vkbloom.Halo` a ring, and `vkbloom.Dirt` multiplies both.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom

sky = np.linspace(0.02, 0.2, 240, dtype=np.float32)[:, None, None] * np.float32([0.5, 0.7, 1])
image = np.repeat(sky, 360, axis=1)
y, x = np.mgrid[:240, :360]
image[np.hypot(y - 60, x - 90) < 8] = (80, 70, 50)

glare = (
    vkbloom.Ghosts(threshold=1, intensity=0.05, aberration=0.01),
    vkbloom.Halo(threshold=1, intensity=0.2, radius=0.5, aberration=0.02),
    vkbloom.Dirt(seed=5, strength=8),
)
figure, places = plt.subplots(1, 3, figsize=(9, 2.3), layout="constrained")
for axes, count in zip(places, (1, 2, 3), strict=True):
    settings = vkbloom.Pyramid(
        threshold=1, intensity=0.1, glare=glare[:count], tonemap="reinhard", encoding="srgb"
    )
    axes.imshow(vkbloom.apply(image, settings)["final"].clip(0, 1))
    axes.set_title(" + ".join(type(stage).__name__ for stage in glare[:count]))
    axes.axis("off")
print(list(vkbloom.glares))  # those of engines, by name
plt.show()
