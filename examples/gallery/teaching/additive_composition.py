"""
Adding, mixing, screening
=========================

With ``composite="add"`` the final picture is the picture plus the bloom, as an assertion says.
"mix" keeps the energy, and "screen" stays below 1.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom

image = np.full((90, 160, 3), 0.1, np.float32)
image[35:55, 60:100] = 2
settings = vkbloom.Pyramid(intensity=0.5)

added = vkbloom.apply(image, settings)
assert np.allclose(added["final"], image + 0.5 * added["bloom"][..., :3], atol=1e-3)

figure, axes = plt.subplots(figsize=(9, 2.8), layout="constrained")
axes.plot(image[45, :, 0], "k", label="picture")
for composite in ("add", "mix", "screen"):
    final = vkbloom.apply(image, settings, composite=composite)["final"]
    axes.plot(final[45, :, 0], label=f"{composite}, mean {final.mean():.3f}")
axes.set(xlabel="column", ylabel="light")
axes.legend()
plt.show()
