"""
Fireflies and prefilters
========================

A single very bright pixel should not light up half of the picture. The firefly filter of
`vkbloom.Pyramid` weights samples by 1 / (1 + luminance) while it halves the picture for the first
time.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom

image = np.full((120, 200, 3), 0.05, np.float32)
image[40:80, 30:70] = 2  # a lamp
image[60, 150] = 5000  # a firefly

figure, (*places, curve) = plt.subplots(1, 3, figsize=(9, 2.3), layout="constrained")
for axes, on in zip(places, (False, True), strict=True):
    bloom = vkbloom.apply(image, vkbloom.Pyramid(firefly_filter=on))["bloom"][..., :3]
    axes.imshow(bloom.clip(0, 1) ** (1 / 2.2))
    axes.set_title(f"bloom, firefly_filter={on}")
    axes.axis("off")
    curve.semilogy(bloom[60, :, 0], label=f"firefly_filter={on}")
curve.set(xlabel="column", ylabel="bloom")
curve.legend()
plt.show()
