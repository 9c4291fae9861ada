"""
An engine's shader as it is
===========================

A fragment shader of an engine stays unedited. A description says what its CPU code does: textures,
values, sizes.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import vkbloom

Path("glow.frag").write_text("""#version 450
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 result;
layout(binding = 0) uniform sampler2D source;
layout(push_constant) uniform Push { vec2 stride; };
void main() {
    result = vec4(0.0);
    for (int i = -6; i <= 6; ++i)
        result += texture(source, uv + i * stride) * exp(-0.08 * i * i) / 6.15;
}
""")
Path("glow.toml").write_text("""
bloom = "bloom"
settings.spread = { default = 2.0, range = [0.0, 8.0] }
[[passes]]
file = "glow.frag"
output = "rows"
textures.source = "glow"
values.stride = ["spread / width(frame)", 0]
[[passes]]
file = "glow.frag"
output = "bloom"
textures.source = "rows"
values.stride = [0, "spread / height(frame)"]
""")
Glow = vkbloom.load_method("glow.toml")

image = np.full((90, 160, 3), 0.05, np.float32)
image[40:44, 70:90] = (12, 6, 2)
figure, places = plt.subplots(1, 3, figsize=(9, 2), layout="constrained")
for axes, spread in zip(places, (1, 1.5, 2), strict=True):
    frames = vkbloom.apply(image, Glow(spread=spread, threshold=1))
    axes.imshow(frames["final"].clip(0, 1) ** (1 / 2.2))
    axes.set_title(f"spread={spread}")
    axes.axis("off")
plt.show()
