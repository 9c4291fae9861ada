"""
Every framebuffer
=================

A bloom is a chain of pictures. All of them are NumPy arrays, in the order in which light flows; in
a notebook, a `vkbloom.Frames` shows itself as such a sheet.
"""

import matplotlib.pyplot as plt

import vkbloom

scene = vkbloom.Scene.ufo()
frames = vkbloom.render(scene, "tutorial", size=(320, 180))
print(frames)

figure, places = plt.subplots(2, 4, figsize=(9, 2.8), layout="constrained")
for axes in places.flat:
    axes.axis("off")
for axes, (name, array) in zip(places.flat, frames.items(), strict=False):
    if array.ndim == 2:
        axes.imshow(array, cmap="gray")  # depth
    else:
        axes.imshow(array[..., :3])
    axes.set_title(f"{name}, {array.shape[1]} x {array.shape[0]}", fontsize=9)
plt.show()
