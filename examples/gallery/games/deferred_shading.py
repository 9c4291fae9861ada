"""
A scene and its G-buffer
========================

`vkbloom.render` draws a scene, here the built-in saucer, with forward or deferred shading.
`vkbloom.reference.shade` is the same lighting in NumPy.
"""

import dataclasses

import matplotlib.pyplot as plt
import numpy as np

import vkbloom

camera = vkbloom.Camera(position=(0, 0, -9), fov=50)
scene = dataclasses.replace(vkbloom.Scene.ufo(), camera=camera, glow_intensity=8.0)
settings = vkbloom.presets["deferred"].replace(tonemap="aces", encoding="gamma22")
frames = vkbloom.render(scene, settings, (320, 180), shading="deferred")
names = ["albedo", "normal", "position", "brightness"]
shaded = vkbloom.reference.shade(*(frames[name] for name in names))
print("off by", np.abs(frames["scene"] - shaded).max())

figure, places = plt.subplots(2, 3, figsize=(9, 3.7), layout="constrained")
for axes, name in zip(places.flat, [*names, "bloom", "final"], strict=True):
    picture = frames[name][..., :3].astype(np.float32)
    axes.imshow((picture / max(1, picture.max())).clip(0, 1))
    axes.set_title(name)
    axes.axis("off")
plt.show()
