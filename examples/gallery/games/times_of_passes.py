"""
Times of the passes
===================

`vkbloom.Frames.timings` has the seconds of each pass by timestamps of the device. A plan lists the
same passes before anything runs.
"""

import matplotlib.pyplot as plt
import numpy as np

import vkbloom

image = np.random.default_rng(0).random((270, 480, 3), np.float32)
settings = vkbloom.BevyBloom(threshold=0.8)
with vkbloom.Renderer("software") as renderer:
    plan = renderer.plan(image, settings)
    timings = [renderer.apply(image + step / 100, settings).timings for step in range(5)]
print([f"{one.name}: {one.variant}" for one in plan.passes])

best = {name: 1000 * min(one[name] for one in timings) for name in timings[0]}
figure, axes = plt.subplots(figsize=(9, 3.6), layout="constrained")
axes.barh(list(best), list(best.values()))
axes.invert_yaxis()
axes.set(xlabel="milliseconds", title=f"{sum(best.values()):.1f} ms of {plan.size}")
plt.show()
