"""Translate each preset into each other method, and write the matrix of docs/translations.md.

python tools/translate_table.py docs/translate_table.md
"""

from __future__ import annotations

import argparse
from pathlib import Path

from tqdm import tqdm

import vkbloom

SIZE = (240, 135)
CALLS = 40


def shown(found: vkbloom.FitResult) -> str:
    """Return the settings that were found, to three digits."""
    return ", ".join(
        f"{name} {value:.3g}"
        for name in found.vary
        if isinstance(value := getattr(found.settings, name), int | float)
    )


def main() -> None:
    """Translate, and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("path", type=Path)
    parser.add_argument("--adapter", default="software")
    arguments = parser.parse_args()
    # One preset of each method.
    kinds: dict[type, str] = {}
    for name, settings in vkbloom.presets.items():
        kinds.setdefault(type(settings), name)
    columns = list(kinds.values())
    head = ["from / to", *(f"`{name}`" for name in columns)]
    lines, closest = [head, ["---"] * len(head)], []
    with vkbloom.Renderer(arguments.adapter) as renderer:
        for source, settings in tqdm(vkbloom.presets.items()):
            cells, found = [], {}
            for name in columns:
                if type(settings) is type(vkbloom.presets[name]):
                    cells.append("")
                    continue
                found[name] = vkbloom.translate(
                    settings, vkbloom.presets[name], size=SIZE, renderer=renderer, max_calls=CALLS
                )
                cells.append(f"{found[name].loss:.2g}")
            lines.append([f"`{source}`", *cells])
            best = min(found, key=lambda name: found[name].loss)
            closest.append([f"`{source}`", f"`{best}`", shown(found[best])])
        summary = renderer.info.summary
    best_head = [["preset", "closest", "with"], ["---"] * 3]
    text = "".join(f"| {' | '.join(line)} |\n" for line in lines)
    text += "\n" + "".join(f"| {' | '.join(line)} |\n" for line in [*best_head, *closest])
    size = f"{SIZE[0]} x {SIZE[1]} pixels, at most {CALLS} renders for each"
    arguments.path.write_text(f"On {summary}, {size}.\n\n{text}")


if __name__ == "__main__":
    main()
