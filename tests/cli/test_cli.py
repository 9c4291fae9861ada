"""The command line: options, files, exit statuses and errors of one line."""

from __future__ import annotations

import dataclasses
import json
import os
import re
import subprocess
import sys
import termios
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import click
import numpy as np
import pytest
from click.testing import Result
from numpy.typing import NDArray

import vkbloom
from tests.cli.calls import COMMANDS, one_line
from tests.cli.calls import run as vkb
from tests.io.parts import reread
from tests.kinds import METHODS, fields_of
from tests.processes import python
from vkbloom import Camera, Scene
from vkbloom._cli import fields
from vkbloom._cli.settings_options import settings_options

pytestmark = pytest.mark.usefixtures("kept_renderers")

oiio = pytest.importorskip("OpenImageIO")

SAUCER = Path(__file__).parents[2] / "examples" / "saucer"
SMALL = ("--size", "48x32", "--bloom-size", "16x16")
SMALL_SETTINGS = vkbloom.Separable(bloom_size=(16, 16))


def pixels(path: Path) -> NDArray[Any]:
    return reread(path)[1]


def render(**arguments: Any) -> vkbloom.Frames:
    with vkbloom.Renderer() as renderer:
        scene = arguments.pop("scene", None) or Scene.ufo()
        settings = arguments.pop("settings", SMALL_SETTINGS)
        return renderer.render(scene, settings, (48, 32), **arguments)


def rgb(array: NDArray[Any]) -> NDArray[Any]:
    return array[..., :3]


# The program


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_help(name: str) -> None:
    result = vkb(name, "--help")
    assert result.exit_code == 0
    assert result.stdout.startswith(f"Usage: program {name}")
    assert result.stderr == ""
    assert re.search(rf"^  {name} +\w", vkb("--help").stdout, re.M)
    assert vkb("-V").stdout == f"program {vkbloom.__version__}\n"


Failing = Callable[[Callable[[], None]], Result]


@pytest.fixture
def failing(monkeypatch: pytest.MonkeyPatch) -> Failing:
    """Runs a command that fails as a function does."""

    def run_it(fail: Callable[[], None]) -> Result:
        monkeypatch.setattr("vkbloom._renderer.adapter.adapters", fail)
        return vkb("adapters")

    return run_it


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (vkbloom.DeviceLostError("the device\nis lost"), "the device is lost"),
        (FileNotFoundError(2, "No such file or directory", "a.png"), "a.png: No such file"),
        (OSError("damaged"), "damaged"),
        (ValueError("a.gltf: damaged"), "a.gltf: damaged"),
        (ModuleNotFoundError("pip install vkbloom[scenes]"), "pip install vkbloom[scenes]"),
        (MemoryError(), "memory is short"),
    ],
)
def test_a_failure_is_one_line_and_status_1(
    failing: Failing, error: BaseException, message: str
) -> None:
    def fail() -> None:
        raise error

    result = failing(fail)
    assert result.exit_code == 1
    assert one_line(result.stderr).startswith(message)


@pytest.mark.parametrize("caused", [None, AssertionError, OSError])
def test_an_interrupt_and_what_it_causes_are_status_130(
    failing: Failing, caused: type[Exception] | None
) -> None:
    def interrupt() -> None:
        try:
            raise KeyboardInterrupt
        finally:
            if caused is not None:
                raise caused("not started yet")

    result = failing(interrupt)
    assert (result.exit_code, result.stderr) == (130, "vkbloom: interrupted\n")


def test_a_mistake_of_the_program_is_not_hidden(failing: Failing) -> None:
    def fail() -> None:
        raise KeyError("missing")

    assert isinstance(failing(fail).exception, KeyError)


# Options from fields


@click.command(cls=fields.Command)
@settings_options
def choose(settings: vkbloom.Settings) -> vkbloom.Settings:
    return settings


def settings_from(*arguments: str) -> Any:
    return choose.main(list(arguments), standalone_mode=False)


