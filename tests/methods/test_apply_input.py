"""The arguments of `apply`: dtypes, strides, sizes, NaN and infinity, repeated images, `out`; and
errors."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from tests.device.abilities import infinities, max_side
from tests.exhaustive import by_turns, some
from tests.framebuffers import assert_same
from tests.images import DTYPES, picture
from tests.methods.cases import COMPOSITES, TONEMAPS
from tests.tolerance import assert_close, assert_matches_reference, tolerance
from vkbloom import DualKawase, Pyramid, Renderer, Separable, Settings, reference

Image = NDArray[Any]

METHODS: dict[str, Settings] = {
    "separable": Separable(),
    "direct": Separable(direct=True),
    "half-size": Separable(bloom_scale=0.5),
    "pyramid": Pyramid(),
    "firefly": Pyramid(firefly_filter=True),
    "dual-kawase": DualKawase(),
}
OFF = Separable(bloom=False)


# --- Strides ---


def _unalign(image: Image) -> Image:
    """Return the image as a field of packed records, which begins at odd addresses."""
    pixel = np.dtype((image.dtype, image.shape[2:]))
    records = np.zeros(image.shape[:2], np.dtype([("id", np.uint8), ("colour", pixel)]))
    records["colour"] = image
    return records["colour"]


def _read_only(image: Image) -> Image:
    view = image.view()
    view.flags.writeable = False
    return view


VIEWS: dict[str, Callable[[Image], Image]] = {
    "transposed": lambda image: image.transpose(1, 0, 2),
    "upside-down": lambda image: image[::-1],
    "reversed": lambda image: image[::-1, ::-1],
    "channels-reversed": lambda image: image[..., ::-1],
    "every-second": lambda image: image[1::2, ::2],
    "every-third-reversed": lambda image: image[::-3, ::-3, ::-1],
    "part": lambda image: image[3:11, 2:14],
    "first-three-channels": lambda image: image[..., :3],
    "last-three-channels": lambda image: image[..., 1:],
    "fortran": np.asfortranarray,
    "channels-first": lambda image: np.ascontiguousarray(image.transpose(2, 0, 1)).transpose(
        1, 2, 0
    ),
    "one-row-repeated": lambda image: np.broadcast_to(image[5], (9, *image.shape[1:])),
    "one-pixel-repeated": lambda image: np.broadcast_to(image[5, 6], (6, 8, image.shape[2])),
    "grey-repeated": lambda image: np.broadcast_to(image[..., :1], (*image.shape[:2], 3)),
    "read-only": _read_only,
    "unaligned": _unalign,
    "big-endian": lambda image: image.astype(image.dtype.newbyteorder(">")),
    "big-endian-reversed": lambda image: image.astype(image.dtype.newbyteorder(">"))[:, ::-1],
}


@pytest.mark.parametrize(("view", "dtype"), by_turns(VIEWS, turns=DTYPES))
def test_any_strides(renderer: Renderer, view: str, dtype: str) -> None:
    image = VIEWS[view](picture(22, 15, 4, dtype))
    before = image.copy()
    plain = np.array(image, dtype=dtype, order="C")
    frames = renderer.apply(image, Separable())
    # The device sees no difference between a view and a copy, to the byte.
    repeated = renderer.apply(plain, Separable())
    assert repeated.timings == {}
    assert_same(frames, repeated)
    assert_matches_reference(frames, plain, Separable())
    assert_array_equal(image, before)


# --- Repeated images ---


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("channels", [3, 4])
def test_image_changed_in_place(renderer: Renderer, dtype: str, channels: int) -> None:
    image = picture(31, 20, channels, dtype, seed=2)
    renderer.apply(image, Pyramid())
    # One component of one pixel, the last that a copy reaches.
    image[-1, -1, -1] = 77 if dtype == "uint8" else 7.5
    frames = renderer.apply(image, Pyramid())
    assert "composite" in frames.timings or "final" in frames.timings
    assert_matches_reference(frames, image, Pyramid())


def test_images_of_all_kinds_by_turns(renderer: Renderer) -> None:
    """Data of one image must not appear in the next one."""
    images = [
        picture(18, 12, 3, "float32"),
        picture(18, 12, 4, "float32"),
        picture(12, 18, 3, "float32"),
        # As many bytes as the one before.
        picture(24, 18, 3, "float16"),
        picture(24, 18, 4, "uint8"),
        picture(1, 1, 3, "uint8"),
        picture(18, 12, 3, "float32", seed=1),
    ]
    for image in [*images, *images[::-1], *images[::2], *images[::3]]:
        for settings in (Separable(), DualKawase(levels=2)):
            assert_matches_reference(renderer.apply(image, settings), image, settings)


# --- NaN and infinity ---


def with_specials(
    renderer: Renderer, dtype: str, channels: int, size: tuple[int, int] = (23, 17)
) -> Image:
    width, height = size
    image = picture(width, height, channels, dtype, seed=5)
    inf, negative = infinities(renderer, dtype)
    image[0, 0, 0] = np.nan
    image[-1, -1] = negative
    image[5, 5] = inf
    image[5, 6] = np.nan
    image[9, 3, 2] = inf
    image[9, 4, 1] = negative
    return image


@pytest.mark.parametrize(
    ("tonemap", "encoding", "other"),
    by_turns(
        TONEMAPS,
        ["none", "gamma22", "srgb"],
        turns=itertools.product(["float16", "float32"], COMPOSITES),
    ),
)
def test_nan_and_infinity_stay_in_final(
    renderer: Renderer, tonemap: Any, encoding: Any, other: tuple[str, Any]
) -> None:
    dtype, composite = other
    image = with_specials(renderer, dtype, 3)
    settings = Separable(
        composite=composite, tonemap=tonemap, encoding=encoding, exposure=1.0, intensity=0.5
    )
    frames = renderer.apply(image, settings, framebuffers=("bloom", "final"))
    special = ~np.isfinite(image)
    assert_array_equal(frames["final"][special], image[special])
    # The pixel's other channels, too: to the curves that mix them, these count as 0.
    expected = reference.composite(image, frames["bloom"], settings)
    assert_close("final", frames["final"], expected, tolerance(dtype, expected))


@pytest.mark.parametrize("dtype", ["float16", "float32"])
def test_special_counts_follow_the_image(renderer: Renderer, dtype: str) -> None:
    special = with_specials(renderer, dtype, 3)
    counts = (int(np.isnan(special).sum()), int(np.isinf(special).sum()))
    plain = picture(23, 17, 3, dtype)
    for image, expected in [(special, counts), (special, counts), (plain, (0, 0))] * 2:
        info = renderer.apply(image, Separable()).info
        assert (info["nan"], info["inf"]) == expected
    image = picture(23, 17, 3, "uint8")
    assert (
        renderer.apply(image, Separable()).info["nan"]
        == renderer.apply(image, Separable()).info["inf"]
        == 0
    )


# --- Identity and alpha ---


@pytest.mark.parametrize(("dtype", "bits"), [("uint8", 8), ("float16", 16), ("float32", 32)])
def test_no_bloom_is_the_identity(renderer: Renderer, dtype: str, bits: int) -> None:
    """Of every level, of every half float, and of floats."""
    values = np.arange(1 << 16).reshape(256, 256, 1) * np.array([1, 7, -1, 1 << 15 | 3])
    if bits == 32:
        values = np.random.default_rng(6).integers(0, 2**32, (256, 256, 4))
        # Vulkan lets devices take numbers below the smallest normal one for 0.
        values[(values & 0x7F800000) == 0] = 0
    whole = (values % (1 << bits)).astype(f"u{bits // 8}")
    image = whole.view(dtype)
    frames = renderer.apply(image, OFF)
    assert list(frames) == ["final"]
    held = np.isinf(infinities(renderer, dtype)[0])
    number = np.isfinite(image) | (np.isinf(image) & held)
    assert_array_equal(frames["final"].view(whole.dtype)[number], whole[number])
    # Devices may change which NaN it is, not that it is one.
    assert np.isnan(frames["final"][~number]).all()


# --- Framebuffers and out ---


def test_framebuffers_come_in_the_order_of_the_data_flow(renderer: Renderer) -> None:
    image = picture(12, 9, 3, "uint8", seed=8)
    whole = renderer.apply(image, Separable())
    frames = renderer.apply(image, Separable(), framebuffers=["final", "glow", "final"])
    assert list(frames) == ["glow", "final"]
    for name, array in frames.items():
        assert_array_equal(array, whole[name])
    assert list(renderer.apply(image, Separable(), framebuffers="bloom")) == ["bloom"]
    assert list(renderer.apply(image, Separable(), framebuffers=())) == []


@pytest.mark.parametrize("dtype", DTYPES)
def test_out_is_filled_in_place(renderer: Renderer, dtype: str) -> None:
    image = picture(12, 9, 3, dtype, seed=9)
    out = {"bloom": np.zeros((9, 12, 4), dtype), "final": np.zeros((9, 12, 3), dtype)}
    frames = renderer.apply(image, Separable(), out=out)
    assert list(frames) == ["glow", "blur_vertical", "bloom", "final"]
    for name, array in out.items():
        assert frames[name] is array
    assert_matches_reference(frames, image, Separable())
    assert_same(frames, renderer.apply(image, Separable()))


def test_out_of_a_repeated_image_is_filled(renderer: Renderer) -> None:
    image = picture(12, 9, 3, "uint8", seed=10)
    expected = renderer.apply(image, Separable())["final"]
    out = {"final": np.zeros_like(image)}
    frames = renderer.apply(image, Separable(), out=out)
    assert frames.timings == {}
    assert_array_equal(out["final"], expected)


def test_out_that_shares_memory(renderer: Renderer) -> None:
    image = picture(12, 9, 3, "uint8")
    whole = np.zeros((18, 12, 4), np.uint8)
    with pytest.raises(ValueError, match=r"^out: glow and bloom must not share memory"):
        renderer.apply(image, Separable(), out={"glow": whole[:9], "bloom": whole[4:13]})
    expected = renderer.apply(image, Separable())
    renderer.apply(image, Separable(), out={"glow": whole[:9], "bloom": whole[9:]})
    assert_array_equal(whole[:9], expected["glow"])
    assert_array_equal(whole[9:], expected["bloom"])


# --- Wrong arguments ---


def test_masked_images(renderer: Renderer) -> None:
    """What lies under a mask is not to be seen."""
    image = picture(5, 6, 3, "float32")
    masked = np.ma.masked_greater(image, float(np.median(image)))
    with pytest.raises(ValueError, match=r"^image: some values are masked"):
        renderer.apply(masked, Separable())
    assert_same(
        renderer.apply(masked.filled(0), Separable()),
        renderer.apply(np.where(masked.mask, 0, image), Separable()),
    )
    assert_same(
        renderer.apply(np.ma.masked_invalid(image), Separable()), renderer.apply(image, Separable())
    )


def test_too_large(renderer: Renderer) -> None:
    limit = max_side(renderer)
    # What every Vulkan 1.0 device can do at least.
    assert limit >= 4096
    pixel = np.broadcast_to(np.uint8(9), (1, 1, 3))
    for shape in ((1, limit + 1, 3), (limit + 1, 1, 3), (limit + 1, limit + 1, 3)):
        with pytest.raises(ValueError, match=rf"1 to {limit}"):
            renderer.apply(np.broadcast_to(pixel, shape), Separable())
    with pytest.raises(ValueError, match=rf"1 to {limit}"):
        renderer.apply(pixel, Separable(bloom_size=(1, limit + 1)))


@pytest.mark.parametrize("less", some([0, 4095, 1], 2))
@pytest.mark.parametrize("method", METHODS)
def test_longest_sides(renderer: Renderer, method: str, less: int) -> None:
    """Of two levels without a whole ratio, positions need more bits than a float has."""
    image = picture(max_side(renderer) - less, 3, 3, "float32", seed=17)
    for view in (image, image.transpose(1, 0, 2)):
        frames = renderer.apply(view, METHODS[method])
        assert_matches_reference(frames, view, METHODS[method])
