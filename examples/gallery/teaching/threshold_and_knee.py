"""
Threshold and knee
==================

The threshold says which light glows. A hard one makes light pop in and out as it moves; a knee lets
it begin softly. The curve is measured: a ramp goes in, ``glow`` comes out.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom

ramp = np.linspace(0, 2, 200, dtype=np.float32)
image = np.repeat(ramp[None, :, None], 8, axis=0) * np.ones(3, np.float32)

figure, axes = plt.subplots(figsize=(9, 3), layout="constrained")
for knee in (0, 0.25, 0.5, 1):
    glow = vkbloom.apply(image, vkbloom.Pyramid(threshold=1, knee=knee))["glow"]
    axes.plot(ramp, glow[4, :, 0], label=f"knee={knee}")
axes.set(xlabel="light", ylabel="what glows")
axes.legend()
plt.show()