@pytest.mark.parametrize("kind", METHODS.values(), ids=list(METHODS))
def test_every_field_of_every_method_is_an_option(kind: type[vkbloom.Settings]) -> None:
    parameters = choose.get_params(click.Context(choose))
    names = {option for parameter in parameters for option in parameter.opts}
    assert names >= {f"--{info.option.replace('_', '-')}" for info in fields_of(kind).values()}


def test_every_preset_is_there() -> None:
    for name, settings in vkbloom.presets.items():
        assert settings_from("--preset", name) == settings


@pytest.mark.parametrize(
    ("arguments", "changes"),
    [
        ("--blur-scale 0.5", {"blur_scale": 0.5}),
        ("--weights 0.2,0.1", {"weights": (0.2, 0.1)}),
        ("--weights 1", {"weights": (1.0,)}),
        ("--layers 1:1,2:0.5", {"layers": ((1.0, 1.0), (2.0, 0.5))}),
        ("--threshold 0.25 --knee 0.5", {"threshold": 0.25, "knee": 0.5}),
        ("--threshold none", {"threshold": None}),
        ("--no-bloom", {"bloom": False}),
        ("--bloom", {"bloom": True}),
        ("--direct", {"direct": True}),
        ("--bloom-size 320x200", {"bloom_size": (320, 200)}),
        ("--bloom-size none", {"bloom_size": None}),
        ("--format rgba16float", {"format": "rgba16float"}),
        ("--format none", {"format": None}),
        ("--threshold None", {"threshold": None}),
        ("--tonemap none", {"tonemap": "none"}),
        ("--tonemap agx --exposure -1.5", {"tonemap": "agx", "exposure": -1.5}),
        ("--loops 3 --first-tap 0 --texel x", {"loops": 3, "first_tap": 0, "texel": "x"}),
        ("--glare none", {"glare": ()}),
        ("--glare Streaks", {"glare": vkbloom.Streaks()}),
        ("--glare Anamorphic", {"glare": vkbloom.glares["anamorphic"]}),
        ("--tonemap ACES", {"tonemap": "aces"}),
        ("--glare anamorphic+halo", {"glare": (*vkbloom.glares["anamorphic"], vkbloom.Halo())}),
        (
            "--glare ghosts:scales=[1,-2],tints=[[1,0,0],[0,1,0]],falloff=3",
            {"glare": vkbloom.Ghosts(scales=(1, -2), tints=((1, 0, 0), (0, 1, 0)), falloff=3)},
        ),
        (
            "--glare streaks:directions=4,fade=0.5+halo",
            {"glare": (vkbloom.Streaks(directions=4, fade=0.5), vkbloom.Halo())},
        ),
    ],
)
def test_options_become_settings(arguments: str, changes: dict[str, Any]) -> None:
    assert settings_from(*arguments.split()) == vkbloom.Separable(**changes)


def test_options_change_a_preset() -> None:
    changed = settings_from("--preset", "outline", "--blur-strength", "2")
    assert changed == vkbloom.presets["outline"].replace(blur_strength=2.0)
    assert settings_from("--preset", "Kino") == vkbloom.presets["kino"]
    assert settings_from("--method", "Pyramid") == vkbloom.Pyramid()
    # None differs from what was not given.
    assert settings_from("--preset", "kino", "--threshold", "none").threshold is None


def test_a_method_has_no_field_of_another() -> None:
    changed = settings_from("--method", "pyramid", "--radius", "2", "--knee", "0.5")
    assert changed == vkbloom.Pyramid(radius=2.0, knee=0.5)


def command_of(kinds: dict[str, type[Any]]) -> click.Command:
    """Return a command whose result is the values of the classes' fields."""
    return click.command(cls=fields.Command)(fields.options(kinds, "found")(lambda found: found))


def test_the_help_of_an_option_is_the_fields_docstring() -> None:
    @dataclasses.dataclass
    class Lens:
        """Of a camera.

        Parameters
        ----------
        width, height : float
            In `mm`, 0.5 to 2. Not less.
        shape : {"round", "flat"}
            As seen
            from the front.

        Notes
        -----
        width : float
            Not this one.
        """

        width: float = 1.0
        height: float = 0.5
        shape: Literal["round", "flat"] = "flat"

    command = command_of({"": Lens, "big": Lens})
    parameters = command.get_params(click.Context(command))
    assert [(option.name, getattr(option, "help", None)) for option in parameters[:-1]] == [
        ("width", "In mm, 0.5 to 2 [default 1] In mm, 0.5 to 2 [big, default 1]"),
        ("height", "In mm, 0.5 to 2 [default 0.5] In mm, 0.5 to 2 [big, default 0.5]"),
        (
            "shape",
            "As seen from the front [default flat] As seen from the front [big, default flat]",
        ),
    ]


