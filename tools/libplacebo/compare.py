"""Compare custom methods with libplacebo: python tools/libplacebo/compare.py APPLY FOLDER.

APPLY is the program that build.sh makes. FOLDER has user shaders. Each file that libplacebo runs is
loaded and run by vkbloom under validation; the table says the largest difference over the largest
value of libplacebo's frame. Renders that are kept (--kept FOLDER: index.json, inputs.npz and
outputs.npz) are drawn again by APPLY first. With --page, the table goes to a page.
"""

from __future__ import annotations

import argparse
import collections
import json
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import vkbloom

#: Over the largest value of libplacebo's frame.
LIMIT = 1e-3
ENDS = ("*.glsl", "*.hook")
#: Of the picture that every file gets; even sides, since some shaders need them.
WIDTH, HEIGHT = 64, 48
SECONDS = 300
#: Frames of the one picture; the last is compared. A second one shows what STORAGE kept.
FRAMES = 2

Array = NDArray[Any]


class Row(NamedTuple):
    """A file: the words about both, the seconds that vkbloom took, and the difference."""

    file: str
    theirs: str
    ours: str
    seconds: float
    difference: float | None


class RefusedError(Exception):
    """What libplacebo says about a file that it does not run."""


def draw(apply: str, file: Path, image: Array, frames: int, values: Mapping[str, Any]) -> Array:
    """Return the picture that libplacebo makes of an image."""
    height, width = image.shape[:2]
    command = [apply, str(file), str(width), str(height), str(frames)]
    command += [f"{name}={value}" for name, value in values.items()]
    done = subprocess.run(
        command, check=False, input=image.tobytes(), capture_output=True, timeout=SECONDS
    )
    if done.returncode:
        lines = done.stderr.decode(errors="replace").splitlines()
        raise RefusedError(next((line for line in lines if "error" in line), lines[-1]))
    width, height = np.frombuffer(done.stdout[:8], np.int32)
    return np.frombuffer(done.stdout[8:], np.float32).reshape(height, width, 4)


