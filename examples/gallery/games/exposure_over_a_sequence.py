"""
Exposure over a sequence
========================

From a dark room into the sun: each engine's automatic exposure adapts in its own way.
`vkbloom.sequence` carries the state from frame to frame.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom

dark = np.full((18, 32, 3), 0.02, np.float32)
frames = [dark] * 8 + [64 * dark] * 40
exposures = {
    "fixed": vkbloom.FixedExposure(value=1),
    "keyframed": vkbloom.KeyframedExposure(keys=((0, 3), (1, 0), (4, -3))),
    "Bevy": vkbloom.BevyExposure(),
    "HDRP": vkbloom.HdrpExposure(),
    "Post Processing v2": vkbloom.PostProcessingExposure(),
    "Godot": vkbloom.GodotExposure(),
    "O3DE": vkbloom.O3deExposure(),
    "Granite": vkbloom.GraniteExposure(),
}
print(list(vkbloom.exposures))  # the same by name

figure, axes = plt.subplots(figsize=(9, 3.2), layout="constrained")
settings = vkbloom.Pyramid(levels=2)
for name, exposure in exposures.items():
    made = vkbloom.sequence(frames, settings, fps=8, exposure=exposure, framebuffers="final")
    stops = [frame.exposure for frame in made]
    axes.plot(np.arange(len(frames)) / 8, stops, label=name)
axes.set(xlabel="seconds", ylabel="exposure in stops")
axes.legend(ncols=2)
plt.show()
