"""Frames of Blender and pygfx as they run, which `make engines ENGINES=--keep` writes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from vkbloom import BlenderGlare, PygfxBloom, Renderer, Settings, reference

Array = NDArray[Any]
with np.load(Path(__file__).with_name("engine_frames.npz")) as _arrays:
    ARRAYS: Final = dict(_arrays)
CASES: Final = [name.removesuffix("/fields") for name in ARRAYS if name.endswith("/fields")]
#: Of the largest value of the engine's frame, which has single floats. 8.5e-6 was measured.
LIMIT: Final = 2e-5
#: Of other devices, which may have less exact functions than the two Mesas of the tests.
DEVICE_LIMIT: Final = 1e-4
#: Levels of 8 bits. pygfx ran on lavapipe, whose conversions to and from sRGB are off by up to a
#: level each.
LEVELS: Final = 2.5


class Case(NamedTuple):
    settings: Settings
    image: Array


def read(name: str) -> Case:
    fields = json.loads(str(ARRAYS[f"{name}/fields"]))
    if "kernel" in fields:
        fields["kernel"] = ARRAYS[f"{name}/kernel"]
    image = ARRAYS[f"{name}/image"]
    if name.startswith("pygfx"):
        return Case(PygfxBloom(**fields), image)
    return Case(BlenderGlare(format="rgba32float", **fields), image)


def levels(light: Array) -> Array:
    """Return the unrounded 8-bit levels of sRGB."""
    light = np.clip(light, 0, 1)
    encoded = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return np.asarray(255 * encoded)


def compare(name: str, settings: Settings, frames: Any, limit: float) -> None:
    outputs = {"glow": frames["glow"], "final": frames["final"]}
    outputs["glare"] = settings.intensity * frames["bloom"].astype(np.float64)
    for key, array in outputs.items():
        expected = ARRAYS.get(f"{name}/{key}")
        if expected is None:
            continue
        if settings.format == "rgba8unorm-srgb":
            difference = np.abs(levels(array[..., :3]) - levels(expected)).max()
            assert difference <= LEVELS, key
        else:
            difference = np.abs(array[..., :3] - expected).max()
            assert difference <= limit * max(np.abs(expected).max(), 1e-6), key


def test_all_types_and_qualities_are_there() -> None:
    settings = [read(name).settings for name in CASES]
    found = {(one.type, one.quality) for one in settings if isinstance(one, BlenderGlare)}
    assert len(found) == 21
    assert sum(name.startswith("blender-5.2") for name in CASES) == 16
    assert sum(name.startswith("pygfx") for name in CASES) == 8


@pytest.mark.parametrize("name", CASES)
def test_reference_and_device_are_the_engine(renderer: Renderer, name: str) -> None:
    settings, image = read(name)
    compare(name, settings, reference.apply(image.astype(np.float64), settings), LIMIT)
    compare(name, settings, renderer.apply(image, settings), DEVICE_LIMIT)


def test_the_fog_glow_of_4_3(renderer: Renderer) -> None:
    """Blender 4.3.0 drew it, with a kernel of 2^6 + 1 pixels; its threshold has no soft part."""
    with np.load(Path(__file__).with_name("fog_glow_4_3.npz")) as arrays:
        image, glare = arrays["image"].astype(np.float32), arrays["glare"]
    settings = BlenderGlare(
        type="fog_glow", version="4.3", size=64 / 70, smoothness=0.0, format="rgba32float"
    )
    for frames in (reference.apply(image, settings), renderer.apply(image, settings)):
        assert np.abs(frames["bloom"][..., :3] - glare).max() < 1e-5 * glare.max()
