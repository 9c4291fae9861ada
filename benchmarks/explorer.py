"""Latency of the explorer: from a slider's move to the new picture, measured in the browser.

A slider is moved as a user would move it. The browser's clock is read when the picture of this
setting is on the canvas, and again when the browser has painted it, at most two animation frames
later. This is measured on the explorer's own page and, with ``--jupyterlab``, in JupyterLab, with
the scene at 640 x 360.

``make build/stamp/test`` installs what it needs: Chromium, playwright and JupyterLab.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np
from playwright.sync_api import sync_playwright
from rich import box
from rich.console import Console
from rich.table import Table

import vkbloom
from vkbloom.explorer.viewer import Viewer

# The tests' functions that start both pages.
sys.path.append(str(Path(__file__).parents[1]))
from tests.explorer.explorer_hosts import jupyterlab, served

if TYPE_CHECKING:
    from playwright.sync_api import Page

SIZE = (640, 360)
CELL = (
    "import vkbloom\nexplorer = vkbloom.explore(vkbloom.Scene.ufo(), shading='forward')\nexplorer"
)
# The range of each slider. They make different passes out of date: only the composite, the blur, or
# all passes.
SLIDERS = {
    "exposure": (-2.0, 2.0),
    "intensity": (0.0, 2.0),
    "blur_strength": (0.5, 3.5),
    "blur_scale": (0.2, 1.9),
    "time": (0.05, 0.95),
}

# Sets a slider to each value in turn, and returns milliseconds until drawn and until painted.
MEASURE = """async ([selector, values]) => {
    const root = document.querySelector(".vkbloom");
    const slider = root.querySelector(selector);
    const drawn = () => new Promise((done) =>
        root.addEventListener("vkbloom:drawn", done, { once: true }));
    const frame = () => new Promise(requestAnimationFrame);
    const times = [];
    for (const value of values) {
        // Start at a random time between two frames, as a user does.
        await new Promise((done) => setTimeout(done, 40 + 20 * Math.random()));
        slider.value = value;
        const shown = drawn();
        const began = performance.now();
        slider.dispatchEvent(new Event("input", { bubbles: true }));
        await shown;
        const onCanvas = performance.now();
        await frame();
        await frame();
        times.push([onCanvas - began, performance.now() - began]);
    }
    return times;
}"""


def fit(page: Page) -> None:
    """Resize the window until the picture has the size to be measured."""
    page.locator(".vkb-status", has_text="until shown").wait_for(timeout=60_000)
    for _ in range(4):
        shown = page.evaluate('document.querySelector(".vkb-stage").clientWidth')
        window = page.viewport_size
        assert window is not None
        if shown == SIZE[0]:
            break
        page.set_viewport_size({"width": window["width"] + SIZE[0] - shown, "height": 900})
        page.wait_for_timeout(500)
    page.locator(".vkb-status", has_text=f"{SIZE[0]} × {SIZE[1]}").wait_for(timeout=10_000)


def measured(page: Page, count: int) -> dict[str, np.ndarray[Any, Any]]:
    """Return (count, 2) milliseconds, until drawn and until painted, by slider."""
    found = {}
    for name, (low, high) in SLIDERS.items():
        selector = ".vkb-time input" if name == "time" else f"[data-field={name}]"
        # Every value differs from the one before, so that each picture is new.
        values = np.random.default_rng(0).permutation(np.linspace(low, high, count + 3))
        times = page.evaluate(MEASURE, [selector, [round(float(value), 3) for value in values]])
        found[name] = np.array(times)[3:]
    return found


@click.command(help=__doc__.splitlines()[0])
@click.option("--count", default=100, show_default=True, help="Moves of each slider.")
@click.option("--jupyterlab", "in_lab", is_flag=True, help="Measure in JupyterLab, too.")
@click.option("--adapter", default="software", show_default=True, help="As for vkbloom.Renderer.")
def main(count: int, in_lab: bool, adapter: str) -> None:
    """Measure, and print a table."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        raise click.ClickException("Chromium is not installed")
    results = {}
    with ExitStack() as stack:
        playwright = stack.enter_context(sync_playwright())
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        stack.callback(browser.close)
        renderer = stack.enter_context(vkbloom.Renderer(adapter))
        scene = vkbloom.Scene.ufo()
        url = stack.enter_context(
            served(lambda: Viewer(scene, shading="forward", renderer=renderer))
        )
        page = browser.new_page(viewport={"width": 1024, "height": 900})
        page.goto(url)
        fit(page)
        results["own page"] = measured(page, count)
        page.close()
        if in_lab:
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
            variables = {"VKBLOOM_ADAPTER": adapter}
            url = stack.enter_context(jupyterlab(folder, [CELL], variables))
            page = browser.new_page(viewport={"width": 1500, "height": 900})
            page.goto(url)
            page.get_by_text("Python 3 (ipykernel) | Idle").wait_for(timeout=60_000)
            page.locator(".jp-CodeCell .cm-content").first.click()
            page.keyboard.press("Shift+Enter")
            fit(page)
            results["JupyterLab"] = measured(page, count)
        summary = renderer.info.summary

    table = Table(box=box.SIMPLE_HEAD)
    for name in ("where", "slider", "drawn: median", "95 %", "painted: median", "95 %"):
        table.add_column(name, justify="left" if name in ("where", "slider") else "right")
    for where, sliders in results.items():
        every = {**sliders, "all": np.concatenate(list(sliders.values()))}
        for name, times in every.items():
            figures = [
                np.percentile(times[:, kind], share) for kind in (0, 1) for share in (50, 95)
            ]
            table.add_row(where, name, *(f"{figure:.0f}" for figure in figures))
    console = Console(markup=False, highlight=False, width=100)
    console.print(
        f"Milliseconds from a slider's move until the new picture is on the canvas, and until it "
        f"is painted; {SIZE[0]} x {SIZE[1]}, {count} moves each, {summary}"
    )
    console.print(table)


if __name__ == "__main__":
    main()