def options_in(text: str) -> set[str]:
    """Return the options that a part of a help describes."""
    return set(re.findall(r"^  (?:-\w, )?(--[a-z-]+)", text, re.M))


@pytest.mark.parametrize("name", ["apply", "render", "grid", "explore", "translate"])
def test_the_help_has_general_options_or_those_of_a_method(name: str) -> None:
    asked = "--help-all" if name == "apply" else "--help"
    general = vkb(name, asked).output
    assert {"--adapter", "--threshold", "--quiet"} <= options_in(general)
    assert not {"--blur-scale", "--levels"} & options_in(general)
    assert f"{name} --method NAME {asked} lists the settings of:" in general
    forms = (("--method", "kino"), ("--method=Kino",), ("--preset", "kino"))
    for words in forms if name == "apply" else forms[:1]:
        text = vkb(name, *words, asked).output
        names, described = re.split("Settings of the (?:preset kino, of the )?method kino:", text)
        # Kino's bloom is always added.
        fields = [one for one in fields_of(vkbloom.KinoBloom).values() if one.name != "composite"]
        assert options_in(described) == {f"--{one.option.replace('_', '-')}" for one in fields}
        assert "--adapter" in names
        assert "[default 2.5]" in described
        # A screen of 50 lines also has the call and the prompt.
        assert len(text.splitlines()) < 50


@pytest.mark.parametrize(
    ("words", "values"),
    [
        ((), {"intensity": "0.15", "threshold": "1", "low-frequency-boost": "0.7"}),
        (("--preset", "mist"), {"intensity": "0.15", "low-frequency-boost": "0.9"}),
        (("--preset", "film_halation"), {"halation-strength": "1.2,0.15,0.015"}),
        (("--preset", "star6"), {"psf": "star:rays=6,angle=30.0,surround=1.5"}),
        (("--preset", "iris_6"), {"psf": "aperture", "composite": "mix"}),
        (("--method", "pyramid"), {"levels": "6"}),
    ],
)
def test_the_short_help_has_the_values_that_a_call_starts_from(
    words: tuple[str, ...], values: dict[str, str]
) -> None:
    text = vkb("apply", *words, "--help").output
    assert len(text.splitlines()) < 60
    assert {"--preset", "--amount", "--help-all"} <= options_in(text)
    assert not {"--subimage", "--format", "--bloom-size"} & options_in(text)
    assert "mist, soft, dreamy" in text
    lines = " ".join(text.split())
    for name, value in values.items():
        assert re.search(
            rf"--{name} [^\[]*(\[[^\]]*\][^\[]*)?\[default {re.escape(value)}\]", lines
        ), name


# render


def test_render_writes_every_framebuffer(tmp_path: Path) -> None:
    result = vkb("render", "-o", tmp_path / "out.png", *SMALL)
    assert (result.exit_code, result.stderr) == (0, "")
    expected = render()
    depths = {"glow_depth", "depth"}
    files = {name: f"out_{name}.{'exr' if name in depths else 'png'}" for name in expected}
    # The picture is the file that was named.
    files["final"] = "out.png"
    assert {path.name for path in tmp_path.iterdir()} == {*files.values()}
    assert [*vkbloom.Frames.load(tmp_path / "out.png")] == [*expected]
    for name, array in expected.items():
        if name not in depths:
            assert (rgb(pixels(tmp_path / files[name])) == rgb(array)).all()


