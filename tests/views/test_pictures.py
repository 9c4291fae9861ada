"""Pictures of framebuffers: PNG, and contact sheets as HTML."""

from __future__ import annotations

import base64
import contextlib
import dataclasses
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.explorer.pages import picture_of
from tests.framebuffers import decode, make, make_mixed
from tests.images import noise, noise_image
from tests.srgb import encode_srgb
from vkbloom import Frames, Separable
from vkbloom._views.pictures import picture


@dataclasses.dataclass(frozen=True, kw_only=True)
class Noted(Separable):
    """Settings whose text a page must escape."""

    note: str = '</code><script>"&'


@pytest.fixture
def frames() -> Frames:
    return make_mixed()


class TestPng:
    @pytest.mark.parametrize("channels", [3, 4])
    @pytest.mark.parametrize("size", [(1, 1), (3, 5), (40, 33)])
    def test_shows_8_bit_as_stored(
        self, channels: int, size: tuple[int, int], tmp_path: Path
    ) -> None:
        image = noise(*size, channels, dtype="uint8")
        shown = make({"final": image, "glow": noise(2, 2, 3, dtype="uint8")})._repr_png_()
        assert np.array_equal(decode(shown, tmp_path), image)

    @pytest.mark.parametrize("dtype", ["float16", "float32"])
    def test_shows_linear_floats_by_the_srgb_curve(self, dtype: str, tmp_path: Path) -> None:
        # 188 is the 8-bit sRGB level of 0.5, 99 that of 0.125, 3 that of 0.001 (12.92 * 0.001).
        values = [-1.0, 0.0, 0.001, 0.125, 0.5, 1.0, 7.0, np.inf, -np.inf, np.nan]
        levels = [0, 0, 3, 99, 188, 255, 255, 255, 0, 0]
        image = np.array(values, dtype).reshape(1, -1, 1).repeat(4, axis=2)
        shown = decode(make({"final": image})._repr_png_(), tmp_path)
        assert shown[0, :, 0].tolist() == levels
        # Alpha has no transfer curve: 0.125 * 255 and 0.5 * 255, rounded to even.
        assert shown[0, 3:5, 3].tolist() == [32, 128]

    def test_does_not_encode_twice(self, tmp_path: Path) -> None:
        image = np.full((1, 1, 3), 0.2, np.float32)
        frames = make({"bloom": image, "final": image}, settings=Separable(encoding="srgb"))
        assert decode(frames._repr_png_(), tmp_path)[0, 0, 0] == 51
        # `bloom` comes before the encoding.
        frames = make({"bloom": image}, settings=Separable(encoding="srgb"))
        assert decode(frames._repr_png_(), tmp_path)[0, 0, 0] == 124

    def test_shows_depth_from_white_to_black(self, tmp_path: Path) -> None:
        depth = np.array([[0.5, 0.75, 1.0, np.inf]], np.float32)
        shown = decode(make({"depth": depth})._repr_png_(), tmp_path)
        assert shown[0, :, 0].tolist() == [255, 128, 0, 0]

    def test_shows_16_bits_as_stored(self) -> None:
        image = np.array([[[0, 32896, 65535]]], np.uint16)
        assert picture(image).ravel().tolist() == [0, 128, 255]

    @pytest.mark.parametrize("value", [0.0, 1.0, np.nan, np.inf, -np.inf])
    @pytest.mark.filterwarnings("error")
    def test_shows_flat_depth_and_position(self, value: float, tmp_path: Path) -> None:
        flat = np.full((2, 3), value, np.float32)
        assert (decode(make({"depth": flat})._repr_png_(), tmp_path) == 255).all()
        position = np.stack([flat] * 3, axis=2)
        assert (decode(make({"position": position})._repr_png_(), tmp_path) == 0).all()

    def test_shows_g_buffers(self, tmp_path: Path) -> None:
        normal = np.array([[[-1, 0, 1, 1]]], np.float16)
        shown = decode(make({"normal": normal})._repr_png_(), tmp_path)
        assert shown[0, 0, :3].tolist() == [0, 128, 255]
        position = np.array([[[-4, 3, 9, 1], [4, 3, 1, 1], [0, 3, 5, 1]]], np.float16)
        shown = decode(make({"position": position})._repr_png_(), tmp_path)
        assert shown[0, :, 0].tolist() == [0, 255, 128]
        assert shown[0, :, 1].tolist() == [0, 0, 0]
        assert shown[0, :, 2].tolist() == [255, 0, 128]

    def test_without_final_the_last_image_is_shown(self, tmp_path: Path) -> None:
        glow, bloom = noise(2, 3, 4, dtype="uint8"), noise(4, 5, 4, dtype="uint8")
        frames = make({"glow": glow, "bloom": bloom, "depth": noise(2, 2, dtype="float32")})
        assert np.array_equal(decode(frames._repr_png_(), tmp_path), bloom)

    def test_leaves_the_framebuffers_as_they_are(self, frames: Frames) -> None:
        before = {name: array.tobytes() for name, array in frames.items()}
        frames._repr_png_(), frames._repr_html_()
        assert {name: array.tobytes() for name, array in frames.items()} == before

    def test_empty(self) -> None:
        assert make({})._repr_png_() is None

    def test_needs_only_numpy(self, frames: Frames, monkeypatch: pytest.MonkeyPatch) -> None:
        with_everything = (frames._repr_png_(), frames._repr_html_())
        monkeypatch.setitem(sys.modules, "OpenImageIO", None)
        monkeypatch.setitem(sys.modules, "xarray", None)
        assert (frames._repr_png_(), frames._repr_html_()) == with_everything


