"""
Irises and their stars
======================

An iris with straight blades makes rays: two for each pair of opposite blades. Kernels of renderers
are point-spread functions, too.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom
from vkbloom import psf

iris = psf.iris(blades=6, rotation=15, size=128)
kernels = {
    "aperture, 6 blades": psf.aperture(iris, f_number=22),
    "aperture, 7 blades, dust": psf.aperture(psf.iris(blades=7, dust=40, size=128), f_number=22),
    "star": psf.star(rays=4, angle=45, length=0.4),
    "unreal": psf.unreal(psf.aperture(iris, f_number=22), size=0.8),
    "fog_glow": psf.fog_glow(size=128),
    "samples": psf.samples(np.eye(65) / 65),
    "measured": psf.measured(vkbloom.Pyramid(levels=4), size=(129, 129)),
}
figure, places = plt.subplots(2, 4, figsize=(9, 4.7), layout="constrained")
places[0, 0].imshow(np.asarray(iris), cmap="gray")
places[0, 0].set_title("iris")
for axes, (name, kernel) in zip(places.flat[1:], kernels.items(), strict=True):
    light = kernel.array((129, 129)).mean(axis=2)
    axes.imshow(np.log10(np.maximum(light / light.max(), 1e-6)), cmap="magma", vmin=-6)
    axes.set_title(name, fontsize=9)
for axes in places.flat:
    axes.axis("off")
plt.show()
