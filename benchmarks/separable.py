"""The proof of separability, measured: the same blur as two passes and as one N x N pass.

Both run in turn in one process; the table gives the median seconds on the device of each and their
ratio, beside the ratio of their taps. ``python benchmarks/separable.py [adapter]``.
"""

from __future__ import annotations

import statistics
import sys

import numpy as np

import vkbloom

SIZE = (640, 360)
ROUNDS = 7


def seconds(renderer: vkbloom.Renderer, settings: vkbloom.Separable, seed: int) -> float:
    """Return the device's time for the blur of a new image: the vertical pass and the bloom's."""
    image = np.random.default_rng(seed).random((SIZE[1], SIZE[0], 4), dtype=np.float32)
    timings = renderer.apply(image, settings, attachments=("bloom",)).timings
    return timings.get("blur_vertical", 0.0) + timings["bloom"]


def main(adapter: str) -> None:
    """Print a Markdown table."""
    with vkbloom.Renderer(adapter) as renderer:
        print(f"{renderer.info.summary}, {SIZE[0]} x {SIZE[1]} rgba32float, median of {ROUNDS}\n")
        print("| taps a line | two passes, ms | one pass, ms | ratio | ratio of taps |")
        print("|---|---|---|---|---|")
        for radius in (1, 2, 4, 8, 16):
            two = vkbloom.Separable(weights=vkbloom.gaussian_weights(radius / 2, radius))
            one = two.replace(direct=True)
            # The first round is for the driver, which compiles.
            pairs = [
                (seconds(renderer, two, seed), seconds(renderer, one, seed))
                for seed in range(ROUNDS + 1)
            ][1:]
            medians = [1e3 * statistics.median(column) for column in zip(*pairs, strict=True)]
            taps = 2 * radius + 1
            ratio = statistics.median(direct / separable for separable, direct in pairs)
            times = " | ".join(f"{median:.2f}" for median in medians)
            print(f"| {taps} | {times} | {ratio:.1f} | {taps / 2:.1f} |")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "auto")
