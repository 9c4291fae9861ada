"""What commands print with --quiet, and completion."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from click.shell_completion import ShellComplete

import vkbloom
from tests.cli.calls import one_line, program, run
from tests.framebuffers import write_image
from tests.grid.stores import contents
from tests.images import noise_image
from tests.kinds import STAGES
from tests.refusals import assert_matches, rows
from vkbloom import psf
from vkbloom._presets import named_settings

pytestmark = pytest.mark.usefixtures("kept_renderers")


@pytest.fixture
def dark(tmp_path: Path) -> Path:
    """A picture about which there is a note: nothing in it glows."""
    return vkbloom.write(tmp_path / "dark.exr", np.full((12, 16, 3), 0.1, np.float32))


def test_long_and_unprintable_texts_are_one_short_line(tmp_path: Path) -> None:
    layers = [f"layer{number:05d}{'x' * 90}" for number in range(300)]
    names = [f"{layer}.{name}" for layer in layers for name in "RGB"]
    channels = np.zeros((2, 2, len(names)), np.float16)
    file = write_image(tmp_path / "many.exr", channels, "half", channelnames=names)
    settings = tmp_path / "long.json"
    settings.write_text(json.dumps({"method": "x" * 270_000}))
    names = ["red\x1b[31m.png", "\N{RIGHT-TO-LEFT OVERRIDE}gnp.exe", "line\nbreak.png"]
    for words, end in [
        (("apply", file, "o.png"), "name one as the layer to read"),
        (("apply", file, "o.png", "--layer", "x" * 100_000), ""),
        (("apply", "y.png", "o.png", "--settings", settings), ""),
        (("apply", "y" * 100_000, "o.png"), ""),
        (("apply", "y.png", "o.png", "--preset", "z" * 100_000), ""),
        *((("apply", name, "o.png"), "") for name in names),
    ]:
        result = run(*words)
        assert result.exit_code > 0
        line = one_line(result.stderr).rstrip("\n")
        assert line.isprintable()
        assert len(line) <= 2000
        assert line.endswith(end)
    with pytest.raises(ValueError, match="the layers are") as caught:
        vkbloom.read(file)
    assert len(str(caught.value)) < 3000


@pytest.mark.parametrize(("place", "option"), [(0, "--quiet"), (1, "-q")])
def test_quiet(tmp_path: Path, dark: Path, place: int, option: str) -> None:
    words: list[object] = ["apply", dark, tmp_path / "o.png", "--preset", "kino"]
    usual = run(*words)
    assert "the bloom is zero everywhere" in usual.stderr
    assert usual.stdout.splitlines()[-1] == f"wrote {tmp_path / 'o.png'}"
    (tmp_path / "o.png").unlink()
    result = run(*words[:place], option, *words[place:])
    assert (result.exit_code, result.output) == (0, "")
    assert (tmp_path / "o.png").exists()
    # It ends with the call.
    assert run(*words).output == usual.output
    # Errors and results stay.
    assert run("apply", "none.png", tmp_path / "o.png", option).stderr.endswith("directory\n")
    assert vkbloom.adapters()[0].name in run("adapters", option).stdout


@pytest.mark.parametrize(
    "words",
    [
        ("render", "-o", "{tmp}/o.png", "--size", "16x12"),
        ("grid", "{dark}", "-o", "{tmp}/grid", "--axis", "exposure=0,1", "--preset", "kino"),
        ("compare", "{dark}", "{dark}", "--diff", "{tmp}/d.png"),
    ],
    ids=lambda words: words[0],
)
def test_other_commands_are_quiet(tmp_path: Path, dark: Path, words: tuple[str, ...]) -> None:
    result = run(*(word.format(tmp=tmp_path, dark=dark) for word in words), "--quiet")
    assert (result.exit_code, result.stderr) == (0, "")
    assert "wrote" not in result.stdout
    assert len(list(tmp_path.iterdir())) > 1


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        (["gl"], {"glares"}),
        (["apply", "--thresh"], {"--threshold", "--threshold-scale"}),
        (
            ["apply", "--preset", "unity"],
            {"unity_urp", "unity_urp_kawase", "unity_urp_dual", "unity_hdrp", "unity_ppv2"},
        ),
    ],
)
def test_completion(words: list[str], offered: set[str]) -> None:
    asked = ShellComplete(program, {}, "vkbloom", "_VKBLOOM_COMPLETE")
    assert {item.value for item in asked.get_completions(words[:-1], words[-1])} == offered


# Wrong use and failures of all commands: one line on standard error, a status, and no file.


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with pictures, damaged files and settings."""
    made = tmp_path_factory.mktemp("errors")
    levels = noise_image(16, 24, 3, dtype="uint8")
    (made / "two").mkdir()
    for name in ("a.png", "b.png", "two/a.png", "two/b.png"):
        vkbloom.write(made / name, levels)
    vkbloom.write(made / "small.png", levels[:6, :, :1])
    vkbloom.write(made / "foreign.png", levels, metadata={"Software": "a camera"})
    vkbloom.write(made / "alpha.png", np.dstack([levels, levels[..., :1]]))
    vkbloom.write(made / "a.exr", noise_image(16, 24, 3))
    write_image(made / "xyz.exr", noise_image(2, 2, 3), channelnames=("X", "Y", "Z"))
    files = {"{}": b"{}", "half.json": b"", "bad.gltf": b"{broken"}
    files["x.json"] = b'{"method": "kino", "x": 1}'
    files["kino.json"] = b'{"method": "kino"}'
    for suffix in ("png", "exr"):
        content = (made / f"a.{suffix}").read_bytes()
        files[f"cut.{suffix}"] = content[: len(content) // 2]
        files[f"bad.{suffix}"] = b"nothing of the kind"
    for name, content in files.items():
        (made / name).write_bytes(content)
    return made


@pytest.fixture
def unchanged(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The working folder, in which nothing changes."""
    monkeypatch.chdir(folder)
    before = contents(folder)
    yield
    assert contents(folder) == before


@pytest.mark.parametrize(("words", "error"), rows(__file__, "wrong use and failures"))
@pytest.mark.usefixtures("unchanged")
def test_errors_are_one_line_and_leave_nothing(words: str, error: str) -> None:
    """The status of the process stands before the message. Fields have tables of their own."""
    result = run(*words.split())
    assert all(line.startswith("Rendering on ") for line in result.stdout.splitlines())
    assert_matches(f"{result.exit_code}: {one_line(result.stderr)}", error)


# ``vkbloom presets``, ``psfs``, ``glares`` and ``exposures``: one line each, JSON.


PUBLISHED = {
    "presets": {*vkbloom.presets},
    "glares": {*STAGES, *vkbloom.glares},
    "psfs": {*psf.__all__} - {"PSF", "iris"},
    "exposures": {*vkbloom.exposures},
}
ENTRIES = {command: json.loads(run(command, "--json").stdout) for command in PUBLISHED}
NAMES = {command: [one["name"] for one in entries] for command, entries in ENTRIES.items()}


@pytest.mark.parametrize("command", NAMES)
def test_one_line_each(command: str) -> None:
    result = run(command)
    assert result.exit_code == 0
    lines = [line.split() for line in result.stdout.splitlines() if line.strip()]
    confirmed = ["confirmed", "by"] if command == "presets" else []
    kind = ["composite", "needs", "HDR"] if command != "exposures" else ["bloom", "reads"]
    assert lines[0] == ["name", *kind, *confirmed, "what", "whose"]
    # Below the heading and its rule. Names of engines end with a colon.
    rows = [words for words in lines[2:] if not words[-1].endswith(":")]
    assert [words[0] for words in rows] == NAMES[command]
    assert all(len(words) >= 4 for words in rows)


def test_presets_are_grouped_by_engine() -> None:
    for name, item in named_settings.PRESETS.items():
        assert item.engine in get_args(named_settings.Engine), f"{name}: engine is wrong"
        assert item.confirmed in get_args(named_settings.Confirmed), f"{name}: confirmed is wrong"
    with pytest.raises(TypeError, match="missing 1 required positional argument: 'engine'"):
        named_settings.Preset(  # type: ignore[call-arg]
            {"method": "kino"}, "a glow", "somebody", confirmed="frames"
        )
    lines = [line.strip() for line in run("presets").stdout.splitlines()]
    engines = [line for line in lines if line.endswith(":")]
    assert len(engines) == len(set(engines)) > 10
    unity = lines[lines.index("Unity:") : lines.index("Godot:")]
    assert [line.split()[3] for line in unity[1:]] == ["frames"] * 6


def test_a_narrow_terminal_cuts_the_last_columns() -> None:
    # A terminal without colours has 80 columns.
    printed = run("presets", env={"FORCE_COLOR": "1", "TERM": "dumb"}).stdout
    lines = [line.split() for line in printed.splitlines() if line.strip()]
    assert max(map(len, printed.splitlines())) <= 80
    rows = [words for words in lines[2:] if not words[-1].endswith(":")]
    assert [words[0] for words in rows] == NAMES["presets"]
    for words, entry in zip(rows, ENTRIES["presets"], strict=True):
        assert words[1:3] == [entry["composite"], "yes" if entry["needs_hdr"] else "no"]


@pytest.mark.parametrize("command", NAMES)
def test_json(command: str) -> None:
    found = ENTRIES[command]
    assert sorted(NAMES[command]) == sorted(PUBLISHED[command])
    for one in found:
        kind = {"bloom_reads"} if command == "exposures" else {"composite", "needs_hdr"}
        assert {"what", "whose", *kind} <= set(one)
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
    found = {one["name"]: one["needs_hdr"] for one in ENTRIES["presets"]}
    for name in ("tutorial", "kino", "unity_hdrp", "filament", "godot_4_6"):
        bloom = renderer.apply(image, vkbloom.presets[name], framebuffers=["bloom"])["bloom"]
        assert found[name] == (float(bloom[20:28, 28:36, :3].mean()) < 0.01)
    # The command line expands the picture for it.
    assert not found["photo"]
