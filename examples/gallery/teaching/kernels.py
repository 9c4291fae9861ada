"""
Kernels and their sums
======================

Nine samples can be a good Gaussian, or one whose sum is not 1: then each loop darkens or brightens
the bloom. `vkbloom.testing.point_spread` measures the kernel of any blur.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom
from vkbloom import testing

half_kernels = {
    "sigma 1.5": vkbloom.gaussian_weights(1.5, radius=4),
    "sigma 3, cut off": vkbloom.gaussian_weights(3.0, radius=4),
    "the deferred tutorial's": vkbloom.presets["deferred"].weights,
    "box": (1 / 9,) * 5,
}
probe = testing.Probe(size=(31, 31))
figure, (left, right) = plt.subplots(1, 2, figsize=(9, 2.8), layout="constrained")
for name, weights in half_kernels.items():
    settings = vkbloom.Separable(weights=weights, blur_strength=1.0, format="rgba32float")
    spread = testing.point_spread(lambda x, s=settings: vkbloom.apply(x, s)["bloom"], probe)[..., 0]
    left.plot(np.arange(-15, 16), spread[15], "o-", markersize=3, label=name)
    loops = [spread.sum() ** count for count in range(6)]
    right.plot(loops, label=f"{name}: {spread.sum():.3f}")
left.set(xlabel="pixels", title="point spread along a row")
right.set(xlabel="loops", title="light that is left")
right.legend()
plt.show()
