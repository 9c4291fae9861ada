"""The report, opened in a browser as a file: Debian's Chromium, run by playwright."""

from __future__ import annotations

import itertools
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.typing import NDArray

from vkbloom.testing._records import Record
from vkbloom.testing._regression import FrameRegression, Mode
from vkbloom.testing._report_page import write_report

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")

# What a test's name may hold, as pytest takes it from the user's parameters.
EVIL = "test_one.py::test_frames[<img src=x onerror=alert(1)>&\"']"


def frames(shift: float = 0.0) -> dict[str, NDArray[Any]]:
    y, x = np.mgrid[0:36, 0:64] / 64
    picture = np.stack([x, y, x * y], axis=-1)
    return {
        "glow": picture.astype(np.float16),
        "bloom": (picture / 2 + shift).astype(np.float32),
        "normal": (picture - shift).astype(np.float16),
        "depth": (x + shift).astype(np.float32),
        "final": np.rint(255 * np.minimum(picture + shift, 1)).astype(np.uint8),
    }


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page with a check that passed, one that failed, and one without a reference."""
    folder = tmp_path_factory.mktemp("report")
    records: list[Record] = []

    def regression(test: str) -> FrameRegression:
        mode = Mode(parts=folder / ".parts")
        return FrameRegression(
            folder=folder / "references", test=test, name="frames", mode=mode, records=records
        )

    regression("test_one.py::test_passes").compare(frames(), frames(), "right")
    with pytest.raises(AssertionError, match="the first framebuffer that differs is bloom"):
        regression(EVIL).compare(frames(0.1), frames(), "wrong")
    with pytest.raises(AssertionError, match="there is no reference"):
        regression("test_one.py::test_new").check(frames(), "new")
    return write_report(folder, folder / ".parts", records)


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        # Without a sandbox, which root has not; nothing but our own file is opened.
        opened = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield opened
        opened.close()


@pytest.fixture(scope="module")
def said() -> list[str]:
    """Whatever the page complains about or asks for."""
    return []


@pytest.fixture(scope="module")
def tab(browser: Browser, said: list[str]) -> Page:
    """The page of all tests."""
    opened = browser.new_page()
    opened.on("console", lambda message: said.append(message.text))
    opened.on("pageerror", lambda error: said.append(str(error)))
    opened.on("dialog", lambda dialog: said.append(dialog.message))
    opened.on("request", lambda request: said.append(request.url))
    return opened


@pytest.fixture
def page(tab: Page, said: list[str], report: Path) -> Iterator[Page]:
    """The report, with whatever it complains about or asks for failing the test."""
    tab.set_viewport_size({"width": 1280, "height": 900})
    tab.emulate_media(color_scheme="light")
    tab.goto("about:blank")
    said.clear()
    tab.goto(report.as_uri())
    yield tab
    assert [text for text in said if not text.startswith("data:")] == [report.as_uri()]


def test_names_the_first_to_differ_at_the_top(page: Page) -> None:
    assert page.title() == "2 of 3 checks failed"
    first = page.locator("main > section").first
    assert first.locator("h2").inner_text() == "First to differ"
    lines = first.locator("li").all_inner_texts()
    assert lines[0].startswith("new: there is no reference") or lines[1].startswith("new:")
    (wrong,) = (line for line in lines if line.startswith("wrong"))
    assert wrong.startswith("wrong: bloom, 100 % of the pixels differ by more than")


def test_framebuffers_in_the_order_of_the_data(page: Page) -> None:
    flow = page.locator("ol.flow").first.locator("li")
    assert [text.split() for text in flow.all_inner_texts()] == [
        ["glow", "✓", "equal"],
        ["bloom", "✗", "failed,", "first", "to", "differ"],
        ["normal", "✗", "failed"],
        ["depth", "✗", "failed"],
        ["final", "✗", "failed"],
    ]
    shown = page.locator(".framebuffer h3").all_inner_texts()
    assert [text.split()[0] for text in shown] == list(frames())


def test_pictures(page: Page) -> None:
    sizes = page.evaluate(
        "[...document.images].filter(i => i.src).map(i => [i.complete, i.naturalWidth, i.alt])"
    )
    # Four of each framebuffer that differs with three around the worst pixel, and one of glow.
    assert len(sizes) == 4 * 7 + 1
    assert all(complete and width > 0 and alt for complete, width, alt in sizes)
    bloom = page.locator(".framebuffer.failed").first
    assert bloom.locator("figcaption").all_inner_texts()[:3] == [
        "expected",
        "actual",
        "difference × 10",
    ]
    assert "Worst pixel: x " in bloom.locator("h4").inner_text()
    assert bloom.locator("svg rect").count() > 0
    label = bloom.locator("svg").get_attribute("aria-label")
    assert label is not None
    assert label.endswith("0 values are lower than expected, 0 equal or nearly, 6912 higher")


def test_texts_of_tests_are_texts(page: Page) -> None:
    assert page.locator("img[src='x']").count() == 0
    assert page.locator("article code").first.inner_text() in (EVIL, "test_one.py::test_new")
    assert EVIL in page.locator("tbody code").all_inner_texts()


def test_works_by_keyboard(page: Page) -> None:
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.className") == "skip"
    for _ in range(60):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.dataset.kind") == "difference":
            break
    opener = page.evaluate("document.activeElement.getAttribute('aria-label')")
    assert opener == "Enlarge: bloom, difference × 10"
    # The focus can be seen.
    assert page.evaluate("getComputedStyle(document.activeElement).outlineStyle") == "solid"
    page.keyboard.press("Enter")
    dialog = page.locator("dialog")
    assert dialog.is_visible()
    captions = []
    for key in ("ArrowRight", "ArrowRight", "ArrowLeft"):
        page.keyboard.press(key)
        captions.append(page.locator("#caption").inner_text().split(" (")[0])
    assert captions[0].startswith("bloom, FLIP")
    assert captions[1] == "bloom, expected"
    assert captions[2].startswith("bloom, FLIP")
    pressed = dialog.locator("button[aria-pressed=true]")
    assert pressed.inner_text() == "flip"
    # One button is outlined: the one that is pressed and has the focus.
    assert page.evaluate(OUTLINED) == ["flip"]
    page.keyboard.press("Tab")
    assert page.evaluate(OUTLINED) == ["Close"]
    page.keyboard.press("Escape")
    assert not dialog.is_visible()
    assert page.evaluate("document.activeElement.getAttribute('aria-label')") == opener
    # And by pointer.
    page.locator(".pictures button").nth(1).click()
    assert dialog.is_visible()
    dialog.get_by_text("actual", exact=True).click()
    dialog.get_by_text("Close").click()
    assert not dialog.is_visible()


def test_links_lead_somewhere(page: Page) -> None:
    broken = page.evaluate(
        "[...document.querySelectorAll('a')].map(a => a.getAttribute('href'))"
        ".filter(h => !h.startsWith('#') || !document.getElementById(h.slice(1)))"
    )
    assert broken == []
    doubled = page.evaluate(
        "(ids => ids.filter((id, i) => ids.indexOf(id) !== i))"
        "([...document.querySelectorAll('[id]')].map(e => e.id))"
    )
    assert doubled == []


def test_structure(page: Page) -> None:
    """Headings without gaps, a language, one main, heads of tables, names of buttons."""
    levels = page.evaluate("[...document.querySelectorAll('h1,h2,h3,h4')].map(h => +h.tagName[1])")
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(after <= before + 1 for before, after in itertools.pairwise(levels))
    assert page.evaluate("document.documentElement.lang") == "en"
    assert page.locator("main").count() == 1
    assert page.locator("th:not([scope])").count() == 0
    assert page.evaluate(
        "[...document.querySelectorAll('button')]"
        ".every(b => b.getAttribute('aria-label') || b.textContent.trim())"
    )


# The texts of the buttons of the open dialog that an outline is drawn around.
OUTLINED = """
[...document.querySelectorAll('dialog button')]
  .filter(b => getComputedStyle(b).outlineStyle !== 'none').map(b => b.textContent)
