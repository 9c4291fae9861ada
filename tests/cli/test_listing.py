"""``vkbloom presets``, ``psfs`` and ``glares``: one line each, JSON, and sheets of a picture."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result
from numpy.typing import NDArray
from rich.console import Console

import vkbloom
from vkbloom._cli import glares as glares_command
from vkbloom._cli import listing
from vkbloom._cli import presets as presets_command
from vkbloom._cli import psfs as psfs_command
from vkbloom._cli.program import program
from vkbloom._io.image_reading import load
from vkbloom._presets.named_glares import GLARES
from vkbloom._presets.named_settings import PRESETS
from vkbloom._settings.registry import STAGES
from vkbloom.psf._base import functions

pytestmark = pytest.mark.usefixtures("kept_renderers")


def run(*words: object) -> Result:
    return CliRunner().invoke(program, [str(word) for word in words])


NAMES = {
    "presets": list(vkbloom.presets),
    "glares": [*STAGES, *vkbloom.glares],
    "psfs": list(functions()),
}


@pytest.mark.parametrize("command", NAMES)
def test_one_line_each(command: str) -> None:
    result = run(command)
    assert result.exit_code == 0
    lines = [line.split() for line in result.stdout.splitlines() if line.strip()]
    assert lines[0] == ["name", "composite", "needs", "HDR", "what", "whose"]
    # Below the heading and its rule.
    assert [words[0] for words in lines[2:]] == NAMES[command]
    assert all(len(words) >= 5 for words in lines[2:])


def test_a_narrow_terminal_cuts_the_last_columns() -> None:
    printed = io.StringIO()
    console = Console(width=80, file=printed, force_terminal=True, color_system=None)
    entries = list(presets_command.entries())
    console.print(listing._table(entries))
    lines = [line.split() for line in printed.getvalue().splitlines() if line.strip()]
    assert [words[0] for words in lines[2:]] == NAMES["presets"]
    for words, entry in zip(lines[2:], entries, strict=True):
        assert words[1:3] == [entry.composite, "yes" if entry.needs_hdr else "no"]


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
        assert settings == list(vkbloom.presets.values())


def test_what_needs_values_above_1(renderer: vkbloom.Renderer) -> None:
    """Only those presets show nothing of white."""
    image = np.zeros((48, 64, 3), np.float32)
    image[16:32, 24:40] = 1
    found = {one.name: one.needs_hdr for one in presets_command.entries()}
    for name in ("tutorial", "kino", "unity_hdrp", "filament", "godot_4_6"):
        bloom = renderer.apply(image, vkbloom.presets[name], framebuffers=["bloom"])["bloom"]
        assert found[name] == (float(bloom[20:28, 28:36, :3].mean()) < 0.01)
    # The command line expands the picture for it.
    assert not found["photo"]


def tile(sheet: NDArray[Any], index: int, cell: tuple[int, int]) -> NDArray[Any]:
    """Return a tile of a sheet without a heading, in four columns."""
    (width, height), text = cell, max(11, cell[0] // 20)
    left = text + index % 4 * (width + text)
    top = text + index // 4 * (height + 4 * text)
    return sheet[top : top + height, left : left + width]


def photo(path: Path) -> Path:
    image = np.full((16, 24, 3), 20, np.uint8)
    image[6:10, 8:14] = 255
    return vkbloom.write(path, image)


def test_a_sheet_is_what_apply_makes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = ["kino", "filament", "photo"]
    monkeypatch.setattr(presets_command, "PRESETS", {name: PRESETS[name] for name in names})
    source, out = photo(tmp_path / "a.png"), tmp_path / "sheet.png"
    result = run("presets", "--sheet", source, "-o", out)
    assert (result.exit_code, result.stderr) == (0, "")
    assert result.stdout.endswith(f"wrote {out}\n")
    sheet = load(out).pixels
    cell = (480, 320)
    plain = load(source).pixels.repeat(20, axis=0).repeat(20, axis=1)
    np.testing.assert_array_equal(tile(sheet, 0, cell), plain)
    for index, name in enumerate(names, 1):
        # A preset that needs values above 1 gets them.
        expand = ("--expand", 4) if name == "filament" else ()
        one = tmp_path / f"{name}.png"
        assert run("apply", source, one, "--preset", name, *expand).exit_code == 0
        expected = load(one).pixels.repeat(20, axis=0).repeat(20, axis=1)
        difference = np.abs(tile(sheet, index, cell).astype(int) - expected)
        assert difference.max() <= 1
        # The name stands below, large enough to be read.
        text = sheet[index // 4 * (320 + 96) + 24 + 320 :][:48, index % 4 * 504 + 24 :][:, :480]
        assert (text > 150).any(axis=(1, 2)).sum() > 20


@pytest.mark.parametrize("command", ["glares", "psfs"])
def test_sheets_of_floats(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str) -> None:
    names = [*STAGES, "anamorphic"] if command == "glares" else ["gaussian", "samples", "spencer"]
    monkeypatch.setattr(glares_command, "GLARES", {"anamorphic": GLARES["anamorphic"]})
    monkeypatch.setattr(psfs_command, "functions", lambda: {one: functions()[one] for one in names})
    image = np.zeros((18, 12, 3), np.float32)
    image[8:10, 5:7] = 50
    source, out = vkbloom.write(tmp_path / "a.exr", image), tmp_path / "sheet.png"
    result = run(command, "--sheet", source, "-o", out, "--quiet")
    assert (result.exit_code, result.output) == (0, "")
    count = len(names) + 1 - ("samples" in names)
    sheet, cell = load(out).pixels, (320, 480)
    assert sheet.shape[0] == 16 + -(-count // 4) * (480 + 4 * 16)
    plain = tile(sheet, 0, cell)
    assert sum((tile(sheet, index, cell) != plain).any() for index in range(1, count)) > count / 2


def test_a_large_picture_is_reduced() -> None:
    image = np.ones((4, 4 * listing._LARGEST_SIDE, 4), np.float16)
    assert listing._reduced(image).shape == (1, listing._LARGEST_SIDE, 3)


def test_each_glare_is_seen_on_lamps(tmp_path: Path) -> None:
    """Lights are expanded until a glare shows what it is; the line of its tile says how far."""
    image = np.full((90, 160, 3), 12, np.uint8)
    for index, colour in enumerate(((255, 240, 200), (255, 60, 40), (120, 180, 255))):
        image[14 + 20 * index : 18 + 20 * index, 30 + 40 * index : 34 + 40 * index] = colour
    source, out = vkbloom.write(tmp_path / "a.png", image), tmp_path / "sheet.png"
    result = run("glares", "--sheet", source, "-o", out, "--quiet")
    assert result.exit_code == 0, result.output
    sheet, cell = load(out).pixels, (480, 270)
    count = 1 + len(STAGES) + len(GLARES)
    tiles = [tile(sheet, index, cell).astype(int) for index in range(count)]
    for index, one in enumerate(tiles):
        for other in tiles[index + 1 :]:
            assert (np.abs(one - other) > 16).any(axis=2).mean() > 5e-4
    # A file of floats has the light that it has.
    dim = vkbloom.write(tmp_path / "a.exr", np.full((18, 32, 3), 0.2, np.float32))
    result = run("glares", "--sheet", dim, "-o", out)
    assert "filament_flare shows nothing on " in result.stderr
    assert "takes values above 10" in result.stderr
