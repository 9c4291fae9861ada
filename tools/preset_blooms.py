"""Write the blooms of all presets that `vkbloom check` compares a bloom with.

``python -m tools.preset_blooms``, after a preset has changed.
"""

from __future__ import annotations

import numpy as np

import vkbloom
from vkbloom._cli.check.measuring import PRESET_BLOOMS, sketch
from vkbloom.testing._blooms import bloom_of, exact


def main() -> None:
    """Render the presets with software, and write what `nearest_preset` reads."""
    with vkbloom.Renderer("software") as renderer:
        blooms = {
            name: sketch(bloom_of(renderer, exact(settings), "bloom")).astype(np.float16)
            for name, settings in vkbloom.presets.items()
        }
    np.savez_compressed(PRESET_BLOOMS, **blooms)


if __name__ == "__main__":
    main()
