"""Compare the package with engines as they run: python tools/engines/compare.py NAME=PYTHON...

Each engine renders its table of cases (cases.py) with the Python of its own environment. The
largest differences over the largest value of a frame go to docs/evidence/engines.md. With --keep,
frames of the smallest image go to tests/methods/engine_frames.npz, which the tests compare.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import cases
import numpy as np

import vkbloom
from vkbloom import reference

FOLDER = Path(__file__).parent
PAGE = Path("docs/evidence/engines.md")
KEPT = Path("tests/methods/engine_frames.npz")
TABLES = {
    "blender": cases.of_blender,
    "blender-5.2": cases.of_blender_5_2,
    "pygfx": cases.of_pygfx,
}
#: Over the largest value of the engine's frame.
LIMIT = 1e-3
#: Of 8-bit frames the largest difference in levels of sRGB: lavapipe's conversions are off by one.
LEVELS = 2.5


class Row(NamedTuple):
    """A line of the table: what was compared, and the largest differences."""

    engine: str
    what: str
    cases: int
    of_reference: float
    of_device: float


def render(name: str, python: str, table: list[Any], folder: Path) -> Mapping[str, Any]:
    """Return the arrays of an engine, of which each case has some."""
    (folder / "cases.json").write_text(json.dumps(table))
    out = folder / f"{name}.npz"
    command = [python, str(FOLDER / "run.py"), name, str(folder / "cases.json"), str(out)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    with np.load(out) as arrays:
        return dict(arrays)


def settings_of(engine: str, fields: dict[str, Any]) -> vkbloom.Settings:
    """Return the settings of a case."""
    if engine == "pygfx":
        return vkbloom.PygfxBloom(**fields)
    if "kernel" in fields:
        fields = fields | {"kernel": cases.kernel(*fields["kernel"])}
    return vkbloom.BlenderGlare(format="rgba32float", **fields)


def comparable_outputs(frames: Mapping[str, Any], settings: vkbloom.Settings) -> dict[str, Any]:
    """Return what an engine's outputs are compared with, of frames of either kind."""
    outputs = {name: frames[name][..., :3] for name in ("glow", "final")}
    outputs["glare"] = settings.intensity * frames["bloom"][..., :3]
    return outputs


def levels(light: Any) -> Any:
    """Return the unrounded 8-bit levels of sRGB."""
    light = np.clip(light, 0, 1)
    return 255 * np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def difference(ours: Any, theirs: Any, format: str | None) -> float:
    """Return the largest difference over the largest value; in levels over the limit in them."""
    if format == "rgba8unorm-srgb":
        return float(np.abs(levels(ours) - levels(theirs)).max()) * LIMIT / LEVELS
    return float(np.abs(ours - theirs).max() / max(np.abs(theirs).max(), 1e-6))


def differences(
    name: str, table: list[Any], arrays: Mapping[str, Any], renderer: vkbloom.Renderer
) -> Iterator[tuple[str, float, float]]:
    """Yield for each case its kind, and the largest differences of reference and device."""
    for number, (picture, fields) in enumerate(table):
        settings = settings_of(name, fields)
        image = cases.image(picture)
        if name == "pygfx":
            # What the engine's texture held.
            image = arrays[f"{number}/glow"]
        both = (
            reference.apply(image.astype(np.float64), settings),
            renderer.apply(image, settings),
        )
        found = []
        for frames in both:
            outputs = comparable_outputs(frames, settings)
            found.append(
                max(
                    difference(outputs[key], array, settings.format)
                    for key in outputs
                    if (array := arrays.get(f"{number}/{key}")) is not None
                )
            )
        kind = fields["format"] if name == "pygfx" else fields["type"]
        yield kind, *found


def rows_of(name: str, table: list[Any], found: list[tuple[str, float, float]]) -> Iterator[Row]:
    """Yield a row for each kind of case."""
    for kind in dict.fromkeys(kind for kind, *_ in found):
        same = [one for one in found if one[0] == kind]
        yield Row(name, kind, len(same), max(one[1] for one in same), max(one[2] for one in same))


def table_of(rows: list[Row], versions: dict[str, str], adapter: str) -> str:
    """Return the table of the page."""
    lines = ["| engine | cases of | cases | reference | device |", "|---|---|---|---|---|"]
    lines += [
        f"| {row.engine} | {row.what} | {row.cases} "
        f"| {format_difference(row, row.of_reference)} | {format_difference(row, row.of_device)} |"
        for row in rows
    ]
    said = "; ".join(versions.values())
    return "\n".join([*lines, "", f"Versions: {said}. The device is {adapter}."])


def replace_in_page(mark: str, table: str) -> None:
    """Write a table into docs/evidence/engines.md, in the place of the one with this mark."""
    text = PAGE.read_text(encoding="utf-8")
    before, _, rest = text.partition(f"<!-- {mark} -->\n")
    after = rest.partition("<!-- end -->\n")[2]
    PAGE.write_text(
        f"{before}<!-- {mark} -->\n\n{table}\n\n<!-- end -->\n{after}", encoding="utf-8"
    )


def format_difference(row: Row, number: float) -> str:
    """Return a difference as the table has it."""
    if row.what == "rgba8unorm-srgb":
        return f"{number * LEVELS / LIMIT:.1f} levels"
    return f"{number:.1e}"


def keep(name: str, table: list[Any], arrays: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arrays of the cases that the tests compare, and their parameters."""
    found = {}
    for number, (picture, fields) in enumerate(table):
        if not cases.is_kept(name, picture, fields):
            continue
        found[f"{name}/{number}/fields"] = np.array(json.dumps(fields))
        found[f"{name}/{number}/image"] = arrays.get(f"{number}/glow", cases.image(picture))
        if name != "pygfx":
            found[f"{name}/{number}/image"] = cases.image(picture)
            if "kernel" in fields:
                found[f"{name}/{number}/kernel"] = cases.kernel(*fields["kernel"])
        for key in ("glow", "glare", "final"):
            if (array := arrays.get(f"{number}/{key}")) is not None:
                found[f"{name}/{number}/{key}"] = array
    return found


def main() -> None:
    """Compare, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("engines", nargs="+", metavar="NAME=PYTHON")
    parser.add_argument("--keep", action="store_true")
    arguments = parser.parse_args()
    rows, kept, versions = [], {}, {}
    with vkbloom.Renderer("software") as renderer, tempfile.TemporaryDirectory() as folder:
        for name, _, python in (engine.partition("=") for engine in arguments.engines):
            table = list(TABLES[name]())
            arrays = render(name, python, table, Path(folder))
            versions[name] = ", ".join(
                f"{key} {value}" for key, value in json.loads(str(arrays["versions"])).items()
            )
            rows += rows_of(name, table, list(differences(name, table, arrays, renderer)))
            kept |= keep(name, table, arrays)
            print(f"{versions[name]}: {len(table)} cases in {arrays['seconds']:.1f} s")
        adapter = f"{renderer.info.name}, {renderer.info.driver_info}"
    for row in rows:
        print(f"{row.engine:<12} {row.what:<24} {row.of_reference:.1e} {row.of_device:.1e}")
    replace_in_page("table", table_of(rows, versions, adapter))
    if arguments.keep:
        np.savez_compressed(KEPT, **kept)
    if any(max(row.of_reference, row.of_device) > LIMIT for row in rows):
        sys.exit(f"a difference is over {LIMIT:g}")


if __name__ == "__main__":
    main()
