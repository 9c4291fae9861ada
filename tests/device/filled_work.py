"""All passes over memory of two contents, whose results must be the same; prints those that differ.

Argument: the name of the adapter. VKBLOOM_FILL is the byte of the layer (filled_memory.c).
"""

from __future__ import annotations

import itertools
import json
import os
import sys
from collections.abc import Iterator
from typing import Any, Final

import numpy as np

import vkbloom
from tests.exhaustive import EXHAUSTIVE
from tests.methods.adjoints import CASES
from tests.variants import VARIANTS, open_variant
from vkbloom import Pyramid, Renderer, Scene, glares
from vkbloom._doctor.cases import METHODS, presets_of_low_levels
from vkbloom._gradients.passes import DeviceGradients

#: NaN in half and single floats; about 12 in single floats, 3 in half floats.
BYTES: Final = ("ff", "41")
#: Of cases one after the other, so that all images are created anew for the next case.
SIZES: Final = ((9, 14), (38, 33), (19, 61), (57, 23))


def settings_by_name() -> dict[str, Any]:
    return {
        **METHODS,
        **presets_of_low_levels(16),
        **{
            f"glare {name}": Pyramid(levels=2, threshold=0.5, glare=stages)
            for name, stages in glares.items()
        },
        **{f"adjoint {name}": settings for name, settings in CASES.items() if name != "high"},
    }


def make(renderer: Renderer, settings: Any, size: tuple[int, int]) -> Iterator[tuple[str, Any]]:
    """Yield framebuffers, those of fused passes, and derivatives by image, mask and emission."""
    image = np.zeros((*size, 4 if settings.alpha != "keep" else 3), np.float32)
    image[2:5, 3:6] = (4.0, 2.0, 0.5, 1.0)[: image.shape[2]]
    mask = np.ones(size, np.float32)
    frames = renderer.apply(image, settings)
    yield from frames.items()
    fused = renderer.apply(image, settings.replace(exposure=0.25), framebuffers=("final",))
    yield "fused", fused["final"]
    # Also where everything is read that a source can have.
    both = {"mask": mask, "emission": image[::-1].copy()}
    arrays: tuple[dict[str, Any], ...] = ({}, both)
    for given in arrays:
        final, pullback = vkbloom.vjp(image, settings, renderer=renderer, **given)
        derivatives = pullback({"final": np.ones_like(final["final"])})
        if isinstance(derivatives, DeviceGradients):
            for name in ("image", *given):
                yield f"by {name}, {len(given)} given", derivatives[name]


def draw(renderer: Renderer) -> Iterator[tuple[str, Any]]:
    for shading in ("forward", "deferred"):
        frames = renderer.render(Scene.ufo(), Pyramid(levels=2), (33, 21), shading=shading)
        yield from frames.items()


def results(renderer: Renderer, turn: int) -> dict[tuple[str, str], Any]:
    """Return those of every third case, or in a usual run of every twelfth, and of scenes."""
    named, found = settings_by_name(), {}
    step = len(VARIANTS) if EXHAUSTIVE else 4 * len(VARIANTS)
    for name, size in zip([*named][turn::step], itertools.cycle(SIZES)):
        for what, pixels in make(renderer, named[name], size):
            found[name, what] = np.array(pixels)
    return found | {("scene", name): np.array(pixels) for name, pixels in draw(renderer)}


def main() -> None:
    wrong, count = [], 0
    for turn, variant in enumerate(VARIANTS):
        with open_variant(variant, sys.argv[1], validation=False) as renderer:
            os.environ["VKBLOOM_FILL"] = BYTES[0]
            first = results(renderer, turn)
            os.environ["VKBLOOM_FILL"] = BYTES[1]
            second = results(renderer, turn)
        for key, pixels in first.items():
            count += 1
            if not (np.isfinite(pixels).all() and np.array_equal(pixels, second[key])):
                wrong.append(f"{variant}: {' '.join(key)}")
    print(json.dumps({"count": count, "wrong": wrong}))


if __name__ == "__main__":
    main()
