"""
Tone curves
===========

A bloom adds light above white, which a display clips. A tone curve compresses it; exposure moves
the picture along the curve.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom

stops = np.linspace(-6, 6, 240, dtype=np.float32)
ramp = np.repeat(0.18 * 2 ** stops[None, :, None], 24, axis=0) * np.ones(3, np.float32)
curves = ["none", "reinhard", "aces", "exponential", "khronos_neutral", "agx"]

figure, (plot, shown) = plt.subplots(1, 2, figsize=(9, 3), layout="constrained")
strips = []
for tonemap in curves:
    settings = vkbloom.Pyramid(bloom=False, tonemap=tonemap, encoding="srgb")
    strips.append(vkbloom.apply(ramp, settings)["final"].clip(0, 1))
    plot.plot(stops, strips[-1][0, :, 1], label=tonemap)
plot.set(xlabel="stops above grey", ylabel="signal")
plot.legend()
shown.imshow(np.concatenate(strips), extent=(-6, 6, len(curves), 0), aspect="auto")
shown.set_yticks(np.arange(len(curves)) + 0.5, curves)
shown.set_xlabel("stops above grey")
plt.show()
