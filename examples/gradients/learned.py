"""Learn the intensity of a bloom in PyTorch, from an image and its picture.

python examples/gradients/learned.py learned.png
"""

from __future__ import annotations

import sys

import torch

import vkbloom
import vkbloom.torch

STEPS = 60
TRUTH = 0.35


def main(path: str) -> None:
    """Write the picture at the start, at the end, and the true one side by side."""
    image = torch.rand(48, 64, 3, generator=torch.Generator().manual_seed(1)) ** 400 * 8
    start = vkbloom.Pyramid(levels=3, intensity=0.05)
    target = vkbloom.torch.bloom(image, start.replace(intensity=TRUTH))
    module = vkbloom.torch.Bloom(start, learn=("intensity",))
    optimizer = torch.optim.Adam(module.parameters(), lr=0.02)
    pictures = [module(image).detach()]
    for _ in range(STEPS):
        optimizer.zero_grad()
        loss = (module(image) - target).square().mean()
        loss.backward()
        optimizer.step()
    print(f"intensity: {module.settings.intensity:.3f}, the true one is {TRUTH}")
    pictures += [module(image).detach(), target]
    shown = torch.cat(pictures, dim=1).clamp(0, 1).numpy()
    vkbloom.write(path, shown.repeat(4, axis=0).repeat(4, axis=1))


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "learned.png")