def test_render_tells_adapter_pass_times_and_files(tmp_path: Path) -> None:
    stdout = vkb("render", "-o", tmp_path / "out.exr", *SMALL).stdout
    with vkbloom.Renderer() as renderer:
        assert stdout.startswith(f"Rendering on {renderer.info.summary}\n")
        assert f"ms on the {'CPU' if renderer.info.type == 'cpu' else 'GPU'}" in stdout
    times = dict(re.findall(r"^ +(\w+) +(\d+\.\d{3})$", stdout, re.M))
    assert list(times) == list(render().timings)
    assert all(0 < float(time) < 60_000 for time in times.values())
    assert stdout.endswith(f"\nwrote {tmp_path / 'out.exr'}\n")


@pytest.mark.parametrize("out", ["folder", "folder/"])
def test_render_writes_into_a_folder(tmp_path: Path, out: str) -> None:
    result = vkb("render", "-o", f"{tmp_path}/{out}", *SMALL, "--framebuffers", "final,bloom")
    assert result.exit_code == 0
    assert {path.name for path in (tmp_path / "folder").iterdir()} == {"bloom.png", "final.png"}


@pytest.mark.parametrize(
    ("words", "scene", "changes"),
    [
        ("--shading deferred --glow-intensity 8", {"glow_intensity": 8}, {"shading": "deferred"}),
        (
            "--time 0.25 --blur-strength 3 --camera-position 0,0,-14 --camera-fov 30",
            {"camera": Camera(position=(0, 0, -14), fov=30)},
            {"settings": SMALL_SETTINGS.replace(blur_strength=3.0), "time": 0.25},
        ),
    ],
)
def test_options_of_render(
    tmp_path: Path, words: str, scene: dict[str, Any], changes: dict[str, Any]
) -> None:
    out = tmp_path / "out.png"
    result = vkb("render", "-o", out, *SMALL, "--framebuffers", "final", *words.split())
    assert result.exit_code == 0
    expected = render(scene=dataclasses.replace(Scene.ufo(), **scene), **changes)["final"]
    assert (rgb(pixels(out)) == rgb(expected)).all()
    # Each of them changes the picture.
    assert (rgb(expected) != rgb(render(**changes)["final"])).any()


def test_render_loads_scenes(tmp_path: Path) -> None:
    body, glow = SAUCER / "saucer.gltf", SAUCER / "saucer_glow.gltf"
    faces = [SAUCER / f"starfield_{face}.png" for face in ("px", "nx", "py", "ny", "pz", "nz")]
    skies = [word for face in faces for word in ("--skybox", face)]
    panorama = tmp_path / "panorama.png"
    stars = np.random.default_rng(1).integers(0, 256, (32, 64, 3), np.uint8)
    assert oiio.ImageBuf(stars).write(str(panorama))
    cases: list[tuple[str, tuple[str | Path, ...], Scene]] = [
        ("plain", (), Scene.from_gltf(body)),
        ("all", ("--glow", glow, *skies), Scene.ufo()),
        ("one", ("--skybox", panorama), Scene.from_gltf(body, skybox=panorama)),
    ]
    for name, options, scene in cases:
        out = tmp_path / f"{name}.png"
        wanted = ("--scene", body, "--framebuffers", "final", *options)
        result = vkb("render", "-o", out, *SMALL, *wanted)
        assert (result.exit_code, result.stderr) == (0, "")
        assert (rgb(pixels(out)) == rgb(render(scene=scene)["final"])).all()


def test_render_without_bloom_says_so(tmp_path: Path) -> None:
    result = vkb("render", "-o", tmp_path / "a.png", *SMALL, "--threshold", "2")
    assert result.exit_code == 0
    assert "no value is above the threshold 2" in result.stderr
    assert vkb("render", "-o", tmp_path / "a.png", *SMALL).stderr == ""


# adapters


@pytest.mark.parametrize(("options", "stdout"), [((), ""), (("--json",), "[]\n")])
@pytest.mark.skipif(sys.platform != "linux", reason="as the loader works on Linux")
def test_no_adapter_is_a_failure(options: tuple[str, ...], stdout: str) -> None:
    no_driver = {"VKBLOOM_DRIVER": "system", "VK_DRIVER_FILES": "/none/absent.json"}
    result = python("-m", "vkbloom", "adapters", *options, **no_driver)
    assert (result.returncode, result.stdout) == (1, stdout)
    assert "run vkbloom doctor" in one_line(result.stderr)


