"""`vkbloom check`: planted faults are named by the law that they break."""

from __future__ import annotations

import importlib.resources
import importlib.util
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import Result

import vkbloom
from tests.cli.calls import run
from tests.custom.engines import engine
from vkbloom import Renderer, testing
from vkbloom._cli.check import comparing, measuring
from vkbloom.testing._blooms import bloom_of, exact
from vkbloom.testing._law_report import law_report
from vkbloom.testing._laws.table import LAWS, merge_limits

pytestmark = pytest.mark.usefixtures("kept_renderers")

WITH_FILES = pytest.mark.skipif(
    importlib.util.find_spec("OpenImageIO") is None,
    reason="programs take and write image files: pip install vkbloom[images]",
)

# Small images: the figures are the same, the blooms narrow.
SMALL = ["--measure-size", "64x64", "--size", "64x48"]

GAUSSIAN = """\
vec4 hook() {{
    vec4 sum = vec4(0.0), total = vec4(0.0);
    for (int i = -12; i <= 12; i++) {{
        float w = exp(-0.5 * float(i * i) / 9.0);
        sum += w * {source}_texOff(vec2({along})), total += w;
    }}
    return sum / total;
}}
"""


def chain(first: str) -> str:
    """Return a file whose first pass is given; a Gaussian along both axes follows."""
    return (
        f"//!HOOK MAIN\n//!BIND GLOW\n//!SAVE FIRST\nvec4 hook() {{ {first} }}\n"
        "//!HOOK MAIN\n//!BIND FIRST\n//!SAVE ROWS\n//!WIDTH GLOW.w\n//!HEIGHT GLOW.h\n"
        + GAUSSIAN.format(source="FIRST", along="i, 0")
        + "//!HOOK MAIN\n//!BIND ROWS\n//!SAVE BLOOM\n//!WIDTH GLOW.w\n//!HEIGHT GLOW.h\n"
        + GAUSSIAN.format(source="ROWS", along="0, i")
    )


SOUND = chain("return GLOW_texOff(0);")
#: The laws that a correct Gaussian holds.
HELD = [
    name
    for name in LAWS
    if name not in {"bounded_fireflies", "resolution", "views", "field", "reference"}
]


def check(*words: str) -> tuple[Result, dict[str, Any]]:
    """Return the result of the command, and its values, which fit the published schema."""
    done = run("check", *words, "--json")
    assert done.exit_code in {0, 1}, done.output
    found = json.loads(done.stdout)
    schema = importlib.resources.files("vkbloom.testing").joinpath("check.schema.json")
    pytest.importorskip("jsonschema").validate(found, json.loads(schema.read_text()))
    return done, found


def of_text(folder: Path, text: str, *words: str) -> tuple[Result, dict[str, Any]]:
    file = folder / "planted.hook"
    file.write_text(text)
    return check(str(file), *SMALL, *words)


@pytest.mark.usefixtures("glslang")
def test_a_sound_bloom(tmp_path: Path) -> None:
    done, found = of_text(tmp_path, SOUND, "--require", ",".join(HELD))
    assert done.exit_code == 0, done.output
    assert {name for name, law in found["laws"].items() if law["held"]} == set(HELD)
    assert [one["name"] for one in found["passes"]][1:4] == ["first", "rows", "bloom"]
    assert found["gain"] == 1
    assert found["energy"] == pytest.approx(1, abs=1e-5)
    # A Gaussian of 3 pixels: half of the light is within 1.18 sigma.
    assert found["psf"]["r50"] == pytest.approx(1.1774 * 3, abs=0.5)
    assert found["reference"] is None


@pytest.mark.usefixtures("glslang")
def test_what_is_not_finite_is_named(tmp_path: Path) -> None:
    """With the file, the line of its pass and its framebuffer, which two passes blur after it."""
    path = tmp_path / "planted.hook"
    path.write_text("\n" + chain("vec4 none = GLOW_texOff(0) * 0.0; return none / none;"))
    done = run("check", str(path))
    assert done.exit_code == 1
    error = f"vkbloom: planted: {path}:2: the framebuffer 'first' is nan at x 0, y 0, channel 0 of"
    assert done.stderr.startswith(error), done.output
    assert done.stderr.count("\n") == 1


