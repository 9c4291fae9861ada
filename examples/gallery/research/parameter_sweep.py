"""
A sweep of one parameter
========================

`vkbloom.Renderer.sweep` renders one picture with many settings. The picture is uploaded once, and a
pass runs only when one of its inputs has changed.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom

image = np.full((90, 160, 3), 0.05, np.float32)
image[40:50, 30:50] = (8, 5, 2)
image[30:34, 110:114] = (3, 6, 12)
radii = (0.5, 1, 2, 4)
settings = [vkbloom.Pyramid(threshold=1, radius=radius) for radius in radii]

figure, places = plt.subplots(1, 4, figsize=(9, 1.7), layout="constrained")
with vkbloom.Renderer("software") as renderer:
    handle = renderer.upload(image)
    for axes, one, frames in zip(places, settings, renderer.sweep(handle, settings), strict=True):
        print(one.radius, list(frames.timings))
        axes.imshow((frames["final"] / 2).clip(0, 1) ** (1 / 2.2))
        axes.set_title(f"radius={one.radius:g}")
        axes.axis("off")
plt.show()