# As a process


# None in sys.modules makes an import fail as if nothing were installed.
EXTRAS = ("click", "rich", "tqdm", "OpenImageIO", "scipy", "skimage", "xarray")
BARE = """import sys
for name in {missing!r}: sys.modules[name] = None
from vkbloom._cli import main
main()"""


@pytest.mark.parametrize("missing", [*((one,) for one in EXTRAS[:3]), EXTRAS])
@pytest.mark.parametrize("words", [(), ("render", "-o", "x.png"), ("doctor", "--self-test")])
def test_a_missing_extra_is_one_line(missing: tuple[str, ...], words: tuple[str, ...]) -> None:
    ended = python("-c", BARE.format(missing=missing), *words)
    assert (ended.returncode, ended.stdout) == (1, "")
    line = one_line(ended.stderr)
    assert "pip install 'vkbloom[cli]'" in line
    assert "uvx 'vkbloom[all]' apply" in line


@pytest.mark.parametrize(
    "words", [("--version",), ("adapters",), ("adapters", "--json"), ("doctor",)], ids=" ".join
)
def test_without_extras_the_first_commands_work(words: tuple[str, ...]) -> None:
    ended = python("-c", BARE.format(missing=EXTRAS), *words)
    assert (ended.returncode, ended.stderr) == (0, "")
    if words[0] == "--version":
        assert ended.stdout == f"vkbloom {vkbloom.__version__}\n"
    elif words == ("adapters",):
        assert ended.stdout.splitlines() == [one.summary for one in vkbloom.adapters()]
    elif words == ("doctor",):
        assert "This machine can render." in ended.stdout
    else:
        found = [vkbloom.AdapterInfo(**entry) for entry in json.loads(ended.stdout)]
        assert tuple(found) == vkbloom.adapters() != ()


@pytest.mark.parametrize(("encoding", "name"), [("ascii", "\u2600"), ("latin-1", r"\u2600")])
def test_text_survives_a_plain_terminal(tmp_path: Path, encoding: str, name: str) -> None:
    out = str(tmp_path / "\u2600.exr")
    ended = python(*("-m", "vkbloom._cli", "render", "-o", out, *SMALL), PYTHONIOENCODING=encoding)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert "ms on the " in ended.stdout
    # click uses UTF-8 if the terminal's encoding is ASCII.
    assert ended.stdout.endswith(f"{name}.exr\n")


def test_without_standard_output_and_error(tmp_path: Path) -> None:
    """Some programs that start daemons close them."""
    wanted = ["--framebuffers", "final"]
    scene = ["render", "-o", str(tmp_path / "a.png"), *wanted, *SMALL]
    image = ["apply", str(tmp_path / "a.png"), str(tmp_path / "b.png")]
    for words in (scene, image):
        command = [sys.executable, "-m", "vkbloom._cli", *words]
        ended = subprocess.run(["sh", "-c", 'exec "$@" >&- 2>&-', "sh", *command], check=False)
        assert ended.returncode == 0
    assert {file.name for file in tmp_path.iterdir()} == {"a.png", "b.png"}


def test_several_images_show_their_progress_on_a_terminal(tmp_path: Path) -> None:
    try:
        ours, theirs = os.openpty()
    except OSError as error:
        pytest.skip(f"no terminal can be had here: {error}")
    termios.tcsetwinsize(theirs, (24, 80))
    images = [str(vkbloom.write(tmp_path / f"{i}.png", np.zeros((8, 8, 3)))) for i in (0, 1)]
    command = [sys.executable, "-m", "vkbloom._cli", "apply", *images, str(tmp_path / "out")]
    ended = subprocess.run(command, stdout=subprocess.PIPE, stderr=theirs, check=False)
    # Reading must not wait if there is no data.
    os.write(theirs, b"end")
    shown = os.read(ours, 65536).decode()
    os.close(theirs)
    os.close(ours)
    assert ended.returncode == 0
    assert "0/2" in shown
    assert "%" not in ended.stdout.decode()
