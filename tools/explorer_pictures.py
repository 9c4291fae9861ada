"""Take the screenshots of docs/explorer.md: its own page and JupyterLab, light and dark.

python tools/explorer_pictures.py docs/pictures

It needs Chromium, playwright and JupyterLab, as the tests do.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import OpenImageIO as oiio
from playwright.sync_api import sync_playwright

import vkbloom
from vkbloom.explorer.viewer import Viewer

# The tests' functions that start both pages.
sys.path.append(str(Path(__file__).parents[1]))
from tests.explorer.explorer_hosts import jupyterlab, served

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

THEMES: tuple[Any, ...] = ("light", "dark")
CELLS = (
    "import vkbloom\n\nexplorer = vkbloom.explore()\nexplorer",
    "explorer.settings",
)


def wait(page: Page, code: str) -> None:
    """Wait until the picture of some settings is shown."""
    page.locator(".vkb-foot code", has_text=code).wait_for(timeout=60_000)
    page.wait_for_timeout(500)


def save(page: Page, path: Path) -> None:
    """Save a screenshot as JPEG, in a quality without visible artefacts."""
    png = path.with_suffix(".png")
    page.screenshot(path=png)
    image = oiio.ImageBuf(str(png))
    image.specmod().attribute("CompressionQuality", 90)
    if not image.write(str(path)):
        raise SystemExit(f"{path}: {image.geterror()}")
    png.unlink()


def photograph_own_page(browser: Browser, folder: Path) -> None:
    """Two methods side by side, with the pointer on the picture."""
    look: dict[str, Any] = {"tonemap": "aces", "encoding": "srgb"}
    with vkbloom.Renderer("software") as renderer:
        against = vkbloom.Separable(**look)
        begun = vkbloom.Separable(blur_scale=1.6, **look)
        with served(lambda: Viewer(None, begun, against=against, renderer=renderer)) as url:
            for theme in THEMES:
                page = browser.new_page(viewport={"width": 1120, "height": 640}, color_scheme=theme)
                page.goto(url)
                wait(page, "blur_scale=1.6")
                page.get_by_label("method").select_option("pyramid")
                page.locator("[data-field=intensity]").fill("1.5")
                wait(page, "Pyramid(intensity=1.5")
                page.get_by_label("wipe A | B").check()
                page.locator("canvas").hover(position={"x": 330.5, "y": 215.5})
                page.get_by_text("B final[215, 330]").wait_for()
                save(page, folder / f"explorer_page_{theme}.jpg")
                page.close()


def photograph_jupyterlab(browser: Browser, folder: Path) -> None:
    """The notebook, with a preset chosen, and the settings read back by the next cell."""
    with tempfile.TemporaryDirectory() as temporary:
        variables = {"VKBLOOM_ADAPTER": "software"}
        with jupyterlab(Path(temporary), CELLS, variables) as url:
            for theme in THEMES:
                page = browser.new_page(viewport={"width": 1240, "height": 900}, color_scheme=theme)
                page.goto(url)
                page.get_by_text("Python 3 (ipykernel) | Idle").wait_for(timeout=60_000)
                page.locator(".jp-CodeCell .cm-content").first.click()
                page.keyboard.press("Shift+Enter")
                wait(page, "vkbloom.Separable(")
                page.get_by_label("preset").select_option("unity_urp")
                wait(page, "vkbloom.UrpBloom(")
                page.locator("[data-field=intensity]").fill("2")
                wait(page, "intensity=2.0")
                page.locator(".jp-CodeCell .cm-content").nth(1).click()
                page.keyboard.press("Shift+Enter")
                page.locator(".jp-OutputArea", has_text="fields at their defaults").wait_for()
                page.locator(".jp-CodeCell").first.scroll_into_view_if_needed()
                page.wait_for_timeout(500)
                save(page, folder / f"explorer_jupyterlab_{theme}.jpg")
                page.close()


@click.command(help=__doc__.splitlines()[0])
@click.argument("folder", type=click.Path(path_type=Path, file_okay=False))
def main(folder: Path) -> None:
    """Take all screenshots."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        raise click.ClickException("Chromium is not installed")
    with ExitStack() as stack:
        playwright = stack.enter_context(sync_playwright())
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        stack.callback(browser.close)
        photograph_own_page(browser, folder)
        photograph_jupyterlab(browser, folder)


if __name__ == "__main__":
    main()