"""


# The relative luminance and the contrast of WCAG 2.2, of each element with a text of its own
# against the first background behind it.
CONTRAST = """
() => {
  const parts = text => text.match(/[\\d.]+/g).map(Number);
  const luminance = c => c.slice(0, 3).map(v => v / 255)
    .map(v => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
    .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
  const back = e => {
    for (; e; e = e.parentElement) {
      const c = parts(getComputedStyle(e).backgroundColor);
      if (c.length < 4 || c[3] > 0) return c;
    }
    return [255, 255, 255];
  };
  return [...document.querySelectorAll('body *')]
    .filter(e => [...e.childNodes].some(n => n.nodeType === 3 && n.data.trim()))
    .filter(e => !e.closest('dialog, script, style'))
    .map(e => {
      const [a, b] = [luminance(parts(getComputedStyle(e).color)), luminance(back(e))];
      return [(Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), e.outerHTML.slice(0, 90)];
    })
    .sort((a, b) => a[0] - b[0])[0];
}
"""


def test_light_and_dark(page: Page) -> None:
    backs = []
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        backs.append(page.evaluate("getComputedStyle(document.body).backgroundColor"))
        lowest, where = page.evaluate(CONTRAST)
        # What WCAG 2.2 asks for at level AA, 1.4.3.
        assert lowest >= 4.5, where
    assert backs == ["rgb(255, 255, 255)", "rgb(20, 22, 26)"]


def test_narrow_window(page: Page) -> None:
    """At 320 pixels, as WCAG 2.2 asks for in 1.4.10, nothing but the table is scrolled sideways."""
    page.set_viewport_size({"width": 320, "height": 700})
    assert page.evaluate("document.documentElement.scrollWidth") <= 320