@pytest.mark.usefixtures("glslang")
def test_a_page_and_parameters(tmp_path: Path) -> None:
    examples = Path(__file__).resolve().parents[2] / "examples" / "custom_methods"
    page = tmp_path / "page.html"
    words = [str(examples / "forty_lines.hook"), "--spread", "2", *SMALL, "--html", str(page)]
    words += ["--reference", f"{examples / 'references.py'}:forty_lines", "--require", "reference"]
    done, found = check(*words)
    assert done.exit_code == 0, done.output
    assert found["settings"]["spread"] == 2
    assert set(found["reference"]) == {"half", "rows", "bloom", "final"}
    text = page.read_text()
    assert text.count("data:image/png") == 3
    assert "point spread, logarithmic" in text
    wrong = tmp_path / "wrong.py"
    wrong.write_text("def doubled(image, settings):\n    return {'bloom': 2 * image}\n")
    done, found = check(*words, "--reference", f"{wrong}:doubled", "--require", "reference")
    assert done.exit_code == 1
    assert "bloom is off by" in found["laws"]["reference"]["message"]


def test_a_preset(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    words = ["--preset", "dual_kawase", *SMALL, "--markdown", str(page)]
    done, found = check(*words, "--require", "symmetric,reference")
    assert done.exit_code == 0, done.output
    assert "| symmetric | yes | " in page.read_text()
    assert found["laws"]["bounded_fireflies"]["held"] is False
    assert found["nearest_preset"]["name"] == "unity_urp_dual"


def test_the_stored_blooms_of_presets(renderer: vkbloom.Renderer) -> None:
    with np.load(measuring.PRESET_BLOOMS) as stored:
        assert {*stored} == {*vkbloom.presets}
        for name, settings in vkbloom.presets.items():
            bloom = bloom_of(renderer, exact(settings), "bloom")
            made = measuring.sketch(bloom)
            off = np.abs(made - stored[name]).max() / made.max()
            assert off < 2e-3, f"{name} changed; run python -m tools.preset_blooms"


FIREFLIES = {"unclamped"}
#: Laws on colours and bright pixels that the formulas of engines break, and by what.
BY_FORMULA = {
    "jimenez2014": FIREFLIES,
    "bevy_natural": FIREFLIES,
    "unity_hdrp": FIREFLIES,
    "photo": FIREFLIES,
    "mist": FIREFLIES,
    "soft": FIREFLIES,
    "dreamy": FIREFLIES,
    "film_halation": {"grey"},
    # A screen, whose colours are clamped; the streak is blue.
    "star4": {"unclamped", "colour"},
    "star6": {"unclamped", "colour"},
    "anamorphic": {"unclamped", "colour", "grey"},
    # A limit for each channel, or a scale by the largest one.
    "filament": {"unclamped", "colour"},
    "godot_4_5": {"unclamped", "colour"},
    "godot_4_6": {"unclamped", "colour"},
    # A threshold of HSV's value, and colours of the ghosts and of the ends of the streaks.
    "blender_simple_star": {"colour"},
    "blender_ghosts": {"colour", "grey"},
    "blender_streaks": {"colour", "grey"},
    # Kernels whose channels differ.
    "unreal_convolution": {"colour", "grey"},
    "iris_6": {"colour", "grey"},
    # Film's layers differ.
    "halation": {"grey"},
    # Light leaves the picture, so that a flat one darkens towards its border.
    "spencer_photopic": {"colour"},
    "camera_lens": {"colour"},
    # Taps outside of the picture are 0, so that it darkens towards its border, too.
    "pmndrs": {"colour"},
}


@pytest.mark.parametrize("name", vkbloom.presets)
def test_presets_are_blamed_for_what_their_formulas_do(renderer: Renderer, name: str) -> None:
    subject = measuring.of_settings(renderer, vkbloom.presets[name], (48, 48), None)
    tested = ("unclamped", "colour", "grey", "channels", "finite")
    report = law_report(subject, merge_limits({}, tested))
    assert {row.name for row in report.rows if not row.held} == BY_FORMULA.get(name, set())


#: A fast program.
COPYING = "cp {input} {output}"
PROGRAM = """\
import sys, vkbloom
image = vkbloom.read(sys.argv[1])
settings = vkbloom.Separable(weights=(0.5, 0.25), blur_strength=1.0)
vkbloom.write(sys.argv[2], vkbloom.reference.blur(image, settings).astype("float32"))
"""


@pytest.mark.parametrize(
    ("bloom", "words", "laws"),
    [
        (
            lambda image: np.where(np.isnan(image).any(), np.nan, 0.97 * image),
            [],
            {"gain", "energy", "finite"},
        ),
        # (Neither option alone makes it right.)
        (lambda image: 1.97 * image, ["--less-input", "--gain", "0.97"], set()),
    ],
)
@WITH_FILES
def test_a_fault_of_a_program_is_named(
    tmp_path: Path, bloom: Callable[..., Any], words: list[str], laws: set[str]
) -> None:
    every = "stability,gain,energy,colour,channels,grey,unclamped,finite"
    with engine(tmp_path, bloom) as command:
        done, found = check("--command", command, *SMALL, *words, "--require", every)
    broken = {name for name in every.split(",") if found["laws"][name]["held"] is False}
    assert broken == laws
    assert all(f"required law {law}" in done.stderr for law in laws)
    assert done.exit_code == bool(laws)


@WITH_FILES
def test_programs_and_files_move_the_same_light() -> None:
    _, found = check("--command", COPYING, "--measure-size", "32x32", "--size", "64x48")
    alone = testing.stability(lambda image: image, steps=2, probe=testing.Probe(size=(32, 32)))
    assert found["stability"]["flicker"] == pytest.approx(alone.flicker)
    assert alone.flicker == pytest.approx(0.75)
    assert found["stability"]["shimmer"] == 0


@WITH_FILES
def test_required_laws_have_another_colour(tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    with engine(tmp_path, lambda image: 0.9 * np.roll(image, 1, 1)) as command:
        words = ["--command", command, *SMALL, "--require", "symmetric", "--html", str(page)]
        text = run("check", *words, color=True).output
    for law, colour in (("symmetric", "31"), ("energy", "33")):
        assert f"\x1b[{colour}m{law}" in text
    rows = page.read_text().split("<tr")
    for law, colour in (("symmetric", "#c33"), ("energy", "#b60")):
        assert f"color:{colour}" in next(row for row in rows if f">{law}" in row)
    assert "+1 pixels along x, on average" in text


@WITH_FILES
def test_a_program() -> None:
    """A required law that cannot be tested, as that of a reference, is not held."""
    require = "superposition,gain,symmetric,reference"
    words = ["--command", COPYING, "--suffix", ".png", *SMALL, "--require", require]
    done, found = check(*words)
    assert done.exit_code == 1
    assert "it writes 8 bits" in done.stderr
    held = {name: found["laws"][name]["held"] for name in require.split(",")}
    assert held == {"superposition": True, "gain": True, "symmetric": True, "reference": None}
    assert found["psf"]["r90"] == 0
    assert found["settings"] is None
    assert list(found["passes"][0]) == ["name", "seconds"]


@WITH_FILES
def test_a_program_that_blurs(tmp_path: Path) -> None:
    script = tmp_path / "blur.py"
    script.write_text(PROGRAM)
    bloom = testing.command([sys.executable, str(script), "{input}", "{output}"])
    image = np.zeros((9, 9, 3), np.float32)
    image[4, 4] = 1
    assert bloom(image)[3:6, 4, 0] == pytest.approx([0.125, 0.25, 0.125])


@pytest.mark.parametrize(
    ("script", "error", "words"),
    [
        ("sleep 99", TimeoutError, "did not end within 0.3 s"),
        ("echo no licence; exit 3", ChildProcessError, "status 3; it said: no licence"),
        (
            f"{sys.executable} -c 'print(1); {{}}[\"gpu\"]'; s=$?; echo bye; exit $s",
            ChildProcessError,
            "status 1; it said: KeyError: 'gpu'$",
        ),
        ("kill -SEGV $$", ChildProcessError, "was ended by SIGSEGV"),
        ("true", FileNotFoundError, "wrote no file"),
        ("echo junk > $2", ValueError, "cannot be read"),
        ("cp small.exr $2", ValueError, "wrote 4 x 3 pixels for 8 x 8"),
        ("cp nan.exr $2", ValueError, "wrote nan at x 2, y 1"),
    ],
)
@WITH_FILES
def test_what_a_program_does_wrong(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, script: str, error: type, words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    vkbloom.write("small.exr", np.ones((3, 4, 3), np.float32))
    broken = np.ones((8, 8, 3), np.float32)
    broken[1, 2] = np.nan
    vkbloom.write("nan.exr", broken)
    # A busy machine may take long to start the others.
    limit = 0.3 if error is TimeoutError else 60
    bloom = testing.command(["bash", "-c", script, "bash", "{input}", "{output}"], timeout=limit)
    with pytest.raises(error, match=words):
        bloom(np.ones((8, 8, 3), np.float32))


@WITH_FILES
def test_a_program_of_8_bits_is_noted() -> None:
    bloom = testing.command(COPYING.split(), suffix=".png")
    with pytest.warns(UserWarning, match="8 bits"):
        bloom(np.full((8, 8, 3), 0.5, np.float32))


@WITH_FILES
def test_a_program_that_fails_is_one_line() -> None:
    done = run("check", "--command", "false {input} {output}")
    assert done.exit_code == 1
    told = "command 'false': it failed with exit status 1; it said: nothing"
    assert done.output == f"vkbloom: {told}\n"


def test_veiling_glare_of_a_flat_share() -> None:
    """A bloom that spreads a tenth of the mean of the image."""
    index = testing.veiling_glare_index(
        lambda image: np.full_like(image, 0.1 * image.mean()), size=(40, 20), patch=(20, 10)
    )
    assert index == pytest.approx(100 * 0.1 * 0.75)
    with pytest.raises(ValueError, match="patch: "):
        testing.veiling_glare_index(lambda image: image, size=(40, 20), patch=20)


LEAKY = chain("return 0.9 * GLOW_texOff(0.5);")


@pytest.mark.usefixtures("glslang")
@pytest.mark.parametrize(
    ("text", "against", "verdict", "newly"),
    [
        (LEAKY, SOUND, "broken", ["gain", "symmetric"]),
        (SOUND, LEAKY, "mended", []),
        (LEAKY, LEAKY, "same", []),
    ],
    ids=["a bad change", "a good change", "none"],
)
def test_a_change_of_a_file(
    tmp_path: Path, text: str, against: str, verdict: str, newly: list[str]
) -> None:
    before = tmp_path / "before" / "planted.hook"
    before.parent.mkdir()
    before.write_text(against)
    page = tmp_path / "change.md"
    words = ["--require", "gain,symmetric,round", "--against", str(before)]
    done, found = of_text(tmp_path, text, *words, "--markdown", str(page))
    assert (done.exit_code, found["newly_broken"]) == (bool(newly), newly)
    verdicts = {one["name"]: one["verdict"] for one in found["changes"] if one["kind"] == "law"}
    assert {name for name, one in verdicts.items() if one == verdict} >= {"gain", "symmetric"}
    assert verdicts["round"] == "same"
    sides = [found[side]["gain"] for side in ("against", "bloom")]
    assert sides == pytest.approx([0.9 if one is LEAKY else 1 for one in (against, text)])
    written = page.read_text()
    assert ("| gain | " in written.partition("<details>")[0]) == (verdict != "same")
    assert written.startswith(f"### `planted` against `{before}`")


@WITH_FILES
def test_changes_of_presets_and_commands() -> None:
    words = ["--preset", "dual_kawase", "--against", COPYING, *SMALL]
    done = run("check", *words, "--require", "finite")
    assert (done.exit_code, "broken: " in done.stdout) == (0, True), done.output
    # A law that both break is not newly broken.
    words = ["--preset", "tutorial", "--against", "tutorial", *SMALL, "--require", "resolution"]
    done, found = check(*words)
    assert (done.exit_code, found["newly_broken"]) == (0, [])
    assert {one["verdict"] for one in found["changes"] if one["name"] != "together"} == {"same"}
    refused = run("check", *words[:2], "--against", "tutoral")
    assert (refused.exit_code, "tutorial" in refused.stderr) == (2, True)


@WITH_FILES
def test_what_a_program_does_not_take_is_not_tested() -> None:
    bloom = testing.command(["cp", "{input}", "{output}"])
    found = testing.report(bloom, size=(16, 16), laws=["views"])
    (views,) = found.rows
    assert (found.untaken, views.held, views.applies) == (("region", "time"), None, False)
    assert "takes no region and no time" in str(found)


@WITH_FILES
def test_a_program_that_fails_later_fails_its_laws(tmp_path: Path) -> None:
    """Where it is given NaN, four channels, or the lights of the nearest preset."""

    def failing(image: np.ndarray[Any, Any]) -> Any:
        if not np.isfinite(image).all() or image.shape[:2] not in {(64, 64), (48, 64)}:
            raise ArithmeticError
        return image

    with engine(tmp_path, failing) as command:
        done, found = check("--command", command, *SMALL, "--require", "finite")
    assert done.exit_code == 1
    assert found["laws"]["finite"]["held"] is False
    assert "it failed with exit status 1" in found["laws"]["finite"]["message"]
    assert found["laws"]["gain"]["held"] is True
    assert found["nearest_preset"] == {"name": None, "difference": None}


@WITH_FILES
def test_8_bits_are_said() -> None:
    words = ["--command", COPYING, *SMALL, "--suffix", ".png"]
    done, found = check(*words, "--require", "stability")
    assert (done.exit_code, found["bits"], found["stability"]) == (1, 8, None)
    assert "cannot be tested in 8 bits" in found["laws"]["stability"]["message"]
    assert check(*words[:-2])[1]["bits"] is None


@pytest.mark.parametrize("option", ["--html", "--markdown"])
@pytest.mark.parametrize(
    ("target", "words"),
    [("missing/page", "there is no folder missing"), (".", "Is a directory")],
)
def test_files_are_checked_before_the_work(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, option: str, target: str, words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    done = run("check", "--command", "cp {input} {output} ran", option, target)
    assert (done.exit_code, words in done.stderr) == (1, True), done.stderr
    assert "command 'cp'" not in done.stderr


@WITH_FILES
def test_each_run_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[str] = []
    monkeypatch.setattr("rich.status.Status.update", lambda _, text: shown.append(text))
    words = ["--command", COPYING, *SMALL, "--measure-size", "32x32"]
    done, _ = check(*words, "--suffix", ".png")
    assert done.exit_code == 0
    runs = [text for text in shown if ", run " in text]
    assert f"{COPYING}: gain, run 9 of 90" in runs
    last = int(runs[-1].split(", run ")[1].split()[0])
    assert abs(last - measuring.RUNS[True]) < 25


def test_untested_is_not_broken() -> None:
    def law(held: bool | None) -> dict[str, Any]:
        return {"held": held, "off": None if held is None else 1.0, "limit": 1.0}

    sides = [
        {"laws": {"gain": law(held)}, "passes": [], "together": {"shortest": 1, "longest": 1}}
        for held in (True, None, False)
    ]
    verdicts = {
        (old, new): comparing.changes(sides[old], sides[new])[0].verdict
        for old in range(3)
        for new in range(3)
    }
    assert verdicts == {
        (0, 0): "same",
        (0, 1): "changed",
        (0, 2): "broken",
        (1, 0): "changed",
        (1, 1): "same",
        (1, 2): "broken",
        (2, 0): "mended",
        (2, 1): "changed",
        (2, 2): "same",
    }


@pytest.mark.parametrize(
    ("before", "after", "verdict"),
    [
        # A copy on a busy machine: its shortest run is 1.41 times as long, within the spread.
        ((1.0, 1.5), (1.41, 1.6), "same"),
        ((1.0, 1.3), (1.41, 1.6), "worse"),
        ((1.41, 1.6), (1.0, 1.3), "better"),
        ((1.0, 1.05), (1.1, 1.2), "same"),
    ],
)
def test_a_time_changes_beyond_the_spread(
    before: tuple[float, float], after: tuple[float, float], verdict: str
) -> None:
    sides = [
        {
            "laws": {},
            "passes": [{"name": "final", "seconds": shortest}],
            "together": {"runs": 5, "shortest": shortest, "longest": longest},
        }
        for shortest, longest in (before, after)
    ]
    found = {one.name: one.verdict for one in comparing.changes(*sides)}
    assert (found["together"], found["final"]) == (verdict, "same")


def test_two_blooms_are_timed_in_turns() -> None:
    calls: list[str] = []

    def timer(name: str) -> Callable[[], dict[str, float]]:
        def run() -> dict[str, float]:
            calls.append(name)
            return {"a": 1.0 + len(calls), "b": 1.0}

        return run

    first, second = measuring.in_turns([timer("A"), timer("B")], 3)
    assert calls == ["A", "B"] * 3
    assert first["together"] == {"runs": 3, "shortest": 3.0, "longest": 7.0}
    assert second["passes"] == [{"name": "a", "seconds": 3.0}, {"name": "b", "seconds": 1.0}]
