"""Frames that further engines' own shaders drew, where ../shared/data/blooms is."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.methods.test_engines import every
from vkbloom import (
    BabylonBloom,
    DarktableBloom,
    Halation,
    PlayCanvasBloom,
    PmndrsBloom,
    PostProcessingBloom,
    Renderer,
    Settings,
    ThreeBloom,
    UnrealBloom,
    UrpBloom,
    reference,
)

Array = NDArray[Any]
#: Of the largest value of the frame. Engines draw in single floats with samplers of 8 bits.
LIMIT = 1e-3
#: Of each frame the settings, and the factor between the frame and ``bloom``.
FRAMES: dict[str, tuple[Settings, float]] = {
    "urp17/6_odd_kawase_f4": (UrpBloom(filter="kawase"), 1.0),
    "urp17/11_wide_dual_f4": (UrpBloom(filter="dual", scatter=0.2, iterations=8), 1.0),
    "pmndrs/0_odd_f4": (PmndrsBloom(), 1.0),
    "pmndrs/10_wide257_final_f4": (PmndrsBloom(intensity=2.5, radius=0.6, levels=6), 1.0),
    "three_r187/0_odd_f4": (ThreeBloom(variant="r187"), 3.0),
    "three_r187/6_even_f4": (
        ThreeBloom(
            variant="r187",
            radius=0.25,
            threshold=0.2,
            tints=((0.1, 0.2, 0.3), (0.9, 0.5, 0.4), (1, 1, 1), (0.3, 1, 0.7), (0, 0.6, 1)),
        ),
        3.0,
    ),
    "bloom_node/0_odd_f4": (ThreeBloom(variant="node"), 1.0),
    "bloom_node/3_wide_f4": (ThreeBloom(variant="node", radius=0.4, threshold=0.85), 1.5),
    "ppv2/0_odd_f4": (PostProcessingBloom(), 2**0.1 - 1),
    "ppv2/9_even_f4": (
        PostProcessingBloom(
            fast=True, anamorphic_ratio=0.45, threshold=0.2, knee=1.0, diffusion=9.0
        ),
        2**0.1 - 1,
    ),
    "agx_halation/0_odd_final_f4": (Halation(pixel_size=20.0), 1.0),
    "agx_halation/2_even_final_f4": (
        Halation(pixel_size=8.0, strength=(0.03, 0.003, 0.001)),
        1.0,
    ),
    "darktable/0_odd_final_f4": (DarktableBloom(), 1.0),
    "darktable/5_wide_final_f4": (DarktableBloom(blur_size=5.0), 1.0),
    "unreal_standard/0_odd_f4": (UnrealBloom(), 0.675),
    "unreal_standard/1_wide_f4": (UnrealBloom(), 0.675),
    "babylon/0_odd_f4": (BabylonBloom(), 1.0),
    "babylon/3_even_f4": (BabylonBloom(threshold=0.3, kernel=20.0), 1.0),
    "playcanvas/0_odd_f4": (PlayCanvasBloom(), 1.0),
    "playcanvas/11_wide_f4": (PlayCanvasBloom(blur_level=3, threshold=4.0), 1.0),
}


@pytest.fixture(scope="session")
def folder(shared_data: Path) -> Path:
    folder = shared_data / "blooms"
    if not folder.is_dir():
        pytest.skip("the frames of further engines (../shared/data/blooms) are not here")
    return folder


def read_case(folder: Path, key: str) -> tuple[Array, Array, dict[str, Any]]:
    engine, case = key.split("/")
    cases = json.loads((folder / "settings.json").read_text())[engine]["cases"]
    (found,) = (one for one in cases if one["key"] == case)
    with np.load(folder.parent / "engines" / "inputs.npz") as images:
        image = images[found["image"]][..., :3]
    if "crop" in found:
        image = image[: found["crop"][0], : found["crop"][1]]
    with np.load(folder / "frames.npz") as frames:
        return np.ascontiguousarray(image), frames[key][..., :3], found


def test_no_frame_is_left_out(folder: Path) -> None:
    with np.load(folder / "frames.npz") as frames:
        assert set(frames) == set(FRAMES)


@pytest.mark.parametrize("key", FRAMES)
def test_a_bloom_is_its_engines(renderer: Renderer, folder: Path, key: str) -> None:
    image, frame, case = read_case(folder, key)
    settings, factor = FRAMES[key]
    settings = settings.replace(format="rgba32float")
    name = "final" if case["frame"] == "final" else "bloom"
    for frames in (
        reference.apply(image.astype(np.float64), settings),
        renderer.apply(image.astype(np.float32), settings),
    ):
        found = factor * every(frames[name], case["stride"])
        assert np.abs(found - frame).max() < LIMIT * np.abs(frame).max()
