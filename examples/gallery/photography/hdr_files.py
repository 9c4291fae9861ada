"""
HDR in and out
==============

OpenEXR files hold linear light without an upper limit; so do arrays. A PNG for displays of HDR
holds the PQ signal of Rec. 2020. `vkbloom.read` returns linear light of all of them.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom

ramp = np.geomspace(0.01, 40, 320, dtype=np.float32)
image = ramp[None, :, None] * np.ones((60, 1, 3), np.float32)
image[20:40] *= (1, 0.6, 0.2)
vkbloom.write("light.exr", image)
vkbloom.write("light_pq.png", image, encoding="pq", primaries="rec2020", bits=16)
vkbloom.write("light_srgb.png", image)

figure, (shown, curve) = plt.subplots(1, 2, figsize=(9, 2.8), layout="constrained")
shown.imshow(plt.imread("light_srgb.png"))
shown.set_title("light_srgb.png: clipped at 1")
shown.axis("off")
for name in ("light.exr", "light_pq.png", "light_srgb.png"):
    curve.loglog(ramp, vkbloom.read(name)[0, :, 0], label=name)
curve.set(xlabel="written", ylabel="read")
curve.legend()
plt.show()
