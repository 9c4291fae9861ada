"""The presets against frames that the engines' own shaders rendered from the same images.

The frames are beside the repository, in shared/data/engines. Its README states how they were made.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from vkbloom import (
    BevyBloom,
    BlenderGlare,
    FilamentBloom,
    GodotBloom,
    HdrpBloom,
    KinoBloom,
    Renderer,
    Settings,
    ThreeBloom,
    UrpBloom,
    reference,
)
from vkbloom.reference import _bevy as bevy
from vkbloom.reference._image import BlurInput, Storage

Array = NDArray[Any]

# Of each frame the settings that are its engine's, by the frame's key.
ENGINES: dict[str, Settings] = {
    "hdrp/0_odd_f4": HdrpBloom(),
    "hdrp/1_wide_f4": HdrpBloom(),
    "filament/0_odd_f4": FilamentBloom(),
    "filament/5_wide_f4": FilamentBloom(levels=12, resolution=48),
    "godot/0_odd_f4": GodotBloom(),
    "godot/1_wide_f4": GodotBloom(),
    "godot/3_even_f4": GodotBloom(level_weights=(0, 0, 1, 0, 1, 0, 0)),
    "blender/0_odd_f4": BlenderGlare(),
    "blender/2_even_f4": BlenderGlare(threshold=0.0, smoothness=0.0),
    "kino/0_odd_f4": KinoBloom(),
    "urp/0_odd_f4": UrpBloom(version="12"),
    "bevy/0_odd_f4": BevyBloom(),
    "three/0_odd_f4": ThreeBloom(),
}
COARSE = "bevy/0_odd_r11"


class Frame(NamedTuple):
    image: Array
    bloom: Array
    stride: int


def read_frame(folder: Path, key: str, inputs: Path | None = None) -> Frame:
    engine, case = key.split("/")
    cases = json.loads((folder / "settings.json").read_text())[engine]["cases"]
    (found,) = (one for one in cases if one["key"] == case)
    with (
        np.load((inputs or folder) / "inputs.npz") as images,
        np.load(folder / "frames.npz") as frames,
    ):
        return Frame(images[found["image"]], frames[key], found["stride"])


@pytest.fixture(scope="session")
def engine_frames(shared_data: Path) -> Path:
    folder = shared_data / "engines"
    if not folder.is_dir():
        pytest.skip("the frames of the engines (../shared/data/engines) are not here")
    return folder


def every(array: Array, stride: int) -> Array:
    """Every `stride`-th row and column, and the last."""
    rows, columns = (
        np.unique([*range(0, length, stride), length - 1]) for length in array.shape[:2]
    )
    kept: Array = array[np.ix_(rows, columns)][..., :3]
    return kept


def relative(actual: Array, expected: Array) -> NDArray[np.float64]:
    """Differences relative to the values, of those above 1e-3 of the largest one."""
    seen = expected > 1e-3 * expected.max()
    shares: NDArray[np.float64] = np.abs(actual - expected)[seen] / expected[seen]
    return shares


def test_no_frame_is_left_out(engine_frames: Path) -> None:
    with np.load(engine_frames / "frames.npz") as frames:
        assert set(frames) == {*ENGINES, COARSE}


@pytest.mark.parametrize("key", ENGINES)
def test_a_bloom_is_its_engines(renderer: Renderer, engine_frames: Path, key: str) -> None:
    """The engine's rounding is allowed: its filters, and HDRP's half floats within a pass."""
    image, bloom, stride = read_frame(engine_frames, key)
    settings = ENGINES[key].replace(format="rgba32float")
    # three.js multiplies by its strength before the composite.
    expected = bloom / settings.intensity if key.startswith("three") else bloom
    of_reference = reference.apply(image.astype(np.float64), settings)["bloom"]
    of_device = renderer.apply(image.astype(np.float32), settings)["bloom"]
    assert relative(every(of_reference, stride), expected).max() < 1e-3
    assert relative(every(of_device, stride), expected).max() < 1e-3


class Cut(Storage):
    """R11G11B10 as lavapipe stores it: values are truncated, not rounded."""

    def __call__(self, image: Array) -> Array:
        kept = np.maximum(image, 0)
        _, exponent = np.frexp(kept)
        step = np.exp2(np.maximum(exponent - 1, -14) - np.array([6, 6, 5]))
        cut: Array = np.floor(kept / step) * step
        return cut


def test_levels_of_bevy_in_r11g11b10(renderer: Renderer, engine_frames: Path) -> None:
    """Lavapipe drew the frame, and cuts bits off where vkbloom rounds to the nearest.

    With its rounding in the reference half of the values are the engine's to 1e-6 (1.2e-7 was
    measured). The largest difference, 1.9 % of the value, is where single and double floats fall on
    two sides of a step. The device and the reference both round to the nearest, and differ by 3e-8
    in the median and by 0.26 % at most for the same reason.
    """
    image, expected, stride = read_frame(engine_frames, COARSE)
    settings = BevyBloom(format="rg11b10ufloat")
    height, width, _ = image.shape
    source = BlurInput(image.astype(np.float64), (width, height), Cut(0, 65024, "rg11b10"))
    levels = bevy.passes(source, settings)
    cut = relative(every(levels["bloom"], stride), expected)
    assert np.median(cut) < 1e-6
    assert cut.max() < 0.02
    nearest = reference.apply(image.astype(np.float64), settings)["bloom"]
    of_device = renderer.apply(image.astype(np.float32), settings)["bloom"]
    difference = relative(of_device[..., :3], nearest[..., :3])
    assert np.median(difference) < 1e-6
    assert difference.max() < 0.01
    # Cutting bits off in 16 passes darkens the picture by some hundredths: nothing else differs.
    assert 0.02 < np.median(nearest[..., :3] / expected - 1) < 0.08
