"""
A grid of settings
==================

`vkbloom.grid` renders all combinations of some settings into one xarray Dataset. With a store it
resumes what is there, and `vkbloom.check_grid` looks for what is missing.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom

image = np.full((60, 90, 3), 0.05, np.float32)
image[28:32, 30:60] = 6
dataset = vkbloom.grid(
    image,
    vkbloom.Pyramid(encoding="srgb"),
    {"threshold": [0.0, 1.0, 4.0], "levels": [2, 4, 6], "tonemap": ["none", "aces"]},
    reduce={"light": lambda frames: frames["final"].sum(dtype=float)},
    store="pyramid.zarr",
)
print(vkbloom.check_grid("pyramid.zarr"))
print(dataset["light"].sel(tonemap="none").values.round(0))

finals = dataset["final"].sel(tonemap="aces")
figure, places = plt.subplots(3, 3, figsize=(9, 6), layout="constrained")
for row, levels in zip(places, finals.levels, strict=True):
    for axes, threshold in zip(row, finals.threshold, strict=True):
        axes.imshow(finals.sel(levels=levels, threshold=threshold).clip(0, 1))
        axes.set_title(f"levels={levels.item()}, threshold={threshold.item():g}", fontsize=9)
        axes.axis("off")
plt.show()
