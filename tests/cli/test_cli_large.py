"""``vkbloom apply`` of large pictures: the same result in bands of rows as in one piece."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

import vkbloom
from tests.exhaustive import by_turns
from tests.io.parts import written
from vkbloom._cli import bands, image_files
from vkbloom._cli.bands import BloomByBands
from vkbloom._cli.program import program
from vkbloom._io import rows

oiio = pytest.importorskip("OpenImageIO")

pytestmark = pytest.mark.usefixtures("kept_renderers")


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
    return written(path, spec, pixels)


def light(height: int, width: int, channels: int, dtype: str) -> Any:
    values = np.random.default_rng(5).random((height, width, channels)) ** 8
    if dtype.startswith("uint"):
        return (values * np.iinfo(dtype).max).astype(dtype)
    values = (4 * values).astype(dtype)
    return values


@pytest.fixture
def by_rows(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Read every picture in bands of a few rows; return the number of rows of each band."""
    monkeypatch.setattr(bands, "LARGE", 1)
    monkeypatch.setattr(rows, "_BAND_BYTES", 16 * 41 * 7)
    counts: list[int] = []
    finished = image_files.finished

    def counted(picture: Any, final: Any, settings: Any) -> Any:
        counts.append(len(final))
        return finished(picture, final, settings)

    monkeypatch.setattr(bands, "finished", counted)
    return counts


@pytest.mark.parametrize(
    ("case", "preset"),
    by_turns(
        [
            ("a.png", "b.png", 3, "uint8", 0),
            ("a.png", "b.exr", 4, "uint8", 0),
            ("a.png", "b.jpg", 1, "uint16", 0),
            ("a.png", "b.png", 2, "uint8", 0),
            ("a.exr", "b.exr", 3, "float16", 16),
            ("a.exr", "b.tif", 4, "float32", 0),
        ],
        turns=["bevy_natural", "kino", "jimenez2014", "tutorial"],
    ),
)
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
    monkeypatch.setattr(bands, "LARGE", 1 << 40)
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


def same_as_a_whole(
    monkeypatch: pytest.MonkeyPatch, by_rows: list[int], target: Path, *words: object
) -> Any:
    """Run twice, compare, and return the result."""
    assert run(*words, "-o", target).exit_code == 0
    assert len(by_rows) > 1
    monkeypatch.setattr(bands, "LARGE", 1 << 40)
    by_rows.clear()
    whole = target.with_name(f"whole_{target.name}")
    assert run(*words, "-o", whole).exit_code == 0
    assert not by_rows
    result = vkbloom.read(target)
    assert np.array_equal(result, vkbloom.read(whole))
    return result


@pytest.mark.parametrize("size", [(1, 161), (161, 1), (20000, 3)])
def test_pictures_of_any_shape(tmp_path: Path, size: tuple[int, int]) -> None:
    """Also higher than the images of most devices: these are taken by rows."""
    path = stored(tmp_path / "a.png", light(*size, 3, "uint8"))
    result = run(path, tmp_path / "b.png")
    assert result.exit_code == 0, result.stderr
    assert vkbloom.read(tmp_path / "b.png").shape == (*size, 3)


def test_wider_than_an_image_of_the_device(tmp_path: Path) -> None:
    path = stored(tmp_path / "a.png", light(2, 32768, 3, "uint8"))
    result = run(path, tmp_path / "b.png")
    assert result.exit_code == 1
    assert "1 to 16384 a side; it must be smaller" in result.stderr


@pytest.mark.parametrize("orientation", [3, 6])
def test_turned_pictures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, by_rows: list[int], orientation: int
) -> None:
    path = tmp_path / "a.tif"
    spec = oiio.ImageSpec(41, 50, 3, "uint8")
    spec.attribute("Orientation", orientation)
    written(path, spec, light(50, 41, 3, "uint8"))
    result = same_as_a_whole(monkeypatch, by_rows, tmp_path / "b.png", path)
    assert result.shape == ((41, 50, 3) if orientation == 6 else (50, 41, 3))


