"""
A bloom of your own
===================

A bloom is a file, or a text, of passes in the syntax of mpv's user shaders. `vkbloom.load_method`
makes a class of settings of it, and `vkbloom.testing.report` tests it against laws.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom
from vkbloom import testing

PASS = """
//!HOOK MAIN
//!BIND {source}
//!SAVE {result}
vec4 hook() {{
    vec4 sum = vec4(0.0);
    for (int i = -9; i <= 9; i++)
        sum += {source}_texOff(vec2({step})) * (10.0 - abs(float(i))) / 100.0;
    return sum;
}}
"""
across = PASS.format(source="GLOW", result="ROWS", step="i, 0")
down = PASS.format(source="ROWS", result="BLOOM", step="0, i")
Triangle = vkbloom.load_method(across + down, name="triangle")

image = np.full((90, 160, 3), 0.05, np.float32)
image[40:44, 40:44] = image[60, 80:130] = 9
frames = vkbloom.apply(image, Triangle(threshold=1))
laws = ["superposition", "gain", "symmetric", "separable", "no_ringing", "round"]
settings = Triangle(format="rgba32float")
print(testing.report(lambda one: vkbloom.apply(one, settings)["bloom"], laws=laws, size=(64, 64)))

figure, places = plt.subplots(1, 3, figsize=(9, 2), layout="constrained")
for axes, name in zip(places, ("rows", "bloom", "final"), strict=True):
    axes.imshow(frames[name][..., :3].clip(0, 1) ** (1 / 2.2))
    axes.set_title(name)
    axes.axis("off")
plt.show()
