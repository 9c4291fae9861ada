"""
Bloom of a photograph
=====================

`vkbloom.read` decodes a photograph to linear light, and expands the highlights that its file has
clipped. A preset adds its bloom. `vkbloom.write` compresses the highlights again, and encodes the
result.
"""

import matplotlib.pyplot as plt
from skimage import data

import vkbloom

vkbloom.write("photo.png", data.rocket()[190:, 150:530])  # in place of a photograph of yours
photo = vkbloom.read("photo.png", expand=4)
final = vkbloom.apply(photo, "mist")["final"]
vkbloom.write("mist.jpg", final, expand=4, quality=90)

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
left.imshow(plt.imread("photo.png"))
left.set_title("the photograph")
right.imshow(plt.imread("mist.jpg"))
right.set_title('with the preset "mist"')
for axes in (left, right):
    axes.axis("off")
plt.show()
