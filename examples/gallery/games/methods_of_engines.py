"""
One light, every engine
=======================

Each method is a class of settings. Here every engine's defaults spread the same small light; the
grey scale is logarithmic.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom

METHODS = [
    vkbloom.Separable,
    vkbloom.Pyramid,
    vkbloom.DualKawase,
    vkbloom.KinoBloom,
    vkbloom.BevyBloom,
    vkbloom.FilamentBloom,
    vkbloom.UrpBloom,
    vkbloom.HdrpBloom,
    vkbloom.PostProcessingBloom,
    vkbloom.UnrealBloom,
    vkbloom.ThreeBloom,
    vkbloom.GodotBloom,
    vkbloom.BlenderGlare,
    vkbloom.PygfxBloom,
    vkbloom.PmndrsBloom,
    vkbloom.BabylonBloom,
    vkbloom.PlayCanvasBloom,
    vkbloom.Halation,
]
light = np.zeros((96, 144, 3), np.float32)
light[45:51, 69:75] = 50
figure, places = plt.subplots(3, 6, figsize=(9, 4), layout="constrained")
for axes, method in zip(places.flat, METHODS, strict=True):
    bloom = vkbloom.apply(light, method())["bloom"][..., :3].mean(axis=2, dtype=float)
    axes.imshow(np.log10(bloom / bloom.max() + 1e-5), cmap="gray", vmin=-5, vmax=0)
    axes.set_title(method.__name__, fontsize=8)
    axes.axis("off")
plt.show()
