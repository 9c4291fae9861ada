"""
A bloom fitted to a picture
===========================

Which settings made the glow of a picture? `vkbloom.fit` starts from candidates and finds the values
whose result comes closest.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom

image = np.full((60, 100, 3), 0.02, np.float32)
image[20:26, 20:34] = (6, 4, 2)
image[40:43, 70:74] = (2, 4, 9)
# The picture of another program, whose settings are not known:
target = vkbloom.reference.apply(image, vkbloom.UrpBloom(threshold=1.2, intensity=0.6))["final"]

starts = [vkbloom.presets["unity_urp"], vkbloom.presets["kino"]]
found = vkbloom.fit(image, target, starts, ["threshold", "intensity"], max_calls=40)
for result in found:
    print(result)

best = found[0]
figure, places = plt.subplots(1, 3, figsize=(9, 2), layout="constrained")
pictures = {"target": target, best.settings.method: best.frames["final"]}
for axes, (name, picture) in zip(places, pictures.items(), strict=False):
    axes.imshow((picture / 2).clip(0, 1) ** (1 / 2.2))
    axes.set_title(name)
places[2].imshow(best.residual.mean(axis=2), cmap="coolwarm", vmin=-0.5, vmax=0.5)
places[2].set_title(f"difference, {best.verdict}")
for axes in places:
    axes.axis("off")
plt.show()
