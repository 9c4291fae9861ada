"""
A point spread recovered from two pictures
==========================================

A picture with and without a filter in front of the lens is enough: `vkbloom.recover_psf` finds the
kernel, and the standard deviation of each of its values.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom

rng = np.random.default_rng(0)
image = (rng.random((64, 96, 3)) ** 6).astype(np.float32)
rays = np.eye(9) + np.eye(9)[::-1] + 10 * (np.indices((9, 9)) == 4).all(axis=0)
truth = rays / rays.sum()
lens = vkbloom.Convolution(truth, normalize=False, composite="mix", intensity=1)
glared = vkbloom.reference.apply(image, lens)["final"]
glared += 0.002 * rng.standard_normal(glared.shape)

found = vkbloom.recover_psf(image, glared, size=(9, 9))
kernel, error = found.kernels[0, 0], found.error.reshape(found.kernels.shape)[0, 0]
if kernel.ndim == 3:
    kernel, error = kernel.mean(axis=2), error.mean(axis=2)
print(f"noise {found.noise:.4f}, largest error {abs(kernel - truth).max():.4f}")

figure, places = plt.subplots(1, 3, figsize=(9, 2.8), layout="constrained")
pictures = {"the kernel": truth, "recovered": kernel, "standard deviation": error}
for axes, (name, picture) in zip(places, pictures.items(), strict=True):
    shown = axes.imshow(picture)
    figure.colorbar(shown, ax=axes)
    axes.set_title(name)
    axes.axis("off")
plt.show()
