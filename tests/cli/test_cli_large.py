"""``vkbloom apply`` of large and long pictures, and of half floats."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.cli import calls
from tests.io.parts import written
from vkbloom._cli import applied

oiio = pytest.importorskip("OpenImageIO")

pytestmark = pytest.mark.usefixtures("kept_renderers")


run = functools.partial(calls.run, "apply", "--adapter", "software")


def stored(path: Path, height: int, width: int) -> Path:
    values = np.random.default_rng(5).random((height, width, 3)) ** 8
    return written(path, oiio.ImageSpec(width, height, 3, "uint8"), (255 * values).astype("uint8"))


def levels(path: Path) -> Any:
    return np.asarray(oiio.ImageBuf(str(path)).get_pixels(oiio.UINT8), int)


def test_half_floats(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By choice, and for large pictures of 8 bits."""
    path = stored(tmp_path / "a.png", 50, 41)
    made = []
    for limit, words in ((1 << 26, ()), (1 << 26, ("--half",)), (1, ())):
        monkeypatch.setattr(applied, "_HALVED", limit)
        target = tmp_path / "b.exr"
        assert run(path, target, "--exposure", -1, *words).exit_code == 0
        made.append(vkbloom.read(target))
    single, half, large = made
    assert 0 < abs(half.astype(float) - single).max() < 2e-3
    assert np.array_equal(half, large)


@pytest.mark.parametrize("size", [(1, 161), (161, 1)])
def test_pictures_of_any_shape(tmp_path: Path, size: tuple[int, int]) -> None:
    path = stored(tmp_path / "a.png", *size)
    result = run(path, tmp_path / "b.png")
    assert result.exit_code == 0, result.stderr
    assert levels(tmp_path / "b.png").shape == (*size, 3)


@pytest.mark.parametrize("size", [(2, 32768), (32768, 2)])
def test_longer_than_an_image_of_the_device(tmp_path: Path, size: tuple[int, int]) -> None:
    path = stored(tmp_path / "a.png", *size)
    result = run(path, tmp_path / "b.png")
    assert result.exit_code == 2
    assert "is out of this adapter's range, 1 to " in result.stderr
    assert "a side; it must be smaller" in result.stderr
