"""
Does it flash too much?
=======================

Flashes can trigger seizures. `vkbloom.testing.flash` judges frames by WCAG 2.2, or by Rec. ITU-R
BT.1702. A bloom spreads a flash over more of the picture.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom
from vkbloom import testing


def alarm(number):
    image = np.full((45, 80, 3), 0.02, np.float32)
    if number % 6 < 3:
        image[18:27, 34:46] = 40
    return image


frames = [alarm(number) for number in range(30)]
wide = vkbloom.Pyramid(levels=5, intensity=1.5)
glowing = [one["final"] for one in vkbloom.sequence(frames, wide, fps=24)]
for name, one in (("without bloom", frames), ("with bloom", glowing)):
    print(name, testing.flash(one, 24, degrees=40), sep="\n")
    print(testing.flash(one, 24, standard="bt1702", display=testing.Display(white=200)))
print(testing.FlashRules.iris())  # the same judged by other rules

figure, places = plt.subplots(2, 6, figsize=(9, 2.3), layout="constrained")
for row, one in zip(places, (frames, glowing), strict=True):
    for axes, picture in zip(row, one, strict=False):
        axes.imshow(picture.clip(0, 1))
        axes.axis("off")
plt.show()
