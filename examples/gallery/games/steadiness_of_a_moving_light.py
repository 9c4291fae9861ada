"""
Steadiness under a moving light
===============================

A small light that moves by parts of a pixel must not make its bloom flicker.
`vkbloom.testing.stability` moves a light, and measures energy, place and peak of the bloom.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom
from vkbloom import testing

blooms = {
    "Pyramid": vkbloom.Pyramid(levels=3, format="rgba32float"),
    "DualKawase": vkbloom.DualKawase(levels=3, format="rgba32float"),
    "half as many pixels": vkbloom.Separable(bloom_scale=0.5, format="rgba32float"),
}
figure, axes = plt.subplots(figsize=(9, 2.8), layout="constrained")
positions = np.arange(32) / 4
for name, settings in blooms.items():
    found = testing.stability(
        lambda image, settings=settings: vkbloom.apply(image, settings)["bloom"],
        texel=8,
        steps=2,
    )
    print(
        f"{name}: ripple {found.ripple:.1e}, jitter {found.jitter:.2g}, flicker {found.flicker:.2g}"
    )
    peaks = []
    for at in positions:
        image = np.zeros((64, 64, 3), np.float32)
        image[32] = 8 * np.clip(1 - abs(np.arange(64) - 28 - at), 0, 1)[:, None]
        peaks.append(vkbloom.apply(image, settings)["bloom"][..., 0].max())
    axes.plot(positions, np.array(peaks) / np.mean(peaks), label=name)
axes.set(xlabel="position of the light in pixels", ylabel="peak of its bloom / mean")
axes.legend()
plt.show()
