"""``vkbloom apply`` of large pictures: the same result in bands of rows as in one piece."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

import vkbloom
from vkbloom.banded import BandedImage
from vkbloom.cli import large
from vkbloom.cli.program import program
from vkbloom.io import rows

oiio = pytest.importorskip("OpenImageIO")


def run(*words: object) -> Result:
    return CliRunner().invoke(program, ["apply", *map(str, words), "--adapter", "software"])


def stored(path: Path, pixels: Any, tile: int = 0) -> Path:
    kind = {"uint8": "uint8", "uint16": "uint16", "float16": "half", "float32": "float"}
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, kind[pixels.dtype.name])
    if channels < 3:
        spec.channelnames = ("Y", "A")[:channels]
    if tile:
        spec.tile_width = spec.tile_height = tile
    writer = oiio.ImageOutput.create(str(path))
    assert writer.open(str(path), spec)
    assert writer.write_image(pixels)
    assert writer.close()
    return path


def light(height: int, width: int, channels: int, dtype: str) -> Any:
    values = np.random.default_rng(5).random((height, width, channels)) ** 8
    if dtype.startswith("uint"):
        return (values * np.iinfo(dtype).max).astype(dtype)
    values = (4 * values).astype(dtype)
    return values


@pytest.fixture
def by_rows(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Read every picture in bands of a few rows; return the number of rows of each band."""
    monkeypatch.setattr(large, "LARGE", 1)
    monkeypatch.setattr(rows, "_BAND_BYTES", 16 * 41 * 7)
    counts: list[int] = []
    final = BandedImage.final

    def counted(self: BandedImage, settings: Any, first: int, count: int) -> Any:
        counts.append(count)
        return final(self, settings, first, count)

    monkeypatch.setattr(BandedImage, "final", counted)
    return counts


@pytest.mark.parametrize(
    "case",
    [
        ("a.png", "b.png", 3, "uint8", 0),
        ("a.png", "b.exr", 4, "uint8", 0),
        ("a.png", "b.jpg", 1, "uint16", 0),
        ("a.png", "b.png", 2, "uint8", 0),
        ("a.exr", "b.exr", 3, "float16", 16),
        ("a.exr", "b.tif", 4, "float32", 0),
    ],
)
@pytest.mark.parametrize("preset", ["bevy_natural", "kino", "jimenez2014", "tutorial"])
def test_the_same_as_a_whole(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    by_rows: list[int],
    preset: str,
    case: tuple[str, str, int, str, int],
) -> None:
    source, target, channels, dtype, tile = case
    monkeypatch.chdir(tmp_path)
    stored(Path(source), light(50, 41, channels, dtype), tile)
    words = (source, "--preset", preset)
    assert run(*words, "-o", target).exit_code == 0
    assert sum(by_rows) == 50
    assert set(by_rows[:-1]) == ({16} if tile else {7})
    monkeypatch.setattr(large, "LARGE", 1 << 40)
    assert run(*words, "-o", f"whole_{target}").exit_code == 0
    assert np.array_equal(vkbloom.read(target), vkbloom.read(f"whole_{target}"))


def test_half_floats_by_choice(tmp_path: Path, by_rows: list[int]) -> None:
    path = stored(tmp_path / "a.png", light(50, 41, 3, "uint8"))
    for word in ("--half", "--no-half"):
        assert run(path, tmp_path / f"{word}.png", word).exit_code == 0
    half, single = (
        np.asarray(oiio.ImageBuf(str(tmp_path / f"{word}.png")).get_pixels(oiio.UINT8), int)
        for word in ("--half", "--no-half")
    )
    assert abs(half - single).max() <= 1
    assert by_rows


def test_special_values_are_told_once(tmp_path: Path, by_rows: list[int]) -> None:
    pixels = light(50, 41, 3, "float32")
    pixels[3, 3, 0] = pixels[40, 3, 0] = np.nan
    pixels[44, 2] = np.inf
    result = run(stored(tmp_path / "a.exr", pixels), tmp_path / "b.exr")
    assert result.exit_code == 0
    assert result.stderr.count("2 NaN and 3 infinite values") == 1
    assert by_rows


def test_turned_pictures_are_taken_as_a_whole(tmp_path: Path, by_rows: list[int]) -> None:
    path = tmp_path / "a.tif"
    spec = oiio.ImageSpec(41, 50, 3, "uint8")
    spec.attribute("Orientation", 6)
    writer = oiio.ImageOutput.create(str(path))
    assert writer.open(str(path), spec)
    assert writer.write_image(light(50, 41, 3, "uint8"))
    assert writer.close()
    assert run(path, tmp_path / "b.png").exit_code == 0
    assert not by_rows
    assert vkbloom.read(tmp_path / "b.png").shape == (41, 50, 3)


@pytest.mark.parametrize("where", ["add", "final"])
@pytest.mark.parametrize("error", [KeyboardInterrupt, vkbloom.DeviceLostError("lost")])
def test_what_ends_it_leaves_no_file(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    by_rows: list[int],
    where: str,
    error: type[BaseException] | BaseException,
) -> None:
    def fail(*_: Any) -> None:
        raise error

    path = stored(tmp_path / "a.png", light(50, 41, 3, "uint8"))
    monkeypatch.setattr(BandedImage, where, fail)
    result = run(path, tmp_path / "b.png")
    assert result.exit_code == (130 if error is KeyboardInterrupt else 1)
    assert [file.name for file in tmp_path.iterdir()] == ["a.png"]


def test_a_damaged_file(tmp_path: Path, by_rows: list[int]) -> None:
    path = stored(tmp_path / "a.png", light(50, 41, 3, "uint8"))
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    result = run(path, tmp_path / "b.png")
    assert result.exit_code == 1
    assert "a.png: damaged" in result.stderr
    assert not (tmp_path / "b.png").exists()
