"""Run `vkbloom check` on every preset, and write the tables of docs/check.md.

python tools/check_table.py docs/check_table.md

Took 19 minutes on two cores with other load.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from click.testing import CliRunner
from tqdm import tqdm

import vkbloom
from vkbloom._cli.program import program

# Wide blooms need large images.
SIZE = "512x512"
LAWS = {True: "yes", False: "**no**", None: "?"}


def checked(preset: str, adapter: str) -> dict[str, Any]:
    """Return what the command prints for a preset."""
    words = ["check", "--preset", preset, "--json", "--measure-size", SIZE, "--adapter", adapter]
    # In one process, which renders the nearest presets once.
    done = CliRunner().invoke(program, words, catch_exceptions=False)
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def shown(number: float | None, factor: float = 1.0) -> str:
    """Return a figure to two digits, and what is nearly nothing as 0."""
    if number is None:
        return "none"
    value = float(f"{factor * number:.2g}")
    return "0" if abs(value) < 1e-3 else f"{value:g}"


def table(rows: list[list[str]]) -> str:
    """Return rows as Markdown."""
    rows.insert(1, ["---"] * len(rows[0]))
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def main() -> None:
    """Check all presets, and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--adapter", default="software")
    arguments = parser.parse_args()
    all_found = {name: checked(name, arguments.adapter) for name in tqdm(vkbloom.presets)}
    first = next(iter(all_found.values()))
    laws = [["preset", *(name.replace("_", " ") for name in first["laws"])]]
    figures = [
        [
            "preset",
            "gain",
            "energy",
            "50 % within, pixels",
            "90 % within, pixels",
            "ripple, %",
            "jitter, pixels",
            "shimmer, %",
            "veiling glare, %",
            "from its reference",
            "nearest preset",
        ]
    ]
    for name, found in all_found.items():
        laws.append([f"`{name}`", *(LAWS[law["held"]] for law in found["laws"].values())])
        psf, steady, near = found["psf"], found["stability"], found["nearest_preset"]
        figures.append(
            [
                f"`{name}`",
                shown(found["gain"]),
                shown(found["energy"]),
                *(shown(psf[key]) for key in ("r50", "r90")),
                shown(steady["ripple"], 100),
                shown(steady["jitter"]),
                shown(steady["shimmer"], 100),
                shown(found["veiling_glare_index"]),
                f"{max(found['reference'].values()):.1g}",
                f"`{near['name']}`, {shown(near['difference'], 100)} %",
            ]
        )
    arguments.file.write_text(
        f"On {first['adapter']}.\n\n{table(laws)}\n{table(figures)}", encoding="utf-8"
    )


if __name__ == "__main__":
    main()
