"""The single cause of the difference of two images: planted causes, and pairs that have none."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.cli.calls import run
from tests.exhaustive import EXHAUSTIVE
from tests.srgb import encode_srgb
from vkbloom import Separable, reference, write
from vkbloom.testing import FrameRegression, Tolerances, diagnose
from vkbloom.testing._judging import judge

Image = NDArray[Any]


def picture(channels: int = 3, height: int = 48, width: int = 64) -> Image:
    """Return a smooth picture with details, with values of 0 to 3, and an alpha that varies."""
    generator = np.random.default_rng(7)
    image = generator.random((height, width, 3)) ** 6 * 40
    blurred = reference.blur(image, Separable(blur_strength=1.0))
    image = (blurred * 3 / blurred.max()).astype(np.float32)
    if channels == 4:
        alpha = 0.25 + 0.75 * generator.random((height, width, 1), dtype=np.float32)
        image = np.concatenate([image, alpha], axis=2)
    return image


def shift(image: Image, right: float) -> Image:
    """Move an image to the right by a part of a pixel, with linear interpolation."""
    moved: Image = (1 - right) * image + right * np.roll(image, 1, axis=1)
    return np.asarray(moved, image.dtype)


def with_nan(image: Image) -> Image:
    changed = image.copy()
    changed[3, 5, 1] = np.nan
    changed[4, 5] = np.inf
    return changed


def levels(image: Image) -> Image:
    return np.asarray(np.rint(np.clip(image, 0, 1) * 255), np.uint8)


PLANTED: dict[str, tuple[Callable[[Image], Image], Any, str]] = {
    "equal": (lambda image: image.copy(), None, "equal: all values are the same"),
    "gain": (
        lambda image: image * np.float32(0.97),
        0.97,
        "gain: the second image is the first x 0.97",
    ),
    "shift": (
        lambda image: shift(image, 0.5),
        (0.5, 0.0),
        "shift: the second image is 0.5 px right of the first",
    ),
    "gamma": (
        lambda image: image ** np.float32(1 / 2.2),
        1 / 2.2,
        "gamma: the second image is the first to the power of 0.4545",
    ),
    "channels": (
        lambda image: image[..., ::-1],
        "bgr",
        "channels: the second image has the order bgr",
    ),
    "flip": (lambda image: image[::-1], "y", "flip: top and bottom are swapped"),
    "clamp": (lambda image: np.minimum(image, 1), 1.0, "clamp: the second image is clamped at 1"),
    "nan": (with_nan, 4, "nan: 4 values are NaN or infinite in one image only"),
    "size": (lambda image: image[::2, ::2], (32, 24), "size: 64 x 48 against 32 x 24"),
    "rounding": (
        lambda image: image.astype(np.float16).astype(np.float32),
        "half",
        "rounding: half; the values differ by ",
    ),
    "alpha": (
        lambda image: np.dstack([image[..., :3] * image[..., 3:], image[..., 3:]]),
        "premultiplied",
        "alpha: the second image is multiplied by alpha",
    ),
}


def plant(cause: str) -> tuple[Image, Image]:
    image = picture(4 if cause == "alpha" else 3)
    return image, np.ascontiguousarray(PLANTED[cause][0](image))


class TestPlanted:
    @pytest.mark.parametrize("cause", PLANTED)
    def test_in_python(self, cause: str) -> None:
        found = diagnose(*plant(cause))
        _, value, text = PLANTED[cause]
        assert found.cause == cause
        if isinstance(value, (float, tuple)):
            value = pytest.approx(value, abs=2e-3)
        assert found.value == value
        assert str(found).startswith(text)
        if cause not in ("size", "rounding"):
            assert found.residual < 1e-3

    def test_in_the_plugin(self, tmp_path: Path) -> None:
        expected, actual = plant("gain")
        (verdict,) = judge({"bloom": expected}, {"bloom": actual}, Tolerances(atol=0.0))
        assert verdict.diagnosis is not None
        regression = FrameRegression(
            folder=tmp_path, name="image", update=False, save=None, written=[]
        )
        with pytest.raises(AssertionError) as caught:
            regression.compare(actual, expected)
        assert f"\n  image: cause: {PLANTED['gain'][2]}" in str(caught.value)
        assert f"; residual {verdict.diagnosis.residual:.3g}\n" in str(caught.value)

    @pytest.mark.parametrize("cause", ["gain", "nan", "size"])
    def test_on_the_command_line(self, cause: str, tmp_path: Path) -> None:
        files = [
            write(tmp_path / f"{name}.exr", image.astype(np.float32), premultiplied=True)
            for name, image in zip("ab", plant(cause), strict=True)
        ]
        _, value, text = PLANTED[cause]
        assert f"cause      {text}" in run("compare", *files).output
        stored = json.loads(run("compare", "--json", *files).output)
        assert stored["diagnosis"]["cause"] == cause
        if isinstance(value, float):
            assert stored["diagnosis"]["value"] == pytest.approx(value, rel=1e-3)


class TestFigures:
    @pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
    @pytest.mark.parametrize(
        ("cause", "change"),
        [
            ("gain", lambda image: 0.9 * image),
            ("gamma", lambda image: image**0.8),
            ("gamma", encode_srgb),
            ("shift", lambda image: shift(image, 0.5)),
            ("flip", lambda image: image[:, ::-1]),
            ("clamp", lambda image: np.minimum(image, 0.6)),
        ],
    )
    def test_integers(self, cause: str, change: Callable[[Image], Image], dtype: Any) -> None:
        a = np.clip(picture().astype(np.float64) / 3, 0, 1)
        limit = np.iinfo(dtype).max
        pair = [np.rint(image * limit).astype(dtype) for image in (a, change(a))]
        assert diagnose(*pair).cause == cause

    @pytest.mark.parametrize("shift", [(0.5, 0.5), (-0.5, 0.0), (0.0, 0.25), (7, -3), (2.5, 1)])
    def test_shifts(self, shift: tuple[float, float]) -> None:
        image = picture(height=96, width=128).astype(np.float64)
        moved = image
        for axis, value in ((1, shift[0]), (0, shift[1])):
            whole = int(np.floor(value))
            part = value - whole
            moved = (1 - part) * np.roll(moved, whole, axis) + part * np.roll(
                moved, whole + 1, axis
            )
        found = diagnose(image, moved)
        assert found.cause == "shift"
        assert found.value == pytest.approx(shift, abs=0.02)

    @pytest.mark.parametrize("order", ["linear", "spline", "sinc"])
    @pytest.mark.parametrize("kind", ["noise", "lights"])
    def test_half_a_pixel_by_each_interpolation(self, kind: str, order: str) -> None:
        ndimage = pytest.importorskip("scipy.ndimage")
        image = np.random.default_rng(3).random((48, 64, 3)) if kind == "noise" else picture()
        if order == "sinc":
            spectrum = np.fft.fft(image, axis=1)
            frequency = 2j * np.pi * np.fft.fftfreq(64)[:, np.newaxis]
            moved = np.fft.ifft(spectrum * np.exp(-0.5 * frequency), axis=1).real
        else:
            degree = {"linear": 1, "spline": 3}[order]
            moved = ndimage.shift(image, (0, 0.5, 0), order=degree, mode="nearest")
        found = diagnose(image, moved)
        assert (found.cause, found.value) == ("shift", (0.5, 0.0))
        if order == "linear":
            # Also if the first image is the interpolated one.
            assert diagnose(moved, image).value == (-0.5, 0.0)

    def test_noise_below_the_steps_is_no_rounding(self) -> None:
        a = levels(picture() / 3) / 255
        noise = np.random.default_rng(0).random(a.shape)
        assert diagnose(a, a + 1e-3 * noise).cause is None
        assert diagnose(np.clip(picture() / 3, 0, 1), a).value == "8-bit"

    def test_small_halves(self) -> None:
        """Their steps are larger than the relative tolerance of a cause."""
        a = picture() ** 8 * np.float32(1e-4)
        found = diagnose(a, (a * np.float32(0.97)).astype(np.float16))
        assert (found.cause, found.value) == ("gain", pytest.approx(0.97, abs=1e-3))

    def test_one_level_is_rounding(self) -> None:
        a = levels(picture() / 3)
        b = (a + np.random.default_rng(0).integers(0, 2, a.shape)).clip(0, 255).astype(np.uint8)
        assert (diagnose(a, b).cause, diagnose(a, b).value) == ("rounding", "8-bit")

    def test_floats_against_integers(self) -> None:
        image = picture()
        assert diagnose(image / 3, levels(image / 3)).value == "8-bit"
        found = diagnose(image, levels(image))
        assert (found.cause, found.value) == ("clamp", 1)
        assert diagnose(levels(image), image).text == "clamp: the first image is clamped at 1"

    def test_numbers_of_channels(self) -> None:
        found = diagnose(picture(4), picture(3))
        assert (found.cause, found.value) == ("channels", (4, 3))
        assert str(found) == "channels: 4 against 3"

    def test_alpha_is_kept_by_a_gain(self) -> None:
        a = picture(4)
        b = a.copy()
        b[..., :3] *= np.float32(1.25)
        assert (diagnose(a, b).cause, round(diagnose(a, b).value, 4)) == ("gain", 1.25)
        b[..., 3] *= np.float32(1.25)
        assert diagnose(a, b).cause == "gain"
        b[0, 0, 3] += 0.5
        assert diagnose(a, b).cause is None

    def test_residual_is_what_remains(self) -> None:
        a = picture().astype(np.float64)
        b = a * 0.5 * (1 + 1e-3 * np.sin(np.arange(a.size)).reshape(a.shape))
        found = diagnose(a, b)
        assert found.cause == "gain"
        expected = np.sqrt(np.mean((b - found.value * a) ** 2))
        assert found.residual == pytest.approx(expected, rel=1e-12)


def pairs(seeds: int) -> list[tuple[str, Image, Image]]:
    """Return pairs that no single cause explains, of ten kinds for each seed."""
    found = []
    for seed in range(seeds):
        generator = np.random.default_rng(seed)
        shape = (int(generator.integers(24, 40)), int(generator.integers(24, 40)), 3)
        noise = generator.random(shape) ** 4
        other = generator.random(shape) ** 4
        smooth = reference.blur(noise, Separable(blur_strength=1.0))
        wide = reference.blur(noise, Separable(blur_scale=1.6, blur_strength=1.0))
        edited = smooth.copy()
        edited[5:12, 6:14] *= 0.5
        kinds: dict[str, tuple[Image, Image]] = {
            "noise": (noise, other),
            "other width": (smooth, wide),
            "local edit": (smooth, edited),
            "added noise": (smooth, smooth + 0.05 * other),
            "gain and flip": (smooth, 0.8 * smooth[:, ::-1]),
            "gain and shift": (smooth, 0.7 * np.roll(smooth, 3, 1)),
            "gamma and channels": (noise, noise[..., ::-1] ** 0.6),
            "offset": (smooth, smooth + 0.1),
            "8 bits, noise": (levels(noise), levels(other)),
            "8 bits, other width": (levels(2 * smooth), levels(2 * wide)),
        }
        found += [(f"{kind}, {seed}", *pair) for kind, pair in kinds.items()]
    return found


def test_no_cause_is_named_for_pairs_without_one() -> None:
    given = pairs(20 if EXHAUSTIVE else 5)
    named = {name: str(found) for name, a, b in given if (found := diagnose(a, b)).cause}
    assert named == {}
