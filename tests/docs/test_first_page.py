"""The first page of the documentation, as a browser shows it; ``make docs`` builds it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from tests.docs.pages import ROOT
from tests.explorer.explorer_hosts import CHROMIUM

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")

DOCS = ROOT / "build" / "docs"


@pytest.fixture(params=["light", "dark"])
def page(request: pytest.FixtureRequest) -> Iterator[Any]:
    if not DOCS.joinpath("index.html").exists():
        pytest.skip("build/docs does not exist: run make docs")
    api = pytest.importorskip("playwright.sync_api")
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page(color_scheme=request.param)
        page.goto(DOCS.joinpath("index.html").as_uri())
        yield page
        browser.close()


def test_no_rule_of_accessibility_is_broken(page: Any) -> None:
    """Deque's axe-core, on a wide and a narrow screen, which nothing makes wider."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    for width in (1280, 390):
        page.set_viewport_size({"width": width, "height": 844})
        page.wait_for_timeout(300)
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        found = axe.run(page)
        assert found.violations_count == 0, found.generate_report()


def test_the_picture_shows_both_sides_on_a_narrow_screen(page: Any) -> None:
    page.set_viewport_size({"width": 390, "height": 844})
    hero = page.locator("article img").first
    hero.scroll_into_view_if_needed()
    box = hero.bounding_box()
    assert 300 < box["width"] <= 390
    assert box["y"] + box["height"] < 844
    assert hero.evaluate("element => element.naturalWidth") >= box["width"]
    assert "without bloom" in hero.get_attribute("alt")
