"""
One engine's bloom in another
=============================

`vkbloom.translate` finds the parameters with which another method comes closest, by the point
spreads of lights of several brightnesses.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom

unreal, three = vkbloom.presets["unreal"], vkbloom.presets["threejs_unreal"]
found = vkbloom.translate(unreal, three, size=(128, 72), max_calls=40)
print(found)

light = np.zeros((72, 128, 3), np.float32)
light[34:38, 62:66] = 40
figure, axes = plt.subplots(figsize=(9, 2.8), layout="constrained")
for name, settings in {
    "UnrealBloom": unreal,
    "ThreeBloom as it comes": three,
    "ThreeBloom translated": found.settings,
}.items():
    frames = vkbloom.apply(light, settings)
    axes.semilogy(settings.intensity * frames["bloom"][36, 64:, 0], label=name)
axes.set(xlabel="distance in pixels", ylabel="bloom of a light of 40")
axes.legend()
plt.show()
