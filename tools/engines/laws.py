"""Hold engines as they run to the laws of a bloom: python tools/engines/laws.py NAME=PYTHON...

Runs ``vkbloom check --command`` on each, which is about a hundred runs of the engine, and measures
it as tools/tables does the presets. Writes two tables of docs/evidence/engines.md.
"""

from __future__ import annotations

import json
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from compare import FOLDER, replace_in_page

import vkbloom
from vkbloom import testing

sys.path.append(str(Path(__file__).parents[1] / "tables"))
from presets import FLAT, FRAME, SHARES, VALUE, spread

#: For the laws: the engine's output that is its bloom, and its parameters.
LAWS = {
    "blender": ("glare", {"type": "bloom", "threshold": 0.0}),
    "pygfx": ("final", {"format": "rgba32float", "intensity": 1.0}),
}
#: For the figures: the same with the engine's own defaults, and the preset that is its port.
FIGURES = {
    "blender": ("glare", {"type": "bloom"}, "blender_bloom"),
    "pygfx": ("final", {"format": "rgba32float", "intensity": 1.0}, "pygfx"),
}


def program(name: str, python: str, output: str, parameters: dict[str, Any]) -> list[str]:
    """Return the engine as a program."""
    words = [python, str(FOLDER / "apply.py"), name, output, json.dumps(parameters)]
    return [*words, "{input}", "{output}"]


def check_engine(name: str, python: str) -> dict[str, Any]:
    """Return what the check prints of an engine."""
    command = [sys.executable, "-m", "vkbloom", "check", "--json"]
    command += ["--suffix", ".pfm", "--timeout", "300"]
    words = program(name, python, *LAWS[name])
    # Engines promise one gain, whatever it is.
    engine = testing.command(words, suffix=".pfm", timeout=300.0)
    command += ["--gain", str(testing.report(engine, laws=["gain"]).gain)]
    done = subprocess.run(
        [*command, "--command", shlex.join(words)], check=True, stdout=subprocess.PIPE
    )
    return json.loads(done.stdout)  # type: ignore[no-any-return]


def laws(name: str, found: dict[str, Any]) -> list[str]:
    """Return a line of the table for each law that is not held."""
    lines = []
    for law, verdict in found["laws"].items():
        if verdict["held"]:
            continue
        held = "broken" if verdict["held"] is False else "not tested"
        off = "" if verdict["off"] is None else f"{verdict['off']:.2g}"
        lines.append(f"| {name} | `{law}` | {held} | {off} |")
    return lines


def figures(name: str, bloom: Callable[[Any], Any]) -> str:
    """Return a line with the gain and the spread of a bloom."""
    width, height = FRAME
    point = np.zeros((height, width, 3), np.float32)
    point[height // 2 - 1 : height // 2 + 2, width // 2 - 1 : width // 2 + 2] = VALUE
    gain = bloom(np.full_like(point, FLAT))[height // 2, width // 2, 0] / FLAT
    light = bloom(point)[..., 0].astype(np.float64)
    share, radii = spread(light, float(point[..., 0].sum()))
    cells = (f"{gain:.3g}", f"{share:.3g}", *(f"{radius:.0f}" for radius in radii))
    return f"| {name} | {' | '.join(cells)} |"


def main() -> None:
    """Measure, and write the tables."""
    held = ["| engine | law | | off by |", "|---|---|---|---|"]
    heads = ("", "gain", "light of a point", *(f"{share:.0%} within" for share in SHARES))
    measured = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    with vkbloom.Renderer("software") as renderer:
        for name, _, python in (engine.partition("=") for engine in sys.argv[1:]):
            *given, preset = FIGURES[name]
            engine = testing.command(program(name, python, *given), suffix=".pfm", timeout=300.0)
            port = vkbloom.presets[preset].replace(format="rgba32float")
            measured += [
                figures(name, engine),
                figures(
                    f"`{preset}`",
                    lambda image, port=port: renderer.apply(image, port)["bloom"],
                ),
            ]
            held += laws(name, check_engine(name, python))
    replace_in_page("figures", "\n".join(measured))
    replace_in_page("laws", "\n".join(held))


if __name__ == "__main__":
    main()
