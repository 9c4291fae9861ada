"""Large images, which passes on CPUs read where the caller has them: all their bytes and no others.

An image that was read in place is not kept. So the same array, given again, runs all passes once
more, and from then on only those that are out of date: this shows which way was taken.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.device.abilities import has_linear_texels, infinities, max_side
from tests.exhaustive import by_turns
from tests.images import picture
from vkbloom import Pyramid, Renderer, Separable, Settings

SETTINGS = [Separable(threshold=0.4, knee=0.1), Pyramid(levels=3, threshold=0.4)]


def special(renderer: Renderer, width: int, height: int, channels: int, dtype: str) -> Any:
    """Return a picture, of floats with NaN and infinity in the outermost and in inner pixels."""
    image = picture(width, height, channels, dtype, 6)
    if dtype != "uint8":
        image[0, 0] = np.nan
        image[-1, -1, 0], image[height // 2, width // 2, 1] = infinities(renderer, dtype)
    return image


def is_read_in_place(renderer: Renderer, image: Any, settings: Settings) -> bool:
    """Whether the first of two calls read the array in place, so that the second runs all passes.

    The last pass alone also runs if it stored its result to the caller's array.
    """
    renderer.apply(image, settings)
    return "glow" in renderer.apply(image, settings).timings


@pytest.fixture
def cpu(new_renderer: Callable[[], Renderer]) -> Renderer:
    renderer = new_renderer()
    if renderer.info.type != "cpu" or not has_linear_texels(renderer):
        pytest.skip("only CPUs read images in place, as linear texels")
    return renderer


@pytest.mark.parametrize(
    ("settings", "channels", "size", "dtype"),
    by_turns(
        SETTINGS,
        [3, 4],
        [(640, 560), (1021, 352), (4, 16384)],
        turns=["uint8", "float16", "float32"],
    ),
)
def test_in_place_or_copied_is_the_same(
    renderer: Renderer, size: tuple[int, int], dtype: str, channels: int, settings: Settings
) -> None:
    image = special(renderer, size[0], min(size[1], max_side(renderer)), channels, dtype)
    # A sequence is always copied: the array may change before the device has run.
    (copied,) = renderer.sweep(image, [settings])
    around = np.zeros((len(image) + 2, size[0] + 32, channels), dtype)
    around[1:-1, 16:-16] = image
    read_only = image.copy()
    read_only.flags.writeable = False
    for same in (image.copy(), around[1:-1, 16:-16], read_only, image[:, ::-1].copy()[:, ::-1]):
        frames = renderer.apply(same, settings)
        assert (frames.info["nan"], frames.info["inf"]) == (copied.info["nan"], copied.info["inf"])
        for name, array in copied.items():
            np.testing.assert_array_equal(frames[name], array, err_msg=name)


@pytest.mark.parametrize("dtype", ["uint8", "float16", "float32"])
@pytest.mark.parametrize("settings", SETTINGS, ids=["separable", "pyramid"])
def test_which_images_are_read_in_place(cpu: Renderer, settings: Settings, dtype: str) -> None:
    image = picture(640, 560, 4, dtype, 7)
    rgb = np.ascontiguousarray(image[..., :3])
    assert is_read_in_place(cpu, image, settings)
    assert is_read_in_place(cpu, image[3:], settings)
    # Passes with a form for three channels: of floats, those of the blur at the image's size.
    assert is_read_in_place(cpu, rgb, settings) == (
        dtype == "float32" and isinstance(settings, Separable)
    )
    # Rows that are no complete words, or that begin between two; small images; framebuffers that
    # need a sampler.
    assert not is_read_in_place(cpu, np.ascontiguousarray(image[:, :637]), settings) or (
        dtype == "float32"
    )
    assert not is_read_in_place(cpu, image[::-1], settings)
    assert not is_read_in_place(cpu, image[:100, :100].copy(), settings)
    half = settings.replace(bloom_size=(320, 280)) if isinstance(settings, Separable) else None
    assert half is None or not is_read_in_place(cpu, image, half)


@pytest.mark.parametrize("shift", [0, 1, -1, 300, -300])
def test_an_output_over_the_image(renderer: Renderer, shift: int) -> None:
    height = 300
    memory = np.zeros((3 * height, 512, 4), np.float32)
    image = memory[height : 2 * height]
    image[:] = special(renderer, 512, height, 4, "float32")
    expected = renderer.apply(image.copy(), SETTINGS[0])["final"]
    out = memory[height + shift : 2 * height + shift]
    renderer.apply(image, SETTINGS[0], framebuffers=("final",), out={"final": out})
    np.testing.assert_array_equal(out, expected)


@pytest.mark.parametrize("dtype", ["float16", "float32"])
def test_specials_come_and_go(renderer: Renderer, dtype: str) -> None:
    """The passes know whether the image has NaN or infinity, and stop checking if it has none."""
    image = picture(640, 560, 4, dtype, 9)
    (before,) = renderer.sweep(image, [SETTINGS[0]], framebuffers=("final",))
    lacking = image.copy()
    lacking[100, 200, :3] = 0
    (expected,) = renderer.sweep(lacking, [SETTINGS[0]], framebuffers=("final",))
    for value in (np.nan, *infinities(renderer, dtype)):
        changed = image.copy()
        changed[100, 200, :3] = value
        final = renderer.apply(changed, SETTINGS[0], framebuffers=("final",))["final"].copy()
        np.testing.assert_array_equal(final[100, 200, :3], changed[100, 200, :3])
        final[100, 200, :3] = expected["final"][100, 200, :3]
        np.testing.assert_array_equal(final, expected["final"])
    again = renderer.apply(image, SETTINGS[0], framebuffers=("final",))
    np.testing.assert_array_equal(again["final"], before["final"])


def test_a_file_in_memory(renderer: Renderer, tmp_path: Path) -> None:
    image = special(renderer, 640, 560, 4, "float32")
    np.save(tmp_path / "image.npy", image)
    mapped = np.load(tmp_path / "image.npy", mmap_mode="r")
    expected = renderer.apply(image, SETTINGS[0])["final"]
    np.testing.assert_array_equal(renderer.apply(mapped, SETTINGS[0])["final"], expected)
