"""Write the page of stored pictures that the docs show: the explorer without a server.

python -m tools.static_explorer OUT [--quick]

Six presets on four photographs of scikit-image and on the saucer, with three sliders each, and all
framebuffers. --quick: one picture, one preset, and two values for each slider.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, Final

import skimage

import vkbloom
from vkbloom._explorer.stored import StoredGrid, StoredSource, write_stored
from vkbloom._explorer.viewer import Viewer
from vkbloom._io.image_file import read_picture

PHOTOGRAPHS: Final = ("astronaut.png", "rocket.jpg", "coffee.png", "hubble_deep_field.jpg")
#: Photographs hold no light above white: this is what they are expanded up to.
EXPAND: Final = 4.0
SIZE: Final = (480, 320)
QUALITY: Final = 70
MAX_BYTES: Final = 12_000_000
#: The values of three sliders for each preset. They change no size of a framebuffer.
AXES: Final[dict[str, dict[str, list[Any]]]] = {
    "photo": {
        "threshold": [0.5, 1.0, 1.5],
        "low_frequency_boost": [0.3, 0.7],
        "intensity": [0.08, 0.15, 0.3],
    },
    "tutorial": {
        "threshold": [0.5, 1.0],
        "blur_scale": [1.0, 4.0, 8.0],
        "intensity": [0.25, 0.5, 1.0],
    },
    "unity_urp": {
        "threshold": [0.5, 0.79, 1.5],
        "scatter": [0.4, 0.7],
        "intensity": [0.5, 1.0, 2.0],
    },
    "threejs_r187": {
        "threshold": [0.0, 1.0],
        "radius": [0.0, 0.5, 1.0],
        "intensity": [0.3, 1.0, 3.0],
    },
    "unreal": {
        "threshold": [-1.0, 1.0],
        "size_scale": [2.0, 4.0, 8.0],
        "intensity": [0.3, 0.675, 1.5],
    },
    "godot_4_6": {
        "threshold": [0.5, 1.0],
        "glow_bloom": [0.0, 0.1, 0.3],
        "intensity": [0.15, 0.3, 0.6],
    },
}


#: Where the page begins with another value: these presets blur the whole picture, too brightly.
BEGUN: Final[dict[str, dict[str, Any]]] = {
    "tutorial": {"threshold": 1.0},
    "threejs_r187": {"threshold": 1.0, "intensity": 1.0},
}


def sources(renderer: vkbloom.Renderer, *, is_quick: bool) -> list[StoredSource]:
    """Return the photographs and the saucer, each with the grid of each preset."""
    folder = Path(skimage.__file__).parent / "data"
    made = [_source(renderer, folder / name, is_quick=is_quick) for name in PHOTOGRAPHS[:1]]
    if not is_quick:
        made += [_source(renderer, folder / name, is_quick=False) for name in PHOTOGRAPHS[1:]]
        made.insert(0, _source(renderer, None, is_quick=False))
    return made


def _source(renderer: vkbloom.Renderer, file: Path | None, *, is_quick: bool) -> StoredSource:
    if file is None:
        viewer, name = Viewer(renderer=renderer), "saucer"
    else:
        viewer = Viewer(read_picture(file), renderer=renderer, file=file.name, expand=EXPAND)
        name = file.stem.replace("_", " ")
    look = {field: getattr(viewer.settings["a"], field) for field in ("tonemap", "encoding")}
    grids = [
        StoredGrid(
            vkbloom.presets[preset].replace(**look, **BEGUN.get(preset, {})),
            _fewer(axes, is_quick),
            preset,
        )
        for preset, axes in list(AXES.items())[: 1 if is_quick else None]
    ]
    return StoredSource(name, viewer, grids)


def _fewer(axes: dict[str, list[Any]], is_quick: bool) -> dict[str, list[Any]]:
    return {name: values[:2] if is_quick else values for name, values in axes.items()}


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--quick", action="store_true")
    given = parser.parse_args()
    with vkbloom.Renderer() as renderer:
        made = sources(renderer, is_quick=given.quick)
        size = (96, 64) if given.quick else SIZE
        write_stored(given.out, made, size=size, quality=QUALITY, progress=True)
    held = sum(file.stat().st_size for file in given.out.rglob("*"))
    if held > MAX_BYTES:
        raise SystemExit(f"{given.out}: {held} bytes are out of range, up to {MAX_BYTES}")


if __name__ == "__main__":
    main()
