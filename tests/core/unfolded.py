"""Compares pipelines whose constants the driver folds with those of the core, bit by bit.

``python -m tests.core.unfolded``, over a core built with VKBLOOM_FAULTS. Prints as JSON how many
arrays were compared, and the names of those that differ.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any, Final

import numpy as np

import vkbloom
from tests.exhaustive import EXHAUSTIVE
from tests.images import random_image
from tests.methods.adjoints import CASES as DERIVATIVES
from tests.methods.test_matrix import CASES as FORWARDS
from tests.variants import VARIANTS, open_variant
from vkbloom import Renderer, Scene, Settings, _core

core: Any = _core  # fold_by_driver is in test builds only
#: What the usual run compares: many kinds of passes, and those that weight groups of taps.
FORWARD: Final = ("pyramid-firefly", "convolution-fixed", "flares", "tutorial", "dual-kawase")
BACKWARD: Final = ("pygfx karis", "firefly", "bevy threshold", "blender streaks 5.2", "godot")
#: The size of an image, and those of cases, by name.
SIZE: Final = (11, 14)
SIZES: Final = {"high": (4000, 2)}


def image_of(name: str, settings: Settings) -> Any:
    channels = 3 if settings.alpha == "keep" else 4
    return random_image(*SIZES.get(name, SIZE), channels=channels, seed=1).astype(np.float32)


def arrays(renderer: Renderer) -> Iterator[tuple[str, Any]]:
    """Yield each result and its name."""
    for name, array in renderer.render(Scene.ufo(), None, (64, 36), time=0.2).items():
        yield f"forward frame: {name}", array
    for name in FORWARDS if EXHAUSTIVE else FORWARD:
        settings = FORWARDS[name][0]
        image = image_of(name, settings)
        # What makes the last framebuffer alone may be a fused pass.
        yield f"{name}: final", renderer.apply(image, settings, framebuffers=("final",))["final"]
        for framebuffer, array in renderer.apply(image[::-1], settings).items():
            yield f"{name}: {framebuffer} of all", array
    for name in DERIVATIVES if EXHAUSTIVE else BACKWARD:
        settings = DERIVATIVES[name]
        frames, pullback = vkbloom.vjp(image_of(name, settings), settings, renderer=renderer)
        yield f"{name}: by the image", pullback({"final": 1 + frames["final"]})["image"]


def main() -> None:
    compared, different = 0, []
    for variant in VARIANTS if EXHAUSTIVE else ("auto",):
        found: list[dict[str, Any]] = []
        for by_driver in (False, True):
            core.fold_by_driver(by_driver)
            with open_variant(variant, "software", validation=by_driver) as renderer:
                found.append(dict(arrays(renderer)))
        compared += len(found[0])
        different += [
            f"{variant}: {name}"
            for name, array in found[0].items()
            if not np.array_equal(array, found[1][name], equal_nan=True)
        ]
    print(json.dumps({"compared": compared, "different": different}))


if __name__ == "__main__":
    main()
