"""Values beyond the range of a file's numbers: they saturate, and a note says so."""

import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.cli.calls import run
from vkbloom._io.narrowing import MAX_RADIANCE, narrow, narrowing_note

pytest.importorskip("OpenImageIO")

INF, NAN = np.inf, np.nan
HALF = ([1, 65504, 65519, 65520, 1e6, -1e30], [1, 65504, 65504, 65504, 65504, -65504])
HALF_NOTE = "has numbers of 16 bits: values beyond 65504, the largest half float, become 65504 (9)"
HDR_NOTE = "is Radiance HDR: NaN is written as 0, infinity and what is beyond as its largest number"
PNG_NOTE = "has integers: NaN is written as 0, infinity as 1"


@pytest.mark.parametrize(
    ("name", "dtype", "bits", "case"),
    [
        ("a.exr", "float32", 16, (*HALF, HALF_NOTE)),
        ("a.exr", "float64", 16, (*HALF, HALF_NOTE)),
        ("a.exr", "float32", 16, ([INF, -INF, NAN, 2], [INF, -INF, NAN, 2], None)),
        ("a.exr", "float16", None, ([65504, INF], [65504, INF], None)),
        ("a.exr", "float32", 32, ([1e6], [1e6], None)),
        (
            "a.exr",
            "float64",
            None,
            (
                [1e300, 1],
                [3.4028235e38, 1],
                "beyond 3.40282e+38, the largest float, become 3.40282e+38 (3)",
            ),
        ),
        ("a.tif", "float64", 32, ([-1e39, INF], [-3.4028235e38, INF], "become 3.40282e+38 (3)")),
        ("a.hdr", "float32", None, ([INF, 3e38, NAN, 2], [MAX_RADIANCE] * 2 + [0, 2], HDR_NOTE)),
        ("a.hdr", "float64", None, ([1e300, -INF, 2], [MAX_RADIANCE, 0, 2], HDR_NOTE)),
        ("a.hdr", "float16", None, ([INF, 1], [MAX_RADIANCE, 1], HDR_NOTE)),
        ("a.hdr", "float32", None, ([1e38, 65504], [1e38, 65504], None)),
        ("a.hdr", "float32", None, ([-0.3, -1e38, 0.5], [0, 0, 0.5], None)),
        ("a.hdr", "float16", None, ([-0.05, 2, 3], [0, 2, 3], None)),
        ("a.png", "float32", None, ([INF, -INF, NAN, 1], [1, 0, 0, 1], PNG_NOTE)),
        ("a.png", "float64", 16, ([1e300, 5, -1], [1, 1, 0], None)),
    ],
)
def test_write(
    tmp_path: Path,
    name: str,
    dtype: str,
    bits: Any,
    case: tuple[list[float], list[float], str | None],
) -> None:
    values, expected, note = case
    image = np.repeat(np.array(values, dtype)[None, :, None], 3, axis=2)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        vkbloom.write(tmp_path / name, image, bits=bits)
    found = vkbloom.read(tmp_path / name)[0, :, 0]
    # Radiance HDR has 8 bits of mantissa.
    np.testing.assert_allclose(found, expected, rtol=1 / 256 if name == "a.hdr" else 1e-6)
    assert [str(one.message) for one in caught if one.category is not UserWarning] == []
    assert len(caught) == (note is not None)
    if note is not None:
        assert str(caught[0].message).startswith(f"{tmp_path / name} ")
        assert note in str(caught[0].message)
        assert caught[0].filename == __file__


def test_colours_divided_by_a_small_alpha(tmp_path: Path) -> None:
    for dtype, largest in (("float16", 65504), ("float32", np.finfo(np.float32).max)):
        image = np.full((4, 4, 4), largest / 4, dtype)
        image[..., 3] = 1e-3
        vkbloom.write(tmp_path / "a.exr", image, premultiplied=True)
        assert (vkbloom.read(tmp_path / "a.exr")[..., :3] == largest).all()


def test_conversions_that_hold_all_are_left_alone() -> None:
    values = np.array([1, 65504, INF, NAN], np.float16)
    assert narrow(values, np.dtype(np.float16)) is values
    assert narrowing_note(values, np.dtype(np.float32)) is None


@pytest.mark.parametrize("words", [["--half"], ["--bits", "16"], ["--half", "--bits", "16"]])
def test_apply(tmp_path: Path, words: list[str]) -> None:
    source, out = tmp_path / "sun.exr", tmp_path / "b.exr"
    vkbloom.write(source, np.full((16, 16, 3), 1e6, np.float32))
    done = run("apply", source, out, "--method", "pyramid", *words)
    assert done.exit_code == 0
    written = vkbloom.read(out)
    assert written.max() == 65504
    assert np.isfinite(written).all()
    said = r"note: (\S+?):? .*?values beyond 65504, the largest half float, become 65504 \(768\)"
    assert re.findall(said, done.stderr) == [str(source if "--half" in words else out)]
    assert "Warning" not in done.stderr


def test_a_bright_emission(tmp_path: Path) -> None:
    vkbloom.write(tmp_path / "a.exr", np.ones((16, 16, 3), np.float32))
    vkbloom.write(tmp_path / "sun.exr", np.full((16, 16, 3), 1e6, np.float32))
    words = ["--emission", tmp_path / "sun.exr", "--method", "pyramid", "--half"]
    done = run("apply", tmp_path / "a.exr", tmp_path / "b.exr", *words)
    assert done.exit_code == 0
    assert f"{tmp_path / 'sun.exr'}: values beyond 65504" in done.stderr
    assert np.isfinite(vkbloom.read(tmp_path / "b.exr")).all()


def test_apply_to_radiance(tmp_path: Path) -> None:
    image = np.ones((16, 16, 3), np.float32)
    image[8, 8] = INF
    vkbloom.write(tmp_path / "a.exr", image)
    done = run("apply", tmp_path / "a.exr", tmp_path / "b.hdr")
    assert done.exit_code == 0
    assert f"note: {tmp_path / 'b.hdr'} {HDR_NOTE}" in done.stderr
    assert vkbloom.read(tmp_path / "b.hdr").max() > 1e38