class TestHtml:
    def pictures(self, page: str, folder: Path) -> list[NDArray[np.uint8]]:
        found = re.findall(r'src="data:image/png;base64,([^"]+)"', page)
        return [decode(base64.b64decode(data, validate=True), folder) for data in found]

    def test_shows_every_framebuffer_with_its_name_size_and_dtype(
        self, frames: Frames, tmp_path: Path
    ) -> None:
        page = frames._repr_html_()
        pictures = self.pictures(page, tmp_path)
        assert [picture.shape[:2] for picture in pictures] == [a.shape[:2] for a in frames.values()]
        assert re.findall(r'alt="(\w+),', page) == list(frames)
        assert page.count("13 x 11, uint8") == page.count("13 x 11, uint8</span>") + 1 == 2

    def test_pictures_are_averaged_down(self, tmp_path: Path) -> None:
        image = np.zeros((200, 960, 3), np.uint8)
        image[:, ::3] = 90
        image[::2] += 40
        wide, odd = make({"final": image}), make({"final": image[:199, :641]})
        (picture,) = self.pictures(wide._repr_html_(), tmp_path)
        assert picture.shape == (67, 320, 3)
        # Groups of 3 x 3 pixels (some 3 x 2): a third of the columns at 90, 1 to 2 rows at 40.
        assert set(np.unique(picture).tolist()) <= {43, 50, 57}
        # The average of all groups is that of the image, within the uneven groups' weights.
        assert abs(picture.mean() - image.mean()) < 0.5
        (picture,) = self.pictures(odd._repr_html_(), tmp_path)
        assert picture.shape == (99, 320, 3)

    def test_alpha_hides_nothing(self, tmp_path: Path) -> None:
        image = np.full((2, 2, 4), (10, 20, 30, 0), np.uint8)
        (picture,) = self.pictures(make({"final": image})._repr_html_(), tmp_path)
        assert picture[0, 0].tolist() == [10, 20, 30]

    def test_everything_is_escaped_and_nothing_runs(self) -> None:
        frames = make(
            {"final": noise(1, 1, 3, dtype="uint8")}, timings={"<i>pass": 1.0}, settings=Noted()
        )
        page = frames._repr_html_()
        assert "<script" not in page
        assert "&lt;/code&gt;&lt;script&gt;" in page
        assert "Some &lt;GPU&gt; &amp; co" in page
        assert "&lt;i&gt;pass" in page
        assert not {"<GPU>", "<i>", " & "} & set(re.findall(r"<GPU>|<i>| & ", page))
        assert not re.search(r"\son\w+=", page)

    def test_takes_the_colours_of_the_page(self, frames: Frames) -> None:
        page = frames._repr_html_()
        assert "color-scheme:light dark" in page
        assert set(re.findall(r"[^-]color:([^;\"]+)", page)) == {"inherit"}

    def test_pass_times(self, frames: Frames) -> None:
        page = frames._repr_html_()
        assert re.findall(r"([\d.]+) ms", page) == ["7.000", "1.000", "4.000", "2.000"]
        assert re.findall(r"(\d+) %<", page) == ["14", "57", "29"]
        assert ">what it does</th>" in page
        assert ">blurs along the columns, the first half of a blur in two passes</td>" in page

    @pytest.mark.parametrize("timings", [{}, {"glow": 0.0}, {"glow": float("nan")}])
    def test_pass_times_that_tell_nothing(self, timings: dict[str, float]) -> None:
        page = make({"final": noise(1, 1, 3, dtype="uint8")}, timings=timings)._repr_html_()
        assert ("time on" in page) == bool(timings)

    def test_ranges_of_what_is_not_finite(self) -> None:
        image = np.full((2, 2, 3), np.nan, np.float32)
        assert ", nothing finite<" in make({"bloom": image})._repr_html_()
        image[0, 0] = (-1, 0, np.inf)
        assert ", -1 to 0, some not finite<" in make({"bloom": image})._repr_html_()

    def test_page_of_large_framebuffers_is_small(self) -> None:
        ramp = np.linspace(0, 255, 1920).astype(np.uint8)
        image = np.broadcast_to(ramp[np.newaxis, :, np.newaxis], (1080, 1920, 4))
        page = make({f"down_{level}": image for level in range(9)})._repr_html_()
        assert len(page) < 100_000


