"""
Two blooms compared
===================

How do the blooms of two engines differ on the same picture? `vkbloom.testing.diagnose` names what
differs where it is simple, such as a factor or a shift.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom
from vkbloom import testing

scene = vkbloom.render(vkbloom.Scene.ufo(), "deferred", (320, 180), shading="deferred")["scene"]
image = 4 * scene[..., :3].astype(np.float32)
frames = {name: vkbloom.apply(image, name) for name in ("kino", "filament")}
kino, filament = (one["bloom"][..., :3] for one in frames.values())
print(testing.diagnose(kino, filament))
print(testing.diagnose(kino, 2 * kino))

figure, places = plt.subplots(1, 3, figsize=(9, 2), layout="constrained")
for axes, (name, one) in zip(places, frames.items(), strict=False):
    axes.imshow((one["final"] / 2).clip(0, 1) ** (1 / 2.2))
    axes.set_title(name)
limit = abs(kino - filament).max()
difference = (kino - filament).mean(axis=2)
places[2].imshow(difference, cmap="coolwarm", vmin=-limit, vmax=limit)
places[2].set_title("difference of the blooms")
for axes in places:
    axes.axis("off")
plt.show()
