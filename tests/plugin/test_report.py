"""The report, opened in a browser as a file: Debian's Chromium, run by playwright."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.typing import NDArray

from vkbloom.testing._regression import FrameRegression, Mode
from vkbloom.testing._test_report import Record, write_report

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


def test_shows_each_failed_check(page: Page) -> None:
    assert page.title() == page.locator("h1").inner_text() == "2 of 3 checks failed"
    rows = [row.split("\t") for row in page.locator("tbody tr").all_inner_texts()]
    assert sorted((name, result, first) for name, result, first, _ in rows) == [
        ("new", "missing", ""),
        ("right", "passed", ""),
        ("wrong", "failed", "bloom"),
    ]
    section = page.locator("section", has=page.get_by_role("heading", name="wrong"))
    assert "wrong: the first framebuffer that differs is bloom" in section.inner_text()
    captions = section.locator("figcaption").all_inner_texts()
    assert captions[:3] == ["bloom, expected", "bloom, actual", "bloom, difference × 10"]
    # Three of each framebuffer that differs; glow is equal.
    sizes = page.evaluate("[...document.images].map(i => [i.complete, i.naturalWidth, i.alt])")
    assert len(sizes) == len(captions) == 3 * 4
    assert all(complete and width > 0 and alt for complete, width, alt in sizes)


def test_texts_of_tests_are_texts(page: Page) -> None:
    assert page.locator("img[src='x']").count() == 0
    assert EVIL in page.locator("tbody code").all_inner_texts()
    links = page.evaluate("[...document.querySelectorAll('a')].map(a => a.getAttribute('href'))")
    assert len(links) == 2
    assert all(page.locator(link).count() == 1 for link in links)


@pytest.mark.parametrize(("theme", "width"), [("light", 1280), ("dark", 320)])
def test_no_rule_of_accessibility_is_broken(page: Page, theme: Any, width: int) -> None:
    """At 320 pixels, as WCAG 2.2 asks for in 1.4.10, nothing is scrolled sideways."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    page.emulate_media(color_scheme=theme)
    page.set_viewport_size({"width": width, "height": 900})
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.locator("th:not([scope])").count() == 0
    found = axe.run(page)
    assert found.violations_count == 0, found.generate_report()
