"""Files for HDR and wide-gamut displays: what they name, and what readers make of it."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.cli.calls import run
from vkbloom.reference import _tone_map as tone_map

oiio = pytest.importorskip("OpenImageIO")
pytestmark = pytest.mark.usefixtures("kept_renderers")
RAMP = np.geomspace(1e-3, 20, 3 * 64, dtype=np.float32).reshape(1, 64, 3)
SDR = "ACES 2.0 - SDR 100 nits (Rec.709)"
HDR = "ACES 2.0 - HDR 1000 nits (Rec.2020)"
# Half a code value of 10 bits.
HALF = 0.5 / 1023
BUILT_IN = "ocio://default"
# OpenColorIO's curves. Its PQ has 100 cd/m2 for 1, its HLG three times the scene light of BT.2100.
CURVES = """\
ocio_profile_version: 2.4
roles: {default: lin}
colorspaces:
  - !<ColorSpace> {name: lin}
  - !<ColorSpace>
    name: pq
    from_scene_reference: !<BuiltinTransform> {style: CURVE - LINEAR_to_ST-2084}
  - !<ColorSpace>
    name: hlg
    from_scene_reference: !<BuiltinTransform> {style: CURVE - HLG-OETF}
"""
TO_OPENCOLORIO = {"pq": 2.03, "hlg": 3 * 0.26496}


def chunk(file: Path, name: bytes) -> bytes:
    content = file.read_bytes()
    place = content.index(name)
    (size,) = struct.unpack(">I", content[place - 4 : place])
    return content[place + 4 : place + 4 + size]


def store(file: Path) -> Any:
    return oiio.ImageBuf(str(file)).get_pixels(oiio.FLOAT)


def convert(values: NDArray[Any], source: str, target: str, config: str = BUILT_IN) -> Any:
    made = oiio.ImageBufAlgo.colorconvert(
        oiio.ImageBuf(np.ascontiguousarray(values, np.float32)),
        source,
        target,
        False,
        colorconfig=config,
    )
    assert not made.has_error, made.geterror()
    return made.get_pixels(oiio.FLOAT)


def convert_to_display(values: NDArray[Any], display: str, view: str) -> Any:
    made = oiio.ImageBufAlgo.ociodisplay(
        oiio.ImageBuf(values), display, view, "lin_rec709_scene", "", False, colorconfig=BUILT_IN
    )
    return np.clip(made.get_pixels(oiio.FLOAT), 0, 1)


@pytest.fixture(scope="module")
def curves(tmp_path_factory: pytest.TempPathFactory) -> str:
    file = tmp_path_factory.mktemp("ocio") / "curves.ocio"
    file.write_text(CURVES)
    return str(file)


class TestHdr:
    @pytest.mark.parametrize("curve", ["pq", "hlg"])
    def test_curves_are_opencolorios(self, tmp_path: Path, curves: str, curve: Any) -> None:
        """The reference, what is written, and what a renderer gives."""
        light = RAMP[RAMP < 1 / 0.26496].reshape(1, -1, 3) if curve == "hlg" else RAMP
        expected = convert(light * np.float32(TO_OPENCOLORIO[curve]), "lin", curve, curves)
        formula = tone_map.ENCODINGS[curve](light.astype(float), 203.0)
        np.testing.assert_allclose(formula, expected, atol=2e-5)
        file = vkbloom.write(tmp_path / "a.png", light, encoding=curve, bits=16)
        np.testing.assert_allclose(store(file), expected, atol=4e-5)
        with vkbloom.Renderer("software") as renderer:
            final = renderer.apply(light, vkbloom.Separable(bloom=False, encoding=curve))["final"]
        np.testing.assert_allclose(final, expected, atol=1e-3)

    @pytest.mark.parametrize(("curve", "code"), [("pq", 16), ("hlg", 18), ("srgb", 13)])
    @pytest.mark.parametrize(("primaries", "point"), [("rec709", 1), ("rec2020", 9), ("p3", 12)])
    def test_png_comes_back(
        self, tmp_path: Path, curve: Any, code: int, primaries: str, point: int
    ) -> None:
        """The chunk, as OpenImageIO reads it, and the light, within half a code value."""
        light = np.minimum(RAMP, {"pq": 20, "hlg": 3.7, "srgb": 1}[curve]).astype(np.float32)
        file = vkbloom.write(
            tmp_path / "a.png", light, encoding=curve, primaries=primaries, bits=16
        )
        if (point, code) != (1, 13):
            assert chunk(file, b"cICP") == bytes([point, code, 0, 1])
            spec = oiio.ImageInput.open(str(file)).spec()
            assert tuple(spec.getattribute("CICP")) == (point, code, 0, 1)
            # Nothing else names colours.
            others = (b"sRGB", b"gAMA", b"cHRM", b"iCCP")
            assert not any(name in file.read_bytes() for name in others)
        again, facts = vkbloom.read(file, metadata=True)
        assert facts["notes"] == () or curve in facts["colour"]
        encode = tone_map.ENCODINGS[curve]
        np.testing.assert_allclose(
            encode(again.astype(float), 203.0), encode(light.astype(float), 203.0), atol=HALF
        )

    def test_saved_frames_name_the_encoding(self, tmp_path: Path) -> None:
        settings = vkbloom.Separable(bloom=False, encoding="hlg")
        with vkbloom.Renderer("software") as renderer:
            frames = renderer.apply(np.full((4, 6, 3), 128, np.uint8), settings)
        frames.save(tmp_path)
        assert chunk(tmp_path / "final.png", b"cICP") == bytes([1, 18, 0, 1])
        assert b"sRGB" not in (tmp_path / "final.png").read_bytes()
        assert np.array_equal(vkbloom.Frames.load(tmp_path)["final"], frames["final"])

    def test_highlights_are_not_expanded(self, tmp_path: Path) -> None:
        file = vkbloom.write(tmp_path / "a.png", RAMP, encoding="pq", bits=16)
        assert np.array_equal(vkbloom.read(file, expand=8), vkbloom.read(file))

    def test_primaries_are_opencolorios(self, tmp_path: Path) -> None:
        file = vkbloom.write(tmp_path / "a.exr", RAMP, primaries="rec2020")
        expected = convert(RAMP, "lin_rec709_scene", "lin_rec2020_scene")
        np.testing.assert_allclose(store(file), expected, rtol=1e-5)


@pytest.mark.parametrize("primaries", ["rec2020", "p3"])
def test_exr_has_chromaticities(tmp_path: Path, primaries: str) -> None:
    white = np.ones((2, 3, 4), np.float32)
    file = vkbloom.write(tmp_path / "a.exr", white, primaries=primaries)
    spec = oiio.ImageInput.open(str(file)).spec()
    red = {"rec2020": (0.708, 0.292), "p3": (0.68, 0.32)}[primaries]
    np.testing.assert_allclose(spec.getattribute("chromaticities")[:2], red, atol=1e-6)
    # White is the same in all of them; red of Rec. 709 lies inside.
    np.testing.assert_allclose(store(file), 1, atol=1e-5)
    vkbloom.write(file, white * np.array([1, 0, 0, 1], np.float32), primaries=primaries)
    assert (store(file)[0, 0, :3] > 0).all()


VIEWS = [
    ("sRGB - Display", SDR, (1, 13)),
    ("Gamma 2.2 Rec.709 - Display", SDR, (1, 4)),
    ("Display P3 - Display", "ACES 2.0 - SDR 100 nits (P3 D65)", (12, 13)),
    ("Rec.1886 Rec.709 - Display", SDR, (1, 1)),
    ("Rec.2100-PQ - Display", HDR, (9, 16)),
    ("ST2084-P3-D65 - Display", "ACES 2.0 - HDR 1000 nits (P3 D65)", (12, 16)),
]


@pytest.mark.parametrize(("display", "view", "points"), VIEWS)
def test_views(tmp_path: Path, display: str, view: str, points: tuple[int, int]) -> None:
    file = vkbloom.write(tmp_path / "a.png", RAMP, view=f"{display}/{view}", bits=16)
    assert chunk(file, b"cICP") == bytes([*points, 0, 1])
    np.testing.assert_allclose(store(file), convert_to_display(RAMP, display, view), atol=1e-4)


@pytest.mark.parametrize(
    ("options", "arguments"),
    [
        (("--view", SDR), {"view": SDR}),
        (("--view", f"Rec.2100-PQ - Display/{HDR}"), {"view": f"Rec.2100-PQ - Display/{HDR}"}),
        (("--output-colour", "hlg", "--primaries", "p3"), {"encoding": "hlg", "primaries": "p3"}),
        # Settings with an encoding give a file that names it.
        (("--encoding", "pq"), {"encoding": "pq"}),
    ],
)
def test_the_command_writes_what_python_does(
    tmp_path: Path, options: tuple[str, ...], arguments: dict[str, Any]
) -> None:
    """A view for SDR gives 8 bits, one for HDR 16."""
    given = ("apply", vkbloom.write(tmp_path / "in.exr", RAMP))
    without_bloom = ("--no-bloom", "--method", "separable")
    done = run(*given, tmp_path / "a.png", *without_bloom, *options)
    assert done.exit_code == 0, done.output
    bits = 8 if options[0] == "--encoding" or SDR in options else 16
    made, expected = tmp_path / "a.png", tmp_path / "b.png"
    vkbloom.write(expected, RAMP, bits=bits, **arguments)
    assert oiio.ImageInput.open(str(made)).spec().format == f"uint{bits}"
    np.testing.assert_allclose(store(made), store(expected), atol=1 / (2**bits - 1))
    assert chunk(made, b"cICP") == chunk(expected, b"cICP")
    if options[0] == "--encoding":
        output = run(*given, tmp_path / "c.jpg", *without_bloom, *options).output
        assert "jpeg cannot name the colours rec709 and pq" in output
