"""Files for HDR and wide-gamut displays: what they name, and what readers make of it."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vkbloom
from vkbloom.reference import tone_map

oiio = pytest.importorskip("OpenImageIO")
RAMP = np.geomspace(1e-3, 20, 3 * 64, dtype=np.float32).reshape(1, 64, 3)
SDR = "ACES 2.0 - SDR 100 nits (Rec.709)"
HDR = "ACES 2.0 - HDR 1000 nits (Rec.2020)"


def chunk(file: Path, name: bytes) -> bytes:
    content = file.read_bytes()
    place = content.index(name)
    (size,) = struct.unpack(">I", content[place - 4 : place])
    return content[place + 4 : place + 4 + size]


def stored(file: Path) -> Any:
    return oiio.ImageBuf(str(file)).get_pixels(oiio.FLOAT)


@pytest.mark.parametrize(("encoding", "code"), [("pq", 16), ("hlg", 18)])
@pytest.mark.parametrize(("primaries", "point"), [("rec709", 1), ("rec2020", 9), ("p3", 12)])
def test_png_names_its_colours(
    tmp_path: Path, encoding: Any, code: int, primaries: str, point: int
) -> None:
    file = vkbloom.write(tmp_path / "a.png", RAMP, encoding=encoding, primaries=primaries, bits=16)
    assert chunk(file, b"cICP") == bytes([point, code, 0, 1])
    spec = oiio.ImageInput.open(str(file)).spec()
    assert tuple(spec.getattribute("CICP")) == (point, code, 0, 1)
    if primaries == "rec709":
        light = RAMP.astype(float)
        expected = tone_map._pq(light, 203.0) if encoding == "pq" else tone_map._hlg(light)
        np.testing.assert_allclose(stored(file), expected, atol=0.5 / 1023)


def test_pq_is_read_back_by_opencolorio(tmp_path: Path) -> None:
    """The file's own space, rec2020 with PQ, gives the light that was written."""
    file = vkbloom.write(tmp_path / "a.png", RAMP, encoding="pq", primaries="rec2020", bits=16)
    again = vkbloom.read(file)
    # OpenColorIO's PQ display has 100 cd/m2 for a value of 1.
    np.testing.assert_allclose(again / again[0, -1], RAMP / RAMP[0, -1], rtol=0.02, atol=1e-4)


@pytest.mark.parametrize("primaries", ["rec2020", "p3"])
def test_exr_has_chromaticities(tmp_path: Path, primaries: str) -> None:
    white = np.ones((2, 3, 4), np.float32)
    file = vkbloom.write(tmp_path / "a.exr", white, primaries=primaries)
    spec = oiio.ImageInput.open(str(file)).spec()
    red = {"rec2020": (0.708, 0.292), "p3": (0.68, 0.32)}[primaries]
    np.testing.assert_allclose(spec.getattribute("chromaticities")[:2], red, atol=1e-6)
    # White is the same in all of them; red of Rec. 709 lies inside.
    np.testing.assert_allclose(stored(file), 1, atol=1e-5)
    vkbloom.write(file, white * np.array([1, 0, 0, 1], np.float32), primaries=primaries)
    assert (stored(file)[0, 0, :3] > 0).all()


def test_views(tmp_path: Path) -> None:
    sdr = vkbloom.write(tmp_path / "a.png", RAMP, view=SDR, bits=16)
    hdr = vkbloom.write(tmp_path / "b.png", RAMP, view=f"Rec.2100-PQ - Display/{HDR}", bits=16)
    assert chunk(sdr, b"cICP") == bytes([1, 13, 0, 1])
    assert chunk(hdr, b"cICP") == bytes([9, 16, 0, 1])
    shown = oiio.ImageBufAlgo.ociodisplay(
        oiio.ImageBuf(RAMP), "sRGB - Display", SDR, "lin_rec709_scene", colorconfig="ocio://default"
    )
    expected = np.clip(shown.get_pixels(oiio.FLOAT), 0, 1)
    np.testing.assert_allclose(stored(sdr), expected, atol=1e-4)


def test_what_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "a.png"
    with pytest.raises(ValueError, match="primaries: 'adobe' is not one of rec709, rec2020, p3"):
        vkbloom.write(file, RAMP, primaries="adobe")
    with pytest.raises(ValueError, match="view: 'none' is not a view"):
        vkbloom.write(file, RAMP, view="none")
    with pytest.raises(ValueError, match="leave them out"):
        vkbloom.write(file, RAMP, view=SDR, encoding="pq")
    with pytest.raises(ValueError, match="linear floats"):
        vkbloom.write(file, np.zeros((2, 2, 3), np.uint8), primaries="p3")
    with pytest.raises(ValueError, match="write a file of integers"):
        vkbloom.write(tmp_path / "a.exr", RAMP, view=SDR)
    with pytest.raises(ValueError, match="jpeg cannot name the colours p3 and srgb"):
        vkbloom.write(tmp_path / "a.jpg", RAMP, primaries="p3")
    assert list(tmp_path.iterdir()) == []
