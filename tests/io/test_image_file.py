"""The way from a file to its picture."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests import images
from tests.io.parts import store_ultra_hdr
from vkbloom._io.decoding import decode
from vkbloom._io.image_file import ImageFile, read_picture, read_stored
from vkbloom._presets.start import start_file

IMAGE = images.noise(24, 32, 4, dtype="float32", seed=2)
LEVELS = images.noise(24, 32, 4, dtype="uint8", seed=2)
PQ: dict[str, Any] = {"encoding": "pq", "bits": 16}
#: Files, and whether they are photographs.
FILES: dict[str, tuple[Callable[[Path], object], bool]] = {
    "a.jpg": (lambda path: vkbloom.write(path, LEVELS[..., :3]), True),
    "a.png": (lambda path: vkbloom.write(path, LEVELS), True),
    "pq.png": (lambda path: vkbloom.write(path, IMAGE[..., :3], primaries="rec2020", **PQ), False),
    "a.exr": (lambda path: vkbloom.write(path, IMAGE), False),
    "a.hdr": (lambda path: vkbloom.write(path, IMAGE[..., :3]), False),
    "gain_map.jpg": (
        lambda path: store_ultra_hdr(path, np.tile(IMAGE[..., :3], (2, 2, 1)).astype(np.float16)),
        True,
    ),
}


@pytest.fixture(params=FILES)
def file(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    path = tmp_path / str(request.param)
    FILES[path.name][0](path)
    return path


def modules_of_calls(call: Callable[[], object]) -> list[str]:
    """Return the modules of the package in the order of their calls, each stay once."""
    root = f"{Path(vkbloom.__file__).parent}/"
    stays: list[str] = []

    def follow(frame: FrameType, event: str, _: object) -> None:
        name = frame.f_code.co_filename
        module = name.removeprefix(root)
        if event == "call" and module != name and module.startswith(("_io/", "_presets/")):
            stays.extend([module][: stays[-1:] != [module]])

    sys.setprofile(follow)
    try:
        call()
    finally:
        sys.setprofile(None)
    return stays


def test_a_reader_of_the_code_stays_in_few_modules(file: Path) -> None:
    """A path in `vkbloom.apply`, up to its renderer."""

    def begin() -> None:
        picture, start = start_file(file)
        start.develop(picture)

    begin()
    stays = modules_of_calls(begin)
    assert len(stays) <= 15, stays
    assert len(stays) - len({*stays}) <= 4, stays


def test_the_header_says_what_the_picture_is(file: Path) -> None:
    with ImageFile(file) as opened:
        header = opened.header
        stored = opened.stored()
    picture = decode(stored)
    assert header.highlights() is picture.highlights
    assert picture.is_photograph is FILES[file.name][1]
    assert read_stored(file).is_photograph is picture.is_photograph
    assert (header.channels, header.numbers) == (stored.header.channels, stored.header.numbers)
    assert np.array_equal(read_picture(file).pixels, picture.pixels)
    assert np.array_equal(vkbloom.read(file, premultiplied=picture.is_multiplied), picture.pixels)


def test_another_space_than_that_of_an_hdr_file_makes_a_photograph(tmp_path: Path) -> None:
    FILES["pq.png"][0](tmp_path / "pq.png")
    with ImageFile(tmp_path / "pq.png") as opened:
        assert opened.picture("srgb").is_photograph
