"""A file of a custom method that is edited while a browser shows it."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import numpy as np
import pytest

import vkbloom
from tests.explorer.explorer_hosts import CHROMIUM
from tests.explorer.pages import Viewer
from tests.explorer.test_custom_files import TEXT, file, save  # noqa: F401
from tests.explorer.test_explorer_page import field, open_page, see
from vkbloom import Renderer

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = [
    pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed"),
    pytest.mark.usefixtures("glslang"),
]


def test_an_edited_file(
    browser: Browser,
    serve: Any,
    renderer: Renderer,
    file: Path,  # noqa: F811
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The picture follows each save. A broken text says the line, and the last picture stays."""
    image = np.full((36, 64, 3), 0.1, np.float32)
    kind: Any = vkbloom.load_method(file)
    begun = kind(gain=3)
    with open_page(browser, serve(lambda: Viewer(image, begun, renderer=renderer))) as page:
        field(page, "gain").fill("1")
        page.locator(".vkb-foot code", has_text="gain=1.0").wait_for()
        page.wait_for_function(LEVEL_IS, arg=level(0.2))
        error = page.locator(".vkb-file-error")

        began = time.perf_counter()
        save(file, TEXT.replace("return gain", "return vec4(2, 0, 0, 1) * gain"))
        page.wait_for_function(LEVEL_IS, arg=level(0.3), polling=10)
        seconds = time.perf_counter() - began
        with capsys.disabled():
            print(f"\nfrom saving a file to its picture: {1e3 * seconds:.0f} ms")
        assert not error.is_visible()
        before = see(page, file.parent)

        save(file, TEXT.replace("GLOW_tex(GLOW_pos)", "GLOW_text(GLOW_pos)"))
        error.wait_for()
        text = error.inner_text().splitlines()
        assert text[0].startswith(f"{file}:15: ")
        assert text[1].strip() == "vec4 glow = GLOW_text(GLOW_pos);"
        # Controls still work, by the text before.
        field(page, "gain").fill("0")
        page.wait_for_function(LEVEL_IS, arg=level(0.1))
        field(page, "gain").fill("1")
        page.wait_for_function(LEVEL_IS, arg=level(0.3))
        assert np.array_equal(see(page, file.parent), before)

        # A field that is gone takes its value with it; that of another one stays.
        mended = TEXT.replace("gain", "strength").replace("MAXIMUM 4", "MAXIMUM 8")
        save(file, mended)
        field(page, "strength").wait_for()
        assert error.is_hidden()
        assert field(page, "strength").input_value() == "2"
        assert field(page, "strength").get_attribute("max") == "8"
        assert field(page, "gain").count() == 0
        page.wait_for_function(LEVEL_IS, arg=level(0.3))
        # The address does not keep the method's text, so the page can be loaded again, also where
        # it has a field that is gone.
        fragment = quote(json.dumps({"a": {"method": kind.method, "gain": 1, "strength": 2}}))
        page.goto(f"{page.url.partition('#')[0]}#{fragment}")
        page.reload()
        page.wait_for_function(LEVEL_IS, arg=level(0.3))


def level(value: float) -> int:
    """Return a linear value's 8-bit level, as the page shows floats."""
    return int(255 * (1.055 * value ** (1 / 2.4) - 0.055) + 0.5)


#: Whether the red level in the middle of the picture is the argument, within rounding.
LEVEL_IS = """(expected) => {
    const canvas = document.querySelector(".vkbloom canvas");
    if (!canvas) return false;  // of a page that is loaded again
    const copy = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
    copy.drawImage(canvas, -(canvas.width >> 1), -(canvas.height >> 1));
    const [red] = copy.getImageData(0, 0, 1, 1).data;
    return Math.abs(red - expected) <= 2;
}"""
