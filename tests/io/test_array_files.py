"""`vkbloom.read` and `vkbloom.write`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.io.parts import reread, store_parts, write
from tests.io.profiles import (
    DISPLAY_P3,
    REC_709,
    curv,
    gamma_chunk,
    para,
    png_chunk,
    profile,
    profile_chunk,
    store_png,
    to_xyz,
)
from tests.srgb import decode_srgb

oiio = pytest.importorskip("OpenImageIO")

RNG = np.random.default_rng(5)
# OpenColorIO's own accuracy, of values of 0..1.
CLOSE: dict[str, Any] = {"rtol": 1e-3, "atol": 2e-4}
# The table of a profile's curve.
LISTED = np.rint(np.linspace(0, 1, 1024) ** 2.4 * 65535).astype(int)


def levels(*shape: int, dtype: str = "uint8") -> NDArray[Any]:
    return RNG.integers(0, np.iinfo(dtype).max + 1, shape, dtype=dtype)


def store_exr(path: Path, **channels: NDArray[Any]) -> Path:
    """Write channels by name, "__" standing for a dot; a float channel makes only itself float."""
    first = next(iter(channels.values()))
    halves_only = all(part.dtype == np.float16 for part in channels.values())
    numbers = "half" if halves_only else "float"
    spec = oiio.ImageSpec(first.shape[1], first.shape[0], len(channels), numbers)
    spec.channelnames = tuple(name.replace("__", ".") for name in channels)
    spec.channelformats = tuple(
        oiio.TypeDesc("half" if part.dtype == np.float16 else "float") for part in channels.values()
    )
    return write(path, spec, np.stack([*channels.values()], -1).astype(np.float32))


def halves(layer: str, names: str = "RGBA", size: tuple[int, int] = (3, 5)) -> dict[str, Any]:
    return {f"{layer}__{name}": RNG.random(size).astype(np.float16) for name in names}


class TestRead:
    @pytest.mark.parametrize("dtype", ["uint8", "uint16"])
    @pytest.mark.parametrize("channels", [1, 2, 3, 4])
    def test_png(self, tmp_path: Path, dtype: str, channels: int) -> None:
        pixels = levels(5, 7, channels, dtype=dtype)
        made = vkbloom.read(store_png(tmp_path / "a.png", pixels))
        plain = pixels / np.iinfo(dtype).max
        assert made.dtype == np.float32
        assert made.shape == (5, 7, 3 if channels in (1, 3) else 4)
        colours = plain[:, :, : channels - (channels in (2, 4))]
        assert np.allclose(made[:, :, :3], decode_srgb(colours), rtol=1e-6, atol=0)
        if channels in (2, 4):
            assert np.allclose(made[:, :, 3], plain[:, :, -1], rtol=1e-6, atol=0)

    @pytest.mark.parametrize("dtype", ["uint8", "uint16"])
    @pytest.mark.parametrize("gamma", [1 / 2.2, 0.8, 1.0, 1.25, 1.8, 2.0, 2.2, 2.6, 5.0])
    def test_gamma(self, tmp_path: Path, gamma: float, dtype: str) -> None:
        pixels = levels(5, 7, 4, dtype=dtype)
        path = store_png(tmp_path / "a.png", pixels, gamma_chunk(gamma))
        made, facts = vkbloom.read(path, metadata=True)
        plain = pixels / np.iinfo(dtype).max
        stated = 1e5 / round(1e5 / gamma)
        assert np.allclose(made[..., :3], plain[..., :3] ** stated, rtol=1e-6, atol=0)
        assert np.allclose(made[..., 3], plain[..., 3], rtol=1e-6, atol=0)
        assert bool(facts["notes"]) is (gamma != 1)

    @pytest.mark.parametrize(
        ("chunks", "is_srgb"),
        [
            (gamma_chunk(2.0) + png_chunk(b"sRGB", b"\0"), True),
            (png_chunk(b"sRGB", b"\0") + gamma_chunk(2.0), True),
            (gamma_chunk(2.0) + gamma_chunk(1.0), False),
            (png_chunk(b"gAMA", bytes(4)), True),
            (png_chunk(b"gAMA", b"\xff" * 4), True),
            (gamma_chunk(2.0)[:-1] + b"x", True),
            (profile_chunk(b"no profile") + gamma_chunk(2.0), False),
            (gamma_chunk(2.0) + profile_chunk(profile("my screen", REC_709)), True),
            (gamma_chunk(2.0) + png_chunk(b"cICP", bytes([1, 13, 0, 1])), True),
        ],
    )
    def test_precedence_of_gamma(self, tmp_path: Path, chunks: bytes, is_srgb: bool) -> None:
        pixels = levels(5, 7, 3)
        made = vkbloom.read(store_png(tmp_path / "a.png", pixels, chunks))
        plain = pixels / 255
        expected = decode_srgb(plain) if is_srgb else plain**2
        assert np.allclose(made, expected, rtol=1e-6, atol=0)

    @pytest.mark.parametrize("dtype", ["uint8", "uint16"])
    def test_display_p3(self, tmp_path: Path, dtype: str) -> None:
        pixels = levels(6, 7, 3, dtype=dtype)
        # Outside of Rec. 709.
        pixels[0, 0] = (0, np.iinfo(dtype).max, 0)
        chunk = profile_chunk(profile("Display P3", DISPLAY_P3))
        made, facts = vkbloom.read(store_png(tmp_path / "a.png", pixels, chunk), metadata=True)
        matrix = np.linalg.inv(to_xyz(REC_709)) @ to_xyz(DISPLAY_P3)
        expected = decode_srgb(pixels / np.iinfo(dtype).max) @ matrix.T
        assert expected.min() < -0.2
        assert np.allclose(made, expected, **CLOSE)
        assert facts["colour"] == "Display P3"
        assert facts["notes"] == ("converted to linear Rec. 709 by its ICC profile 'Display P3'",)
        assert "ICCProfile" not in facts

    @pytest.mark.parametrize("dtype", ["uint8", "uint16"])
    @pytest.mark.parametrize(
        ("curve", "expected"),
        [
            (curv(), lambda x: x),
            (curv(256), lambda x: x),
            (curv(563), lambda x: x ** (563 / 256)),
            (curv(0, 65535), lambda x: x),
            (curv(0, 9000, 65535), lambda x: np.interp(x, (0, 0.5, 1), (0, 9000 / 65535, 1))),
            (curv(*LISTED), lambda x: np.interp(x, np.linspace(0, 1, 1024), LISTED / 65535)),
            (para(0, 2.5), lambda x: x**2.5),
            (para(1, 2, 1.25, -0.25), lambda x: np.where(x < 0.2, 0, (1.25 * x - 0.25) ** 2)),
            (
                para(2, 2, 1.25, -0.25, 0.125),
                lambda x: np.minimum(np.where(x < 0.2, 0, (1.25 * x - 0.25) ** 2) + 0.125, 1),
            ),
            (
                para(3, 3, 0.875, 0.125, 0.25, 0.5),
                lambda x: np.where(x < 0.5, x / 4, (0.875 * x + 0.125) ** 3),
            ),
            (
                para(4, 3, 0.75, 0.125, 0.5, 0.25, 0.25, 0.0625),
                lambda x: np.where(x < 0.25, x / 2 + 0.0625, (0.75 * x + 0.125) ** 3 + 0.25),
            ),
        ],
    )
    def test_curves_of_profiles(
        self, tmp_path: Path, curve: bytes, expected: Any, dtype: str
    ) -> None:
        pixels = levels(6, 7, 3, dtype=dtype)
        chunk = profile_chunk(profile("x", REC_709, curve=curve))
        made = vkbloom.read(store_png(tmp_path / "a.png", pixels, chunk))
        # Profiles have 16 fractional bits.
        assert np.allclose(made, expected(pixels / np.iinfo(dtype).max), rtol=1e-4, atol=1e-4)

    def test_curves_differ_between_channels(self, tmp_path: Path) -> None:
        pixels = levels(6, 7, 3)
        content = profile("x", REC_709, curve=curv()).replace(b"bTRC", b"tmpC")
        content = content.replace(b"rTRC", b"bTRC").replace(b"tmpC", b"rTRC")
        assert np.allclose(
            vkbloom.read(store_png(tmp_path / "a.png", pixels, profile_chunk(content))),
            pixels / 255,
            **CLOSE,
        )

    def test_srgb_profile_changes_nothing(self, tmp_path: Path) -> None:
        cms = pytest.importorskip("PIL.ImageCms")
        pixels = levels(6, 7, 3)
        plain = vkbloom.read(store_png(tmp_path / "a.png", pixels))
        for made in (
            cms.ImageCmsProfile(cms.createProfile("sRGB")).tobytes(),
            profile("my screen", REC_709),
        ):
            path = store_png(tmp_path / "b.png", pixels, profile_chunk(made))
            array, facts = vkbloom.read(path, metadata=True)
            assert np.array_equal(array, plain)
            assert (facts["colour"], facts["notes"]) == ("srgb", ())
            assert facts["ICCProfile"] == made

    @pytest.mark.parametrize("space", ["", "LAB"])
    def test_profiles_that_cannot_be_used_are_told(self, tmp_path: Path, space: str) -> None:
        image, cms = map(pytest.importorskip, ("PIL.Image", "PIL.ImageCms"))
        content = b"no profile" * 20
        if space:
            content = cms.ImageCmsProfile(cms.createProfile(space)).tobytes()
        path, pixels = tmp_path / "a.tif", levels(8, 8)
        image.fromarray(pixels).save(path, icc_profile=content)
        made, facts = vkbloom.read(path, metadata=True)
        assert np.allclose(made[..., 0], decode_srgb(pixels / 255), rtol=1e-6, atol=0)
        assert facts["notes"][0].endswith("is not one of RGB by a matrix and curves; taken as srgb")

    def test_chromaticities_are_told(self, tmp_path: Path) -> None:
        pixels = RNG.random((5, 7, 3)).astype(np.float16)
        rec_2020 = (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290)
        path = vkbloom.write(tmp_path / "a.exr", pixels, metadata={"chromaticities": rec_2020})
        made, facts = vkbloom.read(path, metadata=True)
        assert np.array_equal(made, pixels)
        assert facts["chromaticities"] == pytest.approx(rec_2020)
        (note,) = facts["notes"]
        assert "chromaticities (red, green, blue, white: 0.708 0.292, 0.17 0.797" in note
        again = vkbloom.write(tmp_path / "b.exr", made, metadata=facts)
        assert vkbloom.read(again, metadata=True)[1] == facts

    def test_no_alpha_is_divided_by_0(self, tmp_path: Path) -> None:
        glow = np.full((2, 2, 4), (3.0, 2.0, 1.0, 0.0), np.float16)
        path = vkbloom.write(tmp_path / "a.exr", glow, premultiplied=True)
        assert np.array_equal(vkbloom.read(path), glow)
        assert np.array_equal(vkbloom.read(path, premultiplied=True), glow)

    def test_a_sole_layer_is_read(self, tmp_path: Path) -> None:
        layer = halves("ViewLayer.Combined", "RGB")
        made = vkbloom.read(store_exr(tmp_path / "a.exr", **layer))
        assert made.dtype == np.float16
        assert np.array_equal(made, np.stack([*layer.values()], -1))

    def test_layers_of_blender(self, tmp_path: Path) -> None:
        layers = {
            "ViewLayer.Combined": halves("ViewLayer.Combined"),
            "ViewLayer.Emit": halves("ViewLayer.Emit", "RGB"),
            "ViewLayer.Depth": {"ViewLayer.Depth__Z": RNG.random((3, 5)).astype(np.float32)},
        }
        channels = {name: part for layer in layers.values() for name, part in layer.items()}
        path = store_exr(tmp_path / "a.exr", **channels)
        with pytest.raises(ValueError, match=r"a\.exr: the layers are .*ViewLayer\.") as caught:
            vkbloom.read(path)
        assert all(name in str(caught.value) for name in layers)
        for name, layer in layers.items():
            made = vkbloom.read(path, layer=name, premultiplied=True)
            expected = np.stack([*layer.values()], -1)
            assert made.dtype == expected.dtype
            assert np.array_equal(made[..., : expected.shape[2]], expected)
        for wrong in ("Combined", ""):
            with pytest.raises(ValueError, match=rf"no layer '{wrong}'; its layers are View"):
                vkbloom.read(path, layer=wrong)

    def test_layers_in_parts(self, tmp_path: Path) -> None:
        path = tmp_path / "a.exr"
        parts = [RNG.random((2, 3, 3)).astype(np.float16) for _ in range(2)]
        store_parts(path, {"one": parts[0], "two": parts[1]})
        assert np.array_equal(vkbloom.read(path, subimage=1), parts[1])
        assert np.array_equal(vkbloom.read(path, layer="two"), parts[1])
        with pytest.raises(ValueError, match="no layer 'one'; its layers are two"):
            vkbloom.read(path, layer="one", subimage=1)
        assert vkbloom.read(path, metadata=True)[1]["parts"] == ("one", "two")


class TestWrite:
    @pytest.mark.parametrize(("bits", "dtype"), [(None, "uint8"), (8, "uint8"), (16, "uint16")])
    def test_floats_become_srgb(self, tmp_path: Path, bits: int | None, dtype: str) -> None:
        pixels = np.array([[[1, -1, 2, 0.5]]], np.float32).repeat(2, 0)
        path = vkbloom.write(tmp_path / "b.png", pixels, bits=bits)
        assert path == tmp_path / "b.png"
        stored = oiio.ImageBuf(str(path)).spec()
        assert str(stored.format) == dtype
        made = vkbloom.read(path)
        assert np.allclose(made[0, 0], [0.5, 0, 1, 0.5], atol=1 / 255)
        assert np.allclose(made[0, 0, 0], decode_srgb(np.rint(np.array(0.735357 * 255)) / 255)) is (
            dtype == "uint8"
        )

    @pytest.mark.parametrize(
        ("name", "encoding", "value"),
        [
            *(("b.png", encoding, 188) for encoding in (None, "srgb")),
            ("b.png", "gamma22", 186),
            *(("b.png", encoding, 128) for encoding in ("linear", "none")),
            *(("b.exr", encoding, 0.5) for encoding in (None, "linear")),
            ("b.exr", "srgb", 0.735357),
            ("b.hdr", None, 0.5),
        ],
    )
    def test_encodings(self, tmp_path: Path, name: str, encoding: Any, value: float) -> None:
        path = vkbloom.write(tmp_path / name, np.full((2, 3, 3), 0.5), encoding=encoding)
        assert np.allclose(reread(path)[1], value, rtol=1e-6, atol=0)
        # And it says so: reading gives the light again.
        if encoding != "none" and (name, encoding) != ("b.exr", "srgb"):
            assert np.allclose(vkbloom.read(path), 0.5, atol=1 / 255)

    @pytest.mark.parametrize("dtype", ["uint8", "uint16"])
    @pytest.mark.parametrize("channels", [0, 1, 2, 3, 4])
    def test_integers_stay(self, tmp_path: Path, dtype: str, channels: int) -> None:
        pixels = levels(*((5, 7, channels) if channels else (5, 7)), dtype=dtype)
        for name in ("b.PNG", "b.tif"):
            _, made = reread(vkbloom.write(tmp_path / name, pixels))
            assert made.dtype == dtype
            assert np.array_equal(made.reshape(pixels.shape), pixels)

    def test_bits_of_floats(self, tmp_path: Path) -> None:
        pixels = (RNG.standard_normal((5, 7, 3)) * 20).astype(np.float32)
        pixels[0, :2, 0] = (np.nan, np.inf)
        single, half = np.float32, np.float16
        for given, bits, dtype in (
            *((single, bits, single) for bits in (None, 32)),
            *((single, 16, half), (half, None, half)),
        ):
            made = vkbloom.read(vkbloom.write(tmp_path / "b.exr", pixels.astype(given), bits=bits))
            assert made.dtype == dtype
            assert np.array_equal(made, pixels.astype(dtype), equal_nan=True)
