"""The report, opened in a browser as a file: Debian's Chromium, run by playwright."""

from __future__ import annotations

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


# The texts of the buttons of the open dialog that an outline is drawn around.
OUTLINED = """
[...document.querySelectorAll('dialog button')]
  .filter(b => getComputedStyle(b).outlineStyle !== 'none').map(b => b.textContent)
"""


@pytest.mark.parametrize(("theme", "width"), [("light", 1280), ("dark", 320)])
def test_no_rule_of_accessibility_is_broken(page: Page, theme: Any, width: int) -> None:
    """At 320 pixels, as WCAG 2.2 asks for in 1.4.10, nothing but the table is scrolled sideways."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    page.emulate_media(color_scheme=theme)
    page.set_viewport_size({"width": width, "height": 900})
    ground = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert ground == {"light": "rgb(255, 255, 255)", "dark": "rgb(20, 22, 26)"}[theme]
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.locator("th:not([scope])").count() == 0
    found = axe.run(page)
    assert found.violations_count == 0, found.generate_report()