def picture() -> Array:
    """Return an image with smooth parts, edges, noise, and values above 1; alpha is 1.

    No two pixels are equal, and with this seed no window's median or mode is decided by rounding:
    with others up to five pixels differ, whose weights are a tie but for the error of exp().
    """
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    smooth = 0.5 + 0.4 * np.stack([np.sin(x / 7), np.cos(y / 5), np.sin((x + y) / 9)], -1)
    smooth[(x // 16 + y // 12) % 2 == 0] *= 0.3
    smooth[20:24, 30:34] = (5.0, 2.5, 1.5)
    noise = np.random.default_rng(36).random((HEIGHT, WIDTH, 3))
    colour = 0.8 * smooth + 0.2 * noise
    return np.dstack([colour, np.ones((HEIGHT, WIDTH))]).astype(np.float32)


def repeat(apply: str, folder: Path) -> Iterator[tuple[str, float]]:
    """Yield name and largest difference of each kept render when it is drawn again."""
    with np.load(folder / "inputs.npz") as inputs, np.load(folder / "outputs.npz") as outputs:
        for case in json.loads((folder / "index.json").read_text())["renders"]:
            image = np.ascontiguousarray(inputs[case["input"]], np.float32)
            got = draw(apply, folder / case["hooks"][0], image, case["frames"], case["params"])
            yield case["key"], float(np.abs(got - outputs[case["key"]]).max())


def compare(apply: str, folder: Path, file: Path, renderer: vkbloom.Renderer) -> Row:
    """Run a file with both."""
    image = picture()
    name = str(file.relative_to(folder))
    try:
        want = draw(apply, file, image, FRAMES, {})
        theirs = "unchanged" if np.array_equal(want, image) else "drawn"
    except RefusedError as refused:
        want, theirs = None, f"refused: {refused}"
    start = time.perf_counter()
    try:
        settings = vkbloom.load_method(file, name="compared")(format="rgba32float")
        *_, last = renderer.map([image] * FRAMES, settings, framebuffers="final")
        got = last["final"].astype(np.float64)
        ours = "drawn"
    except (ValueError, vkbloom.Error) as error:
        got, ours = None, f"refused: {str(error).splitlines()[0].removeprefix(f'{file}:')}"
    seconds = time.perf_counter() - start
    if want is None or got is None:
        return Row(name, theirs, ours, seconds, None)
    if got.shape != want.shape:
        return Row(name, theirs, f"another size: {got.shape}, {want.shape}", seconds, None)
    # Values that are no numbers must be at the same places.
    same = np.isnan(got) == np.isnan(want)
    error = np.abs(got - want)[~np.isnan(want) & same]
    largest = max(float(np.abs(np.nan_to_num(want)).max()), 1e-6)
    difference = float(error.max(initial=0.0)) / largest if same.all() else np.inf
    return Row(name, theirs, ours, seconds, difference)


def verdict(row: Row) -> str:
    """Return what was found of a file that libplacebo runs: same, differs or refused."""
    if row.theirs.startswith("refused"):
        return ""
    if row.difference is None:
        return "refused"
    return "same" if row.difference <= LIMIT else "differs"


def line_of(row: Row) -> str:
    """Return a row as a line of a table."""
    difference = "" if row.difference is None else f"{row.difference:.1e}"
    cells = (row.file, row.theirs, row.ours.partition(";")[0], difference)
    return "| " + " | ".join(cell.replace("|", "/") for cell in cells) + " |"


def with_table(text: str, rows: list[Row], words: str) -> str:
    """Return the text of a page with the table between its marks."""
    before, _, rest = text.partition("<!-- table -->\n")
    after = rest.partition("<!-- end -->\n")[2]
    lines = ["| repository | files with the same picture | largest difference |", "|---|---|---|"]
    same = [row for row in rows if verdict(row) == "same"]
    for name in sorted({row.file.partition("/")[0] for row in rows}):
        of = [row.difference or 0.0 for row in same if row.file.startswith(f"{name}/")]
        lines.append(f"| {name} | {len(of)} | {max(of, default=0.0):.1e} |")
    lines += [
        "",
        "The others:",
        "",
        "| file | libplacebo | vkbloom | difference |",
        "|---|---|---|---|",
    ]
    table = "\n".join([*lines, *(line_of(row) for row in rows if verdict(row) != "same")])
    return f"{before}<!-- table -->\n\n{words}\n\n{table}\n\n<!-- end -->\n{after}"


def main() -> None:
    """Compare, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("apply")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--kept", type=Path)
    parser.add_argument("--page", type=Path)
    parser.add_argument("--only", default="", help="a part of the files' names")
    arguments = parser.parse_args()
    if arguments.kept:
        for key, error in repeat(arguments.apply, arguments.kept):
            print(f"{key}: {error:.1e}")
    files = sorted(file for ends in ENDS for file in arguments.folder.rglob(ends))
    rows = []
    with vkbloom.Renderer("software", validation=True) as renderer:
        adapter = f"{renderer.info.name}, {renderer.info.driver_info}"
        for file in files:
            if arguments.only in str(file):
                rows.append(compare(arguments.apply, arguments.folder, file, renderer))
                said = f"{verdict(rows[-1]):<8}{line_of(rows[-1])} {rows[-1].seconds:.1f} s"
                print(said, flush=True)
    counts = collections.Counter(verdict(row) for row in rows)
    words = (
        f"libplacebo runs {len(rows) - counts['']} of {len(rows)} files. With {counts['same']} of "
        f"them vkbloom draws the same picture; it refuses {counts['refused']}, and "
        f"{counts['differs']} differ by more than {LIMIT:g}."
    )
    print(words)
    if arguments.page:
        text = arguments.page.read_text(encoding="utf-8")
        arguments.page.write_text(
            with_table(text, rows, f"{words} The device is {adapter}."), encoding="utf-8"
        )
    if counts["differs"]:
        sys.exit(1)


if __name__ == "__main__":
    main()
