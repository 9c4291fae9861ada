"""
Point spreads of a lens
=======================

Diffraction at a round aperture, scatter of surfaces, and defocus, each as a point-spread function
with encircled energy and MTF.
"""

import matplotlib.pyplot as plt
import numpy as np

from vkbloom import psf

functions = {
    "airy at f/8": psf.airy(f_number=8, pixel_pitch=1),
    "airy at f/22": psf.airy(f_number=22, pixel_pitch=1),
    "gaussian": psf.gaussian(sigma=6),
}
radii, frequencies = np.linspace(0, 30, 61), np.linspace(0, 0.3, 61)
figure, (energy, mtf, scatter) = plt.subplots(1, 3, figsize=(9, 2.8), layout="constrained")
for name, function in functions.items():
    energy.plot(radii, function.encircled_energy(radii)[:, 0], label=name)
    mtf.plot(frequencies, function.mtf(frequencies)[:, 0])
energy.set(xlabel="radius in pixels", title="encircled energy")
energy.legend()
mtf.set(xlabel="cycles per pixel", title="MTF")

degrees = np.geomspace(0.01, 45, 100)
for surfaces in (2, 14, 40):
    lens = psf.harvey_shack(surfaces=surfaces)
    scatter.loglog(degrees, lens.density(degrees)[:, 0])
    print(f"{surfaces} surfaces scatter {100 * lens.energy()[0]:.2f} % of the light")
scatter.set(xlabel="degrees", title="scatter per steradian")
plt.show()
