"""The vertical blur against numbers that the original program drew.

original_blur.npz has 48 x 48 pixels of two framebuffers of the original program, a bloom sample in
C++ for Vulkan, at blur_scale 1 and blur_strength 1.5: the glow that its blur read, and the vertical
blur that came of it. They show its Retro UFO, (c) 2016 Sascha Willems, CC BY 3.0
(https://creativecommons.org/licenses/by/3.0/), cut out and otherwise unchanged.

This shows that the vertical blur here is the original's: taps, weights, strength and rounding to 8
bits. It does not show the horizontal blur, the composite or the scene, whose inputs are the
original's meshes; `test_the_originals_frames` compares those where the meshes are.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from vkbloom import Renderer, Separable, reference

#: Rows at the top and bottom that see pixels beyond the cut: as many as a tap reaches.
REACH = 4


@pytest.fixture(scope="module")
def original() -> dict[str, NDArray[Any]]:
    with np.load(Path(__file__).with_name("original_blur.npz")) as arrays:
        return dict(arrays)


SETTINGS = Separable(blur_scale=1.0, blur_strength=1.5)


def test_device_equals_the_original_blur(
    renderer: Renderer, original: dict[str, NDArray[Any]]
) -> None:
    expected = original["blur_vertical"][REACH:-REACH].astype(int)
    assert expected.max() > 200
    frames = renderer.apply(original["glow"], SETTINGS, framebuffers="blur_vertical")
    apart = np.abs(frames["blur_vertical"][REACH:-REACH, :, :3] - expected)
    # Where a value lies between two levels, devices may round it to either.
    assert apart.max() <= 1
    assert (apart == 0).mean() >= 0.99


def test_reference_equals_the_original_blur(original: dict[str, NDArray[Any]]) -> None:
    frames = reference.apply(original["glow"], SETTINGS)
    values = 255 * np.clip(frames["blur_vertical"][REACH:-REACH, :, :3], 0, 1)
    # Half a level for the rounding of the original, and what single precision adds.
    assert np.abs(values - original["blur_vertical"][REACH:-REACH]).max() <= 0.5 + 1e-3
