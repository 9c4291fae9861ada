"""
Gradients, checked by finite differences
========================================

`vkbloom.vjp` returns a picture, and a function that takes a derivative by the picture to those by
all settings and pixels. `vkbloom.reference.vjp` does so in float64.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom

image = np.full((48, 80, 3), 0.1, np.float32)
image[20:26, 16:30] = (4, 2, 1)
image[30:33, 56:59] = (1.2, 2, 5)
settings = vkbloom.Pyramid(threshold=1, knee=0.5, intensity=0.3)
frames, pullback = vkbloom.vjp(image, settings)
gradients = pullback({"final": np.ones_like(image)})
_, exact = vkbloom.reference.vjp(image, settings)
exact = exact({"final": np.ones_like(image)})


def light(**fields):
    return vkbloom.reference.apply(image, settings.replace(**fields))["final"].sum()


for name in ("threshold", "knee", "intensity"):
    value, step = getattr(settings, name), 1e-4
    slope = (light(**{name: value + step}) - light(**{name: value - step})) / (2 * step)
    print(f"{name}: {gradients[name]:.4f}, {exact[name]:.4f}, by differences {slope:.4f}")

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 2.8), layout="constrained")
left.imshow(frames["final"].clip(0, 1))
left.set_title("final")
shown = right.imshow(gradients["image"].mean(axis=2), cmap="coolwarm")
right.set_title("derivative of all light by each pixel")
figure.colorbar(shown, ax=right)
plt.show()
