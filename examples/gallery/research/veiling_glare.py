"""
Veiling glare by the standards
==============================

ISO 9358 measures how much light a lens spreads into a black spot; ISO 18844 does so with a chart.
`vkbloom.testing.flare` measures a picture or a bloom by both.
"""

import matplotlib.pyplot as plt

import vkbloom
from vkbloom import testing


def lens(picture):
    """Spread 4 % of all light over the picture."""
    return 0.96 * picture + 0.04 * picture.mean(axis=(0, 1))


chart = testing.FlareChart(size=(144, 96))
found = testing.flare(lens, standard=["iso18844", "iso9358"], chart=chart)
print(found)

widths = (1, 2, 4, 8)
figure, (left, right) = plt.subplots(1, 2, figsize=(9, 2.8), layout="constrained")
left.imshow(lens(chart.draw("chart")).clip(0, 1) ** (1 / 2.2))
left.set_title("the chart through the lens")
left.axis("off")
indices = []
for sigma in widths:
    blur = vkbloom.Convolution(vkbloom.psf.gaussian(sigma), boundary="edge")
    bloom = lambda image, blur=blur: vkbloom.apply(image, blur)["bloom"][..., :3]  # noqa: E731
    indices.append(testing.veiling_glare_index(bloom, size=(64, 64), patch=8))
right.plot(widths, indices, "o-")
right.set(xlabel="sigma of a Gaussian in pixels", ylabel="veiling glare index in %")
plt.show()