@pytest.mark.parametrize("name", list(vkbloom.presets))
def test_the_sheet_says_where_glow_is_not_thresholded(
    renderer: vkbloom.Renderer, name: str
) -> None:
    image = np.full((16, 16, 3), 0.3, np.float32)
    image[6:10, 6:10] = 5
    settings = vkbloom.presets[name]
    with contextlib.suppress(ValueError):  # two methods have no threshold
        settings = settings.replace(threshold=1.0)
    frames = renderer.apply(image, settings)
    is_frame = settings.threshold is not None and bool(frames["glow"].min(initial=1.0) > 0.2)
    page = frames._repr_html_()
    assert ("the frame before its threshold" in page) == is_frame
    assert_each_pass_has_a_sentence(frames)


def assert_each_pass_has_a_sentence(frames: Frames) -> None:
    """Of the rows of passes, the last cell says what they do."""
    sentences = re.findall(r"<td[^>]*>([a-z][^<]+)</td></tr>", frames._repr_html_())
    assert len(sentences) == len(frames.timings) > 0


PASSES: dict[str, tuple[vkbloom.Settings, dict[str, Any]]] = {
    **{f"exposure {one}": (vkbloom.presets.kino, {"exposure": one}) for one in vkbloom.exposures},
    **{f"taa {one}": (vkbloom.presets.kino, {"taa": one}) for one in vkbloom.antialiasing},
    "direct": (Separable(direct=True, loops=2), {}),
    "layers": (Separable(layers=((1, 1), (2, 0.5)), loops=2), {}),
    "field": (
        vkbloom.Convolution(vkbloom.psf.Varying(function=lambda u, v: np.ones((3, 3)))),
        {},
    ),
}


@pytest.mark.parametrize("name", PASSES)
def test_the_sheet_says_what_passes_of_all_stages_do(renderer: vkbloom.Renderer, name: str) -> None:
    settings, given = PASSES[name]
    image = np.full((16, 16, 3), 0.3, np.float32)
    assert_each_pass_has_a_sentence(renderer.apply(image, settings, **given))


@pytest.mark.parametrize("dtype", ["float16", "float32"])
@pytest.mark.parametrize("stops", [0.0, -0.5])
def test_colours_above_1_keep_their_hue(dtype: str, stops: float, tmp_path: Path) -> None:
    """In notebooks and in the explorer, as in files of integers."""
    limit = 2.0**-stops
    image = np.array([[[4, 2, 1], [0.5, 0.25, 0.125]]], dtype)
    kept = np.array([[[limit, limit / 2, limit / 4], [0.5, 0.25, 0.125]]], np.float32)
    expected = np.rint(255 * encode_srgb(kept * np.float32(2.0**stops)))
    shown = picture(image, "bloom", stops=stops)
    page = decode(picture_of(image, "bloom", encoding="none", stops=stops), tmp_path)
    assert np.abs(shown - expected).max() <= 1
    assert np.abs(page.astype(int) - shown).max() <= 1


# What notebooks show: plain text with padded cells.


def test_notebooks_get_plain_text_with_padded_cells(renderer: vkbloom.Renderer) -> None:
    """Some notebooks refuse a subclass of str, and have no padding of their own."""
    image = noise_image(16, 16, 3)
    shown: list[Any] = [
        renderer.apply(image),
        renderer.plan(image, vkbloom.Pyramid(levels=2)),
        vkbloom.presets,
        vkbloom.testing.report(lambda given: given, size=(32, 32), laws=("gain",)),
        vkbloom.fit(image, image, vkbloom.Pyramid(), ["intensity"], renderer=renderer, max_calls=3),
    ]
    for one in shown:
        page = one._repr_html_()
        assert type(page) is str, one
        cells = re.findall(r"<t[dh]\b[^>]*>", page)
        assert all("padding" in cell for cell in cells), one


def test_times_are_bars() -> None:
    """Of their share of the whole, which is text, too; a screen reader skips the bars."""
    frames = make({"final": np.zeros((2, 2, 3), np.uint8)}, timings={"glow": 1e-3, "bloom": 4e-3})
    page = frames._repr_html_()
    bars = re.findall(r'<div[^>]* aria-hidden="true"><div style="[^"]*width:([\d.]+)%', page)
    assert [float(width) for width in bars] == [20, 80]
    assert re.findall(r"(\d+) %<", page) == ["20", "80"]
    assert ">2 passes, 5.000 ms together</caption>" in page
    unknown = make({"final": frames["final"]}, timings={"glow": np.nan})._repr_html_()
    assert ">not measured</td>" in unknown
    assert ">1 pass</caption>" in unknown
    assert "width:" not in unknown.partition("<table")[2]


def test_settings_show_what_differs() -> None:
    html = vkbloom.Pyramid(levels=3, tonemap="aces")._repr_html_()
    assert re.findall(r"<th[^>]*>(\w+)</th>", html) == ["tonemap", "levels"]
    assert re.findall(r"<td[^>]*>([^<]+)</td>", html) == ["&#x27;aces&#x27;", "3"]
    assert "all fields are the defaults" in vkbloom.Pyramid()._repr_html_()
