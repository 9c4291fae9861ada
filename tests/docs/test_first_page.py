"""The first page of the documentation, as a browser shows it; ``make docs`` builds it."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.docs.pages import ROOT
from tests.explorer.explorer_hosts import CHROMIUM
from tests.processes import output

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")

DOCS = ROOT / "build" / "docs"


@contextlib.contextmanager
def opened(address: str, **options: Any) -> Iterator[Any]:
    """Open a page."""
    api = pytest.importorskip("playwright.sync_api")
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page(**options)
        page.goto(address)
        yield page
        browser.close()


@pytest.fixture(params=["light", "dark"])
def page(request: pytest.FixtureRequest) -> Iterator[Any]:
    if not DOCS.joinpath("index.html").exists():
        pytest.skip("build/docs does not exist: run make docs")
    with opened(DOCS.joinpath("index.html").as_uri(), color_scheme=request.param) as page:
        yield page


def test_no_rule_of_accessibility_is_broken(page: Any) -> None:
    """Deque's axe-core, on a wide and a narrow screen, which nothing makes wider."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    for width in (1280, 390):
        page.set_viewport_size({"width": width, "height": 844})
        page.wait_for_timeout(300)
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        found = axe.run(page)
        assert found.violations_count == 0, found.generate_report()
    # With a column of the page's own headings.
    page.goto(DOCS.joinpath("looks.html").as_uri())
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


#: Entries of the navigation that are current, of which the last is the page's own.
CURRENT = re.compile(
    r'<li class="toctree-l(\d) current(?: has-children)?(?: (current)-page)?">'
    r'<a class="(?:current )?reference internal" href="([^"]+)">[^<]*</a>'
    r"(?:<input [^>]* (checked))?"
)


def test_each_page_is_open_in_the_navigation() -> None:
    """Pages of a folder share one (docs/navigation.py), in which each has its own place."""
    if not DOCS.joinpath("index.html").exists():
        pytest.skip("build/docs does not exist: run make docs")
    levels = {}
    for page in (*DOCS.glob("*.html"), *DOCS.glob("api/*.html"), *DOCS.glob("examples/*/*/*.html")):
        text = page.read_text()
        found = CURRENT.findall(text[text.index("sidebar-tree") : text.index("</aside>")])
        if found:
            *above, (level, own, link, _) = found
            assert (level, own, link) == (str(len(found)), "current", "#"), page
            assert {(own, opened) for _, own, _, opened in above} <= {("", "checked")}, page
            levels[page.relative_to(DOCS).as_posix()] = len(found)
    assert len(levels) > 200
    assert (levels["check.html"], levels["reference.html"]) == (1, 1)
    assert (levels["api/vkbloom.apply.html"], levels["examples/gallery/games/index.html"]) == (2, 2)
    assert max(levels.values()) == 3


def test_a_page_leads_to_another_version(tmp_path: Path) -> None:
    template = (ROOT / "docs" / "templates" / "versions.html").read_text()
    # The page "guide" of a version, as Sphinx fills the template in.
    names = {"release": "VERSION", "pagename": "guide", "pathto('.', 1)": "."}
    names["pathto('../versions.js', 1)"] = "../versions.js"
    text = re.sub(r"{{ (.+?) }}", lambda found: names[found[1]], template)
    for version, pages in (("0.2.0", "guide"), ("0.10.0", "guide"), ("0.11.0.dev0", "index")):
        built = tmp_path / "built" / version
        built.mkdir(parents=True)
        for name in {"index", pages}:
            (built / f"{name}.html").write_text(text.replace("VERSION", version))
        words = [str(built), str(tmp_path / "all"), "--version", version]
        output("-m", "tools.docs_versions", *words, cwd=ROOT)
    with opened((tmp_path / "all" / "index.html").as_uri()) as page:
        page.wait_for_url("**/0.10.0/index.html")
        page.goto((tmp_path / "all" / "0.10.0" / "guide.html").as_uri())
        choice = page.get_by_label("Version")
        assert choice.input_value() == "0.10.0"
        assert choice.locator("option").all_text_contents() == ["0.11.0.dev0", "0.10.0", "0.2.0"]
        choice.select_option("0.2.0")
        page.wait_for_url("**/0.2.0/guide.html")
        page.get_by_label("Version").select_option("0.11.0.dev0")
        page.wait_for_url("**/0.11.0.dev0/index.html")