@pytest.mark.parametrize(
    ("words", "height"), by_turns([("--half",), (), ("--alpha", "max")], turns=[50, 512])
)
def test_mask_and_emission(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    by_rows: list[int],
    height: int,
    words: tuple[str, ...],
) -> None:
    path = stored(tmp_path / "a.png", light(height, 41, 4, "uint8"))
    mask = stored(tmp_path / "mask.exr", light(height, 41, 1, "uint8") / np.float32(255), 16)
    emission = stored(tmp_path / "emission.png", light(height, 41, 3, "uint16")[::-1].copy())
    if "--half" in words:
        with_half = run(path, "-o", tmp_path / "h.png", "--mask", mask, *words)
        assert with_half.exit_code == 0, with_half.stderr
        return
    given = (path, "--mask", mask, "--emission", emission, *words)
    same_as_a_whole(monkeypatch, by_rows, tmp_path / "b.png", *given)


def test_layers_and_parts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, by_rows: list[int]
) -> None:
    path = tmp_path / "a.exr"
    specs = []
    for name, prefix in (("first", ""), ("second", "glow.")):
        spec = oiio.ImageSpec(41, 50, 3, "half")
        spec.channelnames = tuple(f"{prefix}{one}" for one in "RGB")
        spec.attribute("oiio:subimagename", name)
        specs.append(spec)
    writer = oiio.ImageOutput.create(str(path))
    assert writer.open(str(path), tuple(specs))
    for index in range(2):
        if index:
            assert writer.open(str(path), specs[index], "AppendSubimage")
        assert writer.write_image((1 + index) * light(50, 41, 3, "float16"))
    assert writer.close()
    target = tmp_path / "b.exr"
    second = same_as_a_whole(monkeypatch, by_rows, target, path, "--subimage", 1)
    monkeypatch.setattr(bands, "LARGE", 1)
    layer = same_as_a_whole(monkeypatch, by_rows, target, path, "--layer", "glow")
    assert np.array_equal(second, layer)
    monkeypatch.setattr(bands, "LARGE", 1)
    first = run(path, "-o", target)
    assert "read the first of its parts 0 first, 1 second" in first.stderr
    assert not np.array_equal(vkbloom.read(target), layer)


@pytest.mark.parametrize(
    ("kind", "pixels", "reason"),
    [
        ("mask", light(50, 40, 1, "uint8"), "mask: shape (50, 40) is not the image's, (50, 41)"),
        (
            "emission",
            light(49, 41, 3, "uint8"),
            "emission: shape (49, 41) is not the image's, (50, 41)",
        ),
        ("mask", light(50, 41, 3, "uint8"), "a mask must be grey"),
    ],
)
def test_mask_or_emission_of_another_shape_is_refused(
    tmp_path: Path, by_rows: list[int], kind: str, pixels: Any, reason: str
) -> None:
    path = stored(tmp_path / "a.png", light(50, 41, 3, "uint8"))
    other = stored(tmp_path / "other.png", pixels)
    result = run(path, tmp_path / "b.png", f"--{kind}", other)
    assert result.exit_code == (2 if "shape" in reason else 1)
    assert reason in result.stderr
    assert not (tmp_path / "b.png").exists()
    assert not by_rows


@pytest.mark.parametrize("where", ["reduce", "finals"])
@pytest.mark.parametrize("error", [KeyboardInterrupt, vkbloom.DeviceLostError("lost")])
def test_failure_leaves_no_file(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    by_rows: list[int],
    where: str,
    error: type[BaseException] | BaseException,
) -> None:
    def fail(*_: Any) -> Iterator[Any]:
        raise error
        yield

    path = stored(tmp_path / "a.png", light(512, 41, 3, "uint8"))
    monkeypatch.setattr(BloomByBands, where, fail)
    result = run(path, tmp_path / "b.png")
    assert result.exit_code == (130 if error is KeyboardInterrupt else 1)
    assert [file.name for file in tmp_path.iterdir()] == ["a.png"]
