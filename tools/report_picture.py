"""Make docs/pictures/report.png: the report of a bloom whose weights are wrong, in Chromium."""

from __future__ import annotations

import argparse
import contextlib
import shutil
import tempfile
from pathlib import Path

from playwright.sync_api import sync_playwright

import vkbloom
from vkbloom.testing.records import Record
from vkbloom.testing.regression import FrameRegression, Mode
from vkbloom.testing.report_page import write_report

SIZE = (1280, 1180)


def write(folder: Path) -> Path:
    """Write a report that compares two settings of the saucer."""
    right = vkbloom.Separable(format="rgba16float")
    weights = list(right.weights)
    weights[1] *= 0.9
    records: list[Record] = []
    with vkbloom.Renderer("software") as renderer:
        expected, actual = (
            renderer.render(
                vkbloom.Scene.ufo(), settings, (640, 360), attachments=("glow", "blur_vertical")
            )
            for settings in (right, right.replace(weights=weights))
        )
    regression = FrameRegression(
        folder=folder,
        test="tests/test_saucer.py::test_glow",
        name="saucer",
        mode=Mode(parts=folder / "parts"),
        records=records,
    )
    with contextlib.suppress(AssertionError):
        regression.compare(actual, expected)
    return write_report(folder, folder / "parts", records)


def main() -> None:
    """Write the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("docs/pictures/report.png"))
    target = parser.parse_args().out
    browser = shutil.which("chromium") or shutil.which("chromium-browser")
    if browser is None:
        raise SystemExit("Chromium is not installed")
    with tempfile.TemporaryDirectory() as name, sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=browser, args=["--no-sandbox"])
        size = {"width": SIZE[0], "height": SIZE[1]}
        page = opened.new_page(viewport=size, color_scheme="light")
        page.goto(write(Path(name)).as_uri())
        page.screenshot(path=target, full_page=True)
        opened.close()
    print(target)


if __name__ == "__main__":
    main()
