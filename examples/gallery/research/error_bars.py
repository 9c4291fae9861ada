"""
Error bars of a fit
===================

With noise, a picture determines the settings of a bloom only within intervals.
`vkbloom.FitResult.interval` has them; `vkbloom.FitResult.correlation` says which settings stand for
each other.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom

rng = np.random.default_rng(0)
image = (rng.random((32, 48, 3)) ** 8 * 4).astype(np.float32)
truth = vkbloom.Convolution(vkbloom.psf.gaussian(3.0), intensity=0.3)
clean = vkbloom.reference.apply(image, truth)["final"]

figure, places = plt.subplots(1, 2, figsize=(9, 2.8), layout="constrained")
start = truth.replace(**{"psf.sigma": 2.0, "intensity": 0.5})
for noise in (0.01, 0.02, 0.03):
    target = clean + noise * rng.standard_normal(clean.shape)
    found = vkbloom.fit(image, target, start, ["psf.sigma", "intensity"], max_calls=60)
    for axes, name, value in zip(places, found.vary, (3.0, 0.3), strict=True):
        low, high = found.interval(name)
        axes.plot([noise, noise], [low, high], "_-", markersize=14, color="C0")
        axes.axhline(value, color="gray", linewidth=0.8)
        axes.set(xlabel="noise", title=name)
    print(f"noise {noise}: correlation {found.correlation[0, 1]:.2f}")
plt.show()
