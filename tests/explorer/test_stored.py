"""Pages of stored pictures: what they answer is what the server answers, from a file, alone."""

from __future__ import annotations

import itertools
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import OpenImageIO as oiio
import pytest
from numpy.typing import NDArray

from tests.cli.calls import run
from tests.explorer.explorer_hosts import CHROMIUM, PATIENCE, wait_until
from tests.explorer.pages import Pictures, StoredGrid, StoredSource, Viewer, write_stored
from tests.framebuffers import decode
from vkbloom import Pyramid, Renderer, Scene, Separable

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

AXES: dict[str, dict[str, list[Any]]] = {
    # More levels are more framebuffers.
    "pyramid": {"levels": [3, 2], "radius": [1.0, 2.0]},
    "separable": {"blur_scale": [1.0, 2.5], "composite": ["add", "mix"]},
}
SETTINGS = {"pyramid": Pyramid(levels=3, tonemap="aces"), "separable": Separable(tonemap="aces")}
#: The mean difference of a stored picture's levels, of 255, from those of the server: WebP at
#: quality 80 of 96 x 64 pixels. Its colours have half the size, so single pixels differ more.
TOLERANCE = 6.0


def table_of(file: Path) -> Any:
    """Return the answers of a page."""
    found = re.search(
        r'<script type="application/json" id="stored">(.*?)</script>', page_text(file)
    )
    assert found is not None
    return json.loads(found[1])


def page_text(file: Path) -> str:
    return file.read_text("utf-8")


def levels_in(file: Path) -> NDArray[np.uint8]:
    """Return the levels of an image file, as another program decodes them."""
    return np.asarray(oiio.ImageBuf(str(file)).get_pixels(oiio.UINT8))


@pytest.fixture(scope="module")
def sources(renderer: Renderer, scene: Scene) -> list[StoredSource]:
    y, x = np.mgrid[:64, :96]
    image = np.stack([x / 96, y / 64, (x + y) / 160], axis=2).astype(np.float32) * 0.6
    image[30:34, 40:44] = 12
    grids = [StoredGrid(SETTINGS[name], AXES[name]) for name in AXES]
    return [
        StoredSource("gradient", Viewer(image, grids[0].settings, renderer=renderer), grids),
        StoredSource("saucer", Viewer(scene, renderer=renderer, size=(96, 54)), grids[1:]),
    ]


