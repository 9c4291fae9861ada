"""The explorer's widget in marimo, and in a host that does not transport binary buffers."""

from __future__ import annotations

import base64
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import vkbloom
from tests.exhaustive import witness
from tests.explorer.explorer_hosts import CHROMIUM, PATIENCE, marimo
from vkbloom import Renderer, Scene

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")

FILES = resources.files("vkbloom._explorer")
# A model as anywidget has it: messages travel as JSON, and buffers are lost.
HOST = """
import widget from "./page.js";
const listeners = [];
const model = {
  on: (_, listener) => listeners.push(listener),
  off: () => {},
  set: (name, value) => (window.traits = { ...window.traits, [name]: value }),
  save_changes: () => {},
  send: async (message) => {
    const answers = await window.kernel(JSON.parse(JSON.stringify(message)));
    for (const answer of answers) for (const listener of listeners) listener(answer, []);
  },
};
widget.render({ model, el: document.body });
"""


def wait_for_picture(page: Page) -> bytes:
    page.locator(".vkb-status", has_text="until shown").wait_for(timeout=1000 * PATIENCE)
    page.wait_for_timeout(300)
    return page.locator(".vkb-stage canvas").screenshot()


def test_pictures_come_as_text_where_buffers_are_lost(
    browser: Browser, scene: Scene, renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    anywidget = pytest.importorskip("anywidget")
    sent: list[Any] = []
    monkeypatch.setattr(anywidget.AnyWidget, "send", lambda _, answer, buffers: sent.append(answer))
    explorer = vkbloom.explore(scene, size=(64, 36), renderer=renderer)

    def kernel(message: Any) -> list[Any]:
        sent.clear()
        explorer._handle_custom_msg(message, [])
        return list(sent)

    files = {
        "/": ("text/html", '<body><script type="module" src="host.js"></script>'),
        "/host.js": ("text/javascript", HOST),
        "/page.js": ("text/javascript", (FILES / "page.js").read_text()),
    }

    def serve(route: Any) -> None:
        kind, text = files[route.request.url.removeprefix("http://host.invalid")]
        route.fulfill(body=text, content_type=kind)

    page = browser.new_page(viewport={"width": 980, "height": 640})
    page.on("pageerror", lambda error: pytest.fail(str(error)))
    page.route("http://host.invalid/**", serve)
    page.expose_function("kernel", kernel)
    page.goto("http://host.invalid/")
    before = wait_for_picture(page)
    page.get_by_label("method").select_option("dual_kawase")
    page.wait_for_function("window.traits.settings.method === 'dual_kawase'")
    assert wait_for_picture(page) != before
    assert explorer.settings == vkbloom.DualKawase().replace(
        **{name: getattr(explorer.settings, name) for name in ("tonemap", "encoding", "exposure")}
    )
    # Files to the kernel are text, too.
    picture = base64.b64decode(sent[-1]["pictures"][0])
    page.get_by_label("image or settings").set_input_files(
        {"name": "other.png", "mimeType": "image/png", "buffer": picture}
    )
    page.get_by_text("other.png").first.wait_for()
    page.close()


@witness("marimo takes 20 s to start; test_explorer.py has the widget's traits")
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_marimo(browser: Browser, tmp_path: Path, theme: Any) -> None:
    pytest.importorskip("marimo")
    with marimo(tmp_path, theme) as url:
        page = browser.new_page(viewport={"width": 1280, "height": 1000})
        page.goto(url)
        before = wait_for_picture(page)
        # A cell reads the trait, and runs again.
        page.get_by_text("loops: 1, 1").wait_for(timeout=1000 * PATIENCE)
        page.locator("input[type=range]").nth(2).fill("3")
        page.get_by_label("loops", exact=True).first.fill("4")
        page.get_by_text("loops: 4, 4").wait_for(timeout=1000 * PATIENCE)
        assert wait_for_picture(page) != before
        red = "element => +getComputedStyle(element).color.match(/\\d+/)[0]"
        assert (page.locator(".vkbloom").evaluate(red) < 128) == (theme == "light")
        # The table of the plan.
        padding = "element => getComputedStyle(element).paddingLeft"
        assert page.locator("td[style*=padding]").first.evaluate(padding) == "8px"
        page.screenshot(path=tmp_path / "page.png", full_page=True)
        page.close()
