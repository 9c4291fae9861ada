"""The built-in saucer with its bloom off and on: every framebuffer, and a sheet of all of them.

Writes into the folder ``--out``, by default ``out``:

- ``bloom_off/`` and ``bloom_on/``: each framebuffer as PNG, depth as OpenEXR
- ``bloom_on.exr``: all framebuffers of the second in one file
- ``contact_sheet.html``: a page with all framebuffers and the time of each pass
"""

from __future__ import annotations

from pathlib import Path

import click
from rich import box
from rich.console import Console
from rich.table import Table

import vkbloom

SIZE = (1280, 720)


def times(rendered: dict[str, vkbloom.Frames], device: str) -> Table:
    """Return a table of the time of each pass in milliseconds, with a column for each render."""
    table = Table(box=box.SIMPLE_HEAD)
    table.add_column(f"pass, ms on the {device}")
    for name in rendered:
        table.add_column(name.replace("_", " "), justify="right")
    # The longest list first, so that the passes keep the order in which they run.
    by_length = sorted(rendered.values(), key=lambda frames: -len(frames.timings))
    for name in dict.fromkeys(name for frames in by_length for name in frames.timings):
        seconds = [frames.timings.get(name) for frames in rendered.values()]
        table.add_row(name, *("-" if time is None else f"{1e3 * time:.3f}" for time in seconds))
    sums = [sum(frames.timings.values()) for frames in rendered.values()]
    table.add_section()
    table.add_row("all", *(f"{1e3 * time:.3f}" for time in sums))
    return table


@click.command(help=__doc__.splitlines()[0])
@click.option("--out", type=click.Path(path_type=Path), default=Path("out"), show_default=True)
@click.option("--adapter", default="auto", show_default=True, help="As for vkbloom.Renderer.")
def main(out: Path, adapter: str) -> None:
    """Render, write the pictures, and print their paths."""
    out.mkdir(parents=True, exist_ok=True)
    scene = vkbloom.Scene.ufo()
    rendered: dict[str, vkbloom.Frames] = {}
    for name, settings in {
        "bloom_off": vkbloom.Separable(bloom=False),
        "bloom_on": vkbloom.Separable(),
    }.items():
        # One renderer for each, so that every pass runs and is timed in both. The first frame, at
        # another time, only compiles the pipelines.
        with vkbloom.Renderer(adapter) as renderer:
            renderer.render(scene, settings, SIZE, time=0.5)
            rendered[name] = renderer.render(scene, settings, SIZE)
            info = renderer.info

    files = [path for name, frames in rendered.items() for path in frames.save(out / name)]
    files += rendered["bloom_on"].save(out / "bloom_on.exr")
    sheet = out / "contact_sheet.html"
    sheet.write_text(rendered["bloom_on"]._repr_html_())

    console = Console(markup=False, highlight=False)
    console.print(f"The saucer at {SIZE[0]} x {SIZE[1]} on {info.summary}", soft_wrap=True)
    console.print(times(rendered, "CPU" if info.type == "cpu" else "GPU"))
    for path in [*files, sheet]:
        console.print(f"  {path}", soft_wrap=True)


if __name__ == "__main__":
    main()
