"""Write the tables of docs/evidence, which pages include: ``make tables``.

``python tools/tables/write.py [--out docs/evidence] [NAME ...]``; without names all of them, which
takes an hour on two cores. Names are those of `TABLES`. With ``--presets mist,soft`` the tables of
presets keep their rows, and those of these presets replace them or are added.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Final

import antialiasing
import cells
import exposures
import fits
import presets
import psfs

import vkbloom

#: Functions of a renderer and of whether to measure a part only, by the name of the table's file.
TABLES: Final = {
    "check": presets.check,
    "exposures": exposures.laws,
    "antialiasing": antialiasing.orders,
    "derivatives": presets.derivatives,
    "measured": presets.measure,
    "stability": presets.stability,
    "resolution": presets.resolution,
    "psf": psfs.functions,
    "psf_pyramids": psfs.pyramids,
    "psf_presets": psfs.of_presets,
    "fit": fits.recovery,
    "fit_screenshots": fits.screenshots,
    "translate": fits.translations,
}
#: Those with a row for each preset.
OF_PRESETS: Final = ("check", "measured", "stability", "resolution", "psf_presets")


def main() -> None:
    """Measure, and write each table when it is complete."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(TABLES))
    parser.add_argument("--out", type=Path, default=Path("docs/evidence"))
    parser.add_argument("--adapter", default="software")
    parser.add_argument("--presets", metavar="NAME,...", help="rows of these presets alone")
    parser.add_argument("--quick", action="store_true", help="a part of each, as a check only")
    arguments = parser.parse_args()
    if arguments.presets:
        cells.ONLY += arguments.presets.split(",")
    names = arguments.names or (OF_PRESETS if cells.ONLY else TABLES)
    with vkbloom.Renderer(arguments.adapter) as renderer:
        for name in names:
            file = arguments.out / f"{name}_table.md"
            head = f"On {renderer.info.summary}.\n"
            old = file.read_text(encoding="utf-8") if cells.ONLY else head
            if not old.startswith(head):
                raise SystemExit(f"{file} is of another device: {old.partition(chr(10))[0]}")
            text = f"{head}\n{TABLES[name](renderer, arguments.quick)}"
            file.write_text(cells.merge_rows(old, text) if cells.ONLY else text, encoding="utf-8")
            print(file, flush=True)


if __name__ == "__main__":
    main()