@pytest.fixture(scope="module")
def folder(sources: list[StoredSource], tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("stored") / "page"
    write_stored(out, sources, size=(96, 64))
    return out


def test_every_stored_answer_is_the_servers(
    folder: Path, sources: list[StoredSource], tmp_path: Path
) -> None:
    """Each point, framebuffer by framebuffer: the facts, and the pixels before they are encoded."""
    table = table_of(folder / "index.html")
    again = Pictures(tmp_path / "again")
    compared = 0
    for source, stored in zip(sources, table["sources"], strict=True):
        for one in source.grids:
            kept = stored["grids"][one.settings.method]
            values = itertools.product(*one.axes.values())
            points = [dict(zip(one.axes, point, strict=True)) for point in values]
            for part, changes in (("on", points), ("off", [{"bloom": False}])):
                names = kept[part]["names"]
                rows = np.reshape(kept[part]["answers"], (len(changes), len(names), 3))
                for change, row in zip(changes, rows.tolist(), strict=True):
                    told = [one for one in zip(names, row, strict=True) if one[1][0] >= 0]
                    for name, (facts, code, picture) in told:
                        asked = {
                            "kind": "frame",
                            "sides": {"a": one.settings.replace(**change).to_dict()},
                            "framebuffer": name,
                            "size": [96, 54 if stored["source"]["animated"] else 64],
                        }
                        answer, (png,) = source.viewer.answer(asked)
                        expected = answer["sides"]["a"]
                        plan = table["plans"][table["facts"][facts]["plan"]]
                        shown = {
                            **table["facts"][facts],
                            "plan": plan,
                            "code": table["codes"][code],
                        }
                        assert shown == json.loads(
                            json.dumps({key: expected[key] for key in shown})
                        )
                        assert [other for other, _ in told] == expected["names"]
                        levels = decode(png, tmp_path)
                        file = folder / table["pictures"][picture]
                        assert_stored(file, levels, again)
                        compared += 1
    assert compared > 80


def assert_stored(file: Path, levels: NDArray[np.uint8], again: Pictures) -> None:
    """The file is that of these levels, and shows them."""
    index = again.add(levels)
    assert again.names[index] == file.name
    assert (again.folder / file.name).read_bytes() == file.read_bytes()
    stored = levels_in(file).astype(int)
    away = np.abs(stored - levels.astype(int)).mean()
    assert away <= (0 if file.suffix == ".png" else TOLERANCE), (levels.shape, away)


def test_one_file_holds_all(folder: Path, sources: list[StoredSource], tmp_path: Path) -> None:
    file = tmp_path / "page.html"
    file.write_text("an older page")
    write_stored(file, sources, size=(96, 64))
    assert [*tmp_path.iterdir()] == [file]
    table, other = table_of(file), table_of(folder / "index.html")
    assert {**table, "pictures": 0} == {**other, "pictures": 0}
    assert len(table["pictures"]) == len(other["pictures"])
    kinds = {address.partition(",")[0] for address in table["pictures"]}
    assert kinds == {"data:image/webp;base64", "data:image/png;base64"}


def test_the_command_stores_a_picture_of_ones_own(tmp_path: Path) -> None:
    """Without axes, the method has three sliders of its own; no path of this machine is told."""
    image = np.full((24, 32, 3), 40, np.uint8)
    image[10:14, 10:14] = 255
    assert oiio.ImageBuf(image).write(str(tmp_path / "photo.png"))
    done = run("explore", "--static", tmp_path / "out", tmp_path / "photo.png")
    assert (done.exit_code, done.stdout.splitlines()[-1]) == (
        0,
        f"wrote {tmp_path / 'out'}, 27 points",
    )
    table = table_of(tmp_path / "out" / "index.html")
    (source,) = table["sources"]
    assert source["source"]["name"] == "photo.png"
    assert list(source["source"]["presets"]) == ["photo"]
    axes = dict(source["grids"]["bevy"]["axes"])
    assert [len(values) for values in axes.values()] == [3, 3, 3]
    assert {"intensity", "threshold"} <= set(axes)
    assert str(tmp_path) not in page_text(tmp_path / "out" / "index.html")
    words = ("--axis", "intensity=0.1,0.4", "--method", "separable", "--size", "16x16")
    done = run("explore", "--static", tmp_path / "b.html", tmp_path / "photo.png", *words)
    assert done.exit_code == 0
    (source,) = table_of(tmp_path / "b.html")["sources"]
    assert source["grids"]["separable"]["axes"] == [["intensity", [0.1, 0.4]]]
    # The page begins with a stored value: that of the default, 1, is the nearest.
    assert source["source"]["sides"]["a"]["intensity"] == 0.4


def test_nothing_is_left_of_a_page_that_fails(sources: list[StoredSource], tmp_path: Path) -> None:
    twice = [source._replace(grids=[*source.grids, *source.grids]) for source in sources]
    with pytest.raises(ValueError, match="two of the method 'pyramid'"):
        write_stored(tmp_path / "page", twice, size=(96, 64))
    assert [*tmp_path.iterdir()] == []
    (tmp_path / "page").mkdir()
    (tmp_path / "page" / "of_a_user").touch()
    with pytest.raises(FileExistsError, match="it exists; name a new folder"):
        write_stored(tmp_path / "page", sources, size=(96, 64))


# --- in a browser ---------------------------------------------------------------------------------

needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")


@pytest.fixture
def page(browser: Browser, folder: Path) -> Iterator[Page]:
    """The page, opened as a file. A request of anything else fails the test, and a complaint."""
    page = browser.new_page(viewport={"width": 1280, "height": 844})
    said: list[str] = []
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("request", lambda one: said.append(one.url) if not is_local(one.url, folder) else None)
    page.set_default_timeout(1000 * PATIENCE)
    page.goto((folder / "index.html").as_uri())
    page.locator(".vkb-status", has_text="until shown").wait_for()
    yield page
    page.close()
    assert said == []


def is_local(url: str, folder: Path) -> bool:
    return url.startswith((folder.as_uri(), "data:"))


def picture_in(page: Page, folder: Path) -> NDArray[np.uint8]:
    """Return the pixels of the canvas, at one pixel of the screen each."""
    page.get_by_role("button", name="100 %").click()
    page.evaluate('document.querySelector(".vkb-divider").style.visibility = "hidden"')
    # A picture in the middle of its box may be half a pixel off.
    page.evaluate('document.querySelector(".vkbloom canvas").style.inset = "0 auto auto 0"')
    return decode(page.locator(".vkbloom canvas").screenshot(), folder)[:, :, :3]


def assert_shows(
    page: Page, folder: Path, code: str, name: str, columns: slice = slice(None)
) -> None:
    """The page shows the stored picture of a framebuffer of the settings with this code."""
    from playwright.sync_api import expect

    expect(page.locator(".vkb-foot code")).to_have_text(code, timeout=1000 * PATIENCE)
    expect(page.locator(".vkbloom canvas")).to_have_attribute(
        "aria-label", re.compile(f"^picture: {name},"), timeout=1000 * PATIENCE
    )
    table = table_of(folder / "index.html")
    chosen = page.get_by_role("combobox", name="picture").input_value()
    rows = [
        row
        for source in table["sources"]
        for grid in source["grids"].values()
        if source["source"]["name"] == chosen
        for part in (grid["on"], grid["off"])
        for row in np.reshape(part["answers"], (-1, 3)).tolist()
    ]
    (picture,) = {
        picture
        for facts, kept, picture in rows
        if facts >= 0
        and table["codes"][kept] == code
        and table["facts"][facts]["framebuffer"] == name
    }
    stored = levels_in(folder / table["pictures"][picture])
    shown = picture_in(page, folder.parent)
    assert shown.shape == stored.shape
    # Chromium and OpenImageIO decode with the same library, but may enlarge colours otherwise.
    away = np.abs(shown.astype(int) - stored.astype(int))
    assert away[:, columns].max() <= 2


@needs_chromium
def test_a_file_answers_by_keyboard_and_quickly(page: Page, folder: Path) -> None:
    first = 'vkbloom.Pyramid(tonemap="aces", levels=3'
    assert_shows(page, folder, first + ")", "final")
    slider = page.locator('[data-field="radius"]')
    assert slider.get_attribute("aria-valuetext") == "1"
    slider.focus()
    page.keyboard.press("ArrowRight")
    assert_shows(page, folder, f"{first}, radius=2.0)", "final")
    assert slider.get_attribute("aria-valuetext") == "2"
    page.get_by_label("framebuffer").select_option("down_1")
    assert_shows(page, folder, f"{first}, radius=2.0)", "down_1")
    assert "13 taps" in page.locator(".vkb-caption").inner_text()
    took = []
    for key in ("ArrowLeft", "ArrowRight", "ArrowLeft"):
        slider.focus()
        page.keyboard.press(key)
        page.wait_for_timeout(200)
        took.append(int(re.findall(r"(\d+) ms until", page.locator(".vkb-status").inner_text())[0]))
    # Of three, since other processes may take the processor.
    assert min(took) < 100
    page.locator('[data-field="bloom"]').uncheck()
    page.get_by_label("method").select_option("separable")
    assert_shows(page, folder, 'vkbloom.Separable(bloom=False, tonemap="aces")', "final")


@needs_chromium
def test_another_picture_and_the_address(page: Page, folder: Path) -> None:
    page.get_by_label("method").select_option("separable")
    page.locator('[data-field="composite"]').focus()
    page.keyboard.press("ArrowRight")
    page.get_by_role("combobox", name="picture").select_option("saucer")
    code = 'vkbloom.Separable(composite="mix", tonemap="aces")'
    assert_shows(page, folder, code, "final")
    wait_until(lambda: "saucer" in page.evaluate("location.hash"))
    page.get_by_label("wipe A | B").check()
    wait_until(lambda: "wipe" in page.evaluate("location.hash"))
    page.reload()
    # Right of the middle is B, without bloom.
    assert_shows(page, folder, code, "final", slice(0, 48))
    assert page.get_by_role("combobox", name="picture").input_value() == "saucer"


@needs_chromium
@pytest.mark.parametrize(("theme", "width"), [("light", 1280), ("dark", 390)])
def test_what_is_not_stored_says_why(page: Page, theme: Any, width: int) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    page.emulate_media(color_scheme=theme)
    page.set_viewport_size({"width": width, "height": 844})
    page.get_by_text("More", exact=True).click()
    page.get_by_text("Plan", exact=True).click()
    page.get_by_label("wipe A | B").check()
    for name in ("threshold", "exposure", "tonemap", "intensity", "glare"):
        row = page.locator(".vkb-field").filter(has=page.locator(f'[data-field="{name}"]'))
        assert row.locator("input, select").first.is_disabled(), name
        assert "Not among the stored pictures" in str(row.get_attribute("title"))
    for label in ("Open …", "Save picture", "Swap"):
        button = page.get_by_role("button", name=label)
        assert button.is_disabled() == (label != "Swap")
    assert page.locator(".vkb-plan th", has_text="time").count() == 0
    page.wait_for_timeout(300)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    found = axe.run(page)
    assert found.violations_count == 0, found.generate_report()
