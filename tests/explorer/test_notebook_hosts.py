"""The explorer's widget in a host with a theme that does not transport binary buffers."""

from __future__ import annotations

import base64
from importlib import resources
from typing import TYPE_CHECKING, Any

import pytest

import vkbloom
from tests.explorer.explorer_hosts import CHROMIUM, PATIENCE, wait_until
from tests.explorer.test_explorer_page import assert_theme
from vkbloom import Renderer, Scene

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")

SCRIPT = '<script type="module" src="host.js"></script>'
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
widget.render({ model, el: document.body.appendChild(document.createElement("div")) });
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
        "/": ("text/html", '<link rel="stylesheet" href="page.css"><body>' + SCRIPT),
        "/host.js": ("text/javascript", HOST),
        "/page.js": ("text/javascript", (FILES / "page.js").read_text()),
        "/page.css": ("text/css", (FILES / "page.css").read_text()),
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
    wait_until(lambda: wait_for_picture(page) != before)
    assert explorer.settings == vkbloom.DualKawase().replace(
        **{name: getattr(explorer.settings, name) for name in ("tonemap", "encoding", "exposure")}
    )
    # Files to the kernel are text, too.
    picture = base64.b64decode(sent[-1]["pictures"][0])
    page.get_by_label("image or settings").set_input_files(
        {"name": "other.png", "mimeType": "image/png", "buffer": picture}
    )
    page.get_by_text("other.png").first.wait_for()
    # The names of JupyterLab's themes, and of marimo's.
    for name, values in {"jp-theme-light": ("true", "false"), "theme": ("light", "dark")}.items():
        for value, theme in zip(values, ("light", "dark"), strict=True):
            page.evaluate(f"document.body.setAttribute('data-{name}', '{value}')")
            assert_theme(page, theme)
        page.evaluate(f"document.body.removeAttribute('data-{name}')")
    page.close()
