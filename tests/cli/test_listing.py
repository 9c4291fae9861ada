"""``vkbloom presets``, ``psfs`` and ``glares``: one line each, JSON."""

from __future__ import annotations

import io
import json

import numpy as np
import pytest
from rich.console import Console

import vkbloom
from tests.cli.calls import run
from vkbloom._cli import listing
from vkbloom._cli import presets as presets_command
from vkbloom._presets.named_glares import GLARES
from vkbloom._presets.named_settings import PRESETS
from vkbloom._settings.registry import STAGES
from vkbloom.psf._base import functions

pytestmark = pytest.mark.usefixtures("kept_renderers")


NAMES = {
    "presets": [entry["name"] for entry in presets_command.entries()],
    "glares": [*STAGES, *vkbloom.glares],
    "psfs": list(functions()),
}


@pytest.mark.parametrize("command", NAMES)
def test_one_line_each(command: str) -> None:
    result = run(command)
    assert result.exit_code == 0
    lines = [line.split() for line in result.stdout.splitlines() if line.strip()]
    confirmed = ["confirmed", "by"] if command == "presets" else []
    assert lines[0] == ["name", "composite", "needs", "HDR", *confirmed, "what", "whose"]
    # Below the heading and its rule. Names of engines end with a colon.
    rows = [words for words in lines[2:] if not words[-1].endswith(":")]
    assert [words[0] for words in rows] == NAMES[command]
    assert all(len(words) >= 5 for words in rows)


def test_presets_are_grouped_by_engine() -> None:
    assert sorted(NAMES["presets"]) == sorted(vkbloom.presets)
    lines = [line.strip() for line in run("presets").stdout.splitlines()]
    engines = [line for line in lines if line.endswith(":")]
    assert len(engines) == len(set(engines)) > 10
    unity = lines[lines.index("Unity:") : lines.index("Godot:")]
    assert [line.split()[3] for line in unity[1:]] == ["frames"] * 6


def test_a_narrow_terminal_cuts_the_last_columns() -> None:
    printed = io.StringIO()
    console = Console(width=80, file=printed, force_terminal=True, color_system=None)
    entries = list(presets_command.entries())
    console.print(listing._table(entries))
    lines = [line.split() for line in printed.getvalue().splitlines() if line.strip()]
    rows = [words for words in lines[2:] if not words[-1].endswith(":")]
    assert [words[0] for words in rows] == NAMES["presets"]
    for words, entry in zip(rows, entries, strict=True):
        assert words[1:3] == [entry["composite"], "yes" if entry["needs_hdr"] else "no"]


def test_what_is_said_of_presets_and_glares() -> None:
    text = run("presets").stdout
    for name, one in PRESETS.items():
        (line,) = (line for line in text.splitlines() if line.split()[:1] == [name])
        assert one.what in line
        assert one.whose in line
        assert line.split()[1] == one.make().composite
    assert all(one.what in run("glares").stdout for one in GLARES.values())


@pytest.mark.parametrize("command", NAMES)
def test_json(command: str) -> None:
    found = json.loads(run(command, "--json").stdout)
    assert [one["name"] for one in found] == NAMES[command]
    for one in found:
        assert {"what", "whose", "composite", "needs_hdr"} <= set(one)
        assert one["what"]
        assert one["whose"]
    if command == "presets":
        settings = [vkbloom.Settings.from_dict(one["settings"]) for one in found]
        assert settings == [vkbloom.presets[one["name"]] for one in found]
        assert {one["confirmed"] for one in found} == {"frames", "binary", "formula"}


def test_what_needs_values_above_1(renderer: vkbloom.Renderer) -> None:
    """Only those presets show nothing of white."""
    image = np.zeros((48, 64, 3), np.float32)
    image[16:32, 24:40] = 1
    found = {one["name"]: one["needs_hdr"] for one in presets_command.entries()}
    for name in ("tutorial", "kino", "unity_hdrp", "filament", "godot_4_6"):
        bloom = renderer.apply(image, vkbloom.presets[name], framebuffers=["bloom"])["bloom"]
        assert found[name] == (float(bloom[20:28, 28:36, :3].mean()) < 0.01)
    # The command line expands the picture for it.
    assert not found["photo"]
