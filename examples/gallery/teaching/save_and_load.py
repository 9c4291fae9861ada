"""
Save a result, and go on later
==============================

`vkbloom.Frames.save` writes every framebuffer with the settings and the device into one file.
`vkbloom.Frames.load` returns them, so that a figure can be traced back to the numbers that made it.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom

image = np.full((90, 160, 3), 0.05, np.float32)
image[40:50, 70:90] = (8, 4, 1)
frames = vkbloom.apply(image, vkbloom.KinoBloom(threshold=0.9, intensity=0.7))
frames.save("session.exr")

later = vkbloom.Frames.load("session.exr")
assert later.settings == frames.settings
assert all(np.array_equal(later[name], frames[name]) for name in frames)
print(later.info["adapter"], later.settings.to_json(), sep="\n")
again = vkbloom.apply(image, vkbloom.Settings.from_json(later.settings.to_json()))

figure, places = plt.subplots(1, 3, figsize=(9, 2), layout="constrained")
pictures = {"glow": later["glow"], "final": later["final"], "made again": again["final"]}
for axes, (name, picture) in zip(places, pictures.items(), strict=True):
    axes.imshow((picture[..., :3] / 2).clip(0, 1) ** (1 / 2.2))
    axes.set_title(name)
    axes.axis("off")
plt.show()
