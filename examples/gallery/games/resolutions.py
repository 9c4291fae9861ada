"""
The same at every resolution?
=============================

A bloom that is defined in pixels becomes smaller at 4K. `vkbloom.testing.resolution_response`
measures the radius that holds half of the light, as a share of the height.
"""

import matplotlib.pyplot as plt

import vkbloom
from vkbloom import testing

SCALES = (0.5, 1, 2)
blooms = {
    "Separable": vkbloom.Separable(blur_scale=4, blur_strength=1),
    "BevyBloom": vkbloom.BevyBloom(max_mip_dimension=64),
    "GodotBloom": vkbloom.GodotBloom(threshold=0),
}
probe = testing.Probe(size=(128, 128))
figure, axes = plt.subplots(figsize=(9, 2.8), layout="constrained")
for name, settings in blooms.items():
    found = testing.resolution_response(
        lambda image, settings=settings: vkbloom.apply(image, settings)["bloom"],
        SCALES,
        probe=probe,
    )
    axes.plot([128 * scale for scale in SCALES], found.r50, "o-", label=name)
axes.set(xlabel="height in pixels", ylabel="radius of half of the light / height")
axes.set_ylim(0)
axes.legend()
plt.show()
