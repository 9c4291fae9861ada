"""The first page of the documentation, as a browser shows it; ``make docs`` builds it."""

from __future__ import annotations

import shutil
from typing import Any

import pytest

from tests.docs.pages import ROOT

PAGE = ROOT / "build" / "docs" / "index.html"


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_no_rule_of_accessibility_is_broken(theme: Any) -> None:
    """Deque's axe-core, on a wide and a narrow screen, which nothing makes wider."""
    if not PAGE.exists():
        pytest.skip("build/docs does not exist: run make docs")
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        pytest.skip("Chromium is not installed")
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    api = pytest.importorskip("playwright.sync_api")
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_page(color_scheme=theme)
        page.goto(PAGE.as_uri())
        for width in (1280, 390):
            page.set_viewport_size({"width": width, "height": 844})
            page.wait_for_timeout(300)
            assert page.evaluate("document.documentElement.scrollWidth") <= width
            found = axe.run(page)
            assert found.violations_count == 0, found.generate_report()
        browser.close()
