"""
Thin lines and temporal anti-aliasing
=====================================

Thin bright lines that move by parts of a pixel jump from column to column. Temporal anti-aliasing
before the bloom blends them over frames; each engine's is a class, and has names in
`vkbloom.antialiasing`.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom

HEIGHT, WIDTH, SPEED = 48, 64, 0.3
motion = np.zeros((HEIGHT, WIDTH, 2), np.float32)
motion[..., 0] = SPEED / WIDTH  # of all pixels, in shares of the width
depth = np.full((HEIGHT, WIDTH), 0.5, np.float32)
images = np.zeros((16, HEIGHT, WIDTH, 3), np.float32)
for number, image in enumerate(images):
    image[:, (np.arange(WIDTH) - int(SPEED * number)) % 16 == 0] = 8

kinds = {
    "none": None,
    "Bevy": vkbloom.BevyAntialiasing(),
    "Godot": vkbloom.GodotAntialiasing(),
    "O3DE": vkbloom.O3deAntialiasing(),
    "HDRP": vkbloom.HdrpAntialiasing(),
}
settings = vkbloom.Pyramid(levels=3)
figure, places = plt.subplots(1, 5, figsize=(9, 2.4), layout="constrained", sharey=True)
for axes, (name, taa) in zip(places, kinds.items(), strict=True):
    given = {} if taa is None else {"motion": [motion] * 16, "depth": [depth] * 16}
    made = vkbloom.sequence(images, settings, fps=60, taa=taa, **given)
    # A column for each place, a row for each frame.
    rows = np.array([one["bloom"][HEIGHT // 2, :, 0] for one in made])
    axes.imshow(rows, aspect="auto", cmap="magma", vmin=0, vmax=rows[4:].max())
    axes.set_title(name)
places[0].set_ylabel("frame")
plt.show()
