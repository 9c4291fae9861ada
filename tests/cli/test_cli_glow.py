"""``--mask``, ``--emission`` and ``--alpha`` of the command line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import vkbloom
from tests.cli.calls import apply_settings, succeed
from tests.images import picture

pytestmark = pytest.mark.usefixtures("kept_renderers")

PYRAMID = ("--method", "pyramid", "--levels", "2", "--composite", "mix")
SETTINGS = vkbloom.Pyramid(levels=2, composite="mix")


def test_apply_with_a_mask_and_an_emission(tmp_path: Path) -> None:
    image, emission = picture(24, 16, 3), picture(24, 16, 3, seed=1)
    levels = np.arange(16 * 24, dtype=np.uint8).reshape(16, 24)
    source = vkbloom.write(tmp_path / "a.exr", image)
    # 128 is one half: masks are not decoded from sRGB. A file with three equal channels is also
    # grey.
    mask = vkbloom.write(tmp_path / "mask.png", np.repeat(levels[..., None], 3, axis=2))
    glow = vkbloom.write(tmp_path / "glow.exr", emission)
    out = tmp_path / "out.exr"
    succeed("apply", source, out, *PYRAMID, "--mask", mask)
    assert_array_equal(vkbloom.read(out), apply_settings(image, SETTINGS, mask=levels))
    succeed("apply", source, out, *PYRAMID, "--mask", mask, "--emission", glow)
    both = apply_settings(image, SETTINGS, mask=levels, emission=emission)
    assert_array_equal(vkbloom.read(out), both)


def test_apply_to_several_images_with_one_emission(tmp_path: Path) -> None:
    # The files may have different channels and number types.
    images = [picture(24, 16, 4, seed=seed) for seed in (2, 3)]
    emission = picture(24, 16, 3, "float16", seed=4)
    sources = [tmp_path / f"f{i}.exr" for i in range(2)]
    for source, image in zip(sources, images, strict=True):
        vkbloom.write(source, image, premultiplied=True)
    glow = vkbloom.write(tmp_path / "glow.exr", emission)
    succeed("apply", *sources, tmp_path / "out", *PYRAMID, "--alpha", "max", "--emission", glow)
    alike = np.concatenate([emission, np.ones((16, 24, 1))], axis=2).astype(np.float32)
    for source, image in zip(sources, images, strict=True):
        found = vkbloom.read(tmp_path / "out" / source.name, premultiplied=True)
        wanted = apply_settings(image, SETTINGS.replace(alpha="max"), emission=alike)
        assert_array_equal(found, wanted)


def test_straight_colours_are_multiplied_and_divided(tmp_path: Path) -> None:
    levels = picture(24, 16, 4, "uint8")
    levels[:, :12, 3] = 0
    source, out = vkbloom.write(tmp_path / "a.png", levels), tmp_path / "out.png"
    succeed("apply", source, out, *PYRAMID, "--alpha", "blur")
    image = vkbloom.read(source, premultiplied=True)
    final = apply_settings(image, SETTINGS.replace(alpha="blur"))
    vkbloom.write(tmp_path / "own.png", final, premultiplied=True)
    difference = vkbloom.read(out) - vkbloom.read(tmp_path / "own.png")
    assert np.abs(difference).max() <= 0.01
    assert vkbloom.read(out)[:, 11, 3].min() > 0
