"""Custom methods in the explorer: sliders of PARAM, and files that change while a page is open."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.explorer.pages import Viewer, as_code, controls, settings_from
from vkbloom import Renderer, Settings

pytestmark = pytest.mark.usefixtures("glslang")

TEXT = """\
//!PARAM gain
//!DESC what the bloom is multiplied by
//!TYPE float
//!MINIMUM 0
//!MAXIMUM 4
2
//!PARAM kind
//!TYPE ENUM int
plain
squared
//!HOOK MAIN
//!BIND GLOW
//!SAVE BLOOM
vec4 hook() {
    vec4 glow = GLOW_tex(GLOW_pos);
    return gain * (kind == 1 ? glow * glow : glow);
}
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "watched.hook"
    path.write_text(TEXT)
    return path


def save(path: Path, text: str) -> None:
    """Write a file as editors do, with another time even where clocks are coarse."""
    before = path.stat().st_mtime_ns
    path.write_text(text)
    os.utime(path, ns=(before + 10**9, before + 10**9))


def ask(viewer: Viewer, **message: Any) -> dict[str, Any]:
    answer, _ = viewer.answer(json.loads(json.dumps(message)))
    found: dict[str, Any] = json.loads(json.dumps(answer, allow_nan=False))
    return found


def show(viewer: Viewer, settings: dict[str, Any]) -> np.ndarray[Any, Any]:
    answer = ask(viewer, kind="frame", sides={"a": settings}, framebuffer="bloom")
    assert "error" not in answer["sides"]["a"], answer
    return viewer.frames["a"]["bloom"]


@pytest.fixture
def viewer(file: Path, renderer: Renderer) -> Viewer:
    image = np.full((8, 8, 3), 0.5, np.float32)
    return Viewer(image, vkbloom.load_method(file)(), renderer=renderer)


class TestControls:
    def test_sliders_come_from_param(self, file: Path) -> None:
        vkbloom.load_method(file)
        fields = {field["name"]: field for field in controls()["methods"]["watched"]["fields"]}
        gain, kind = fields["gain"], fields["kind"]
        assert (gain["kind"], gain["from"], gain["to"], gain["first"]) == ("number", 0, 4, True)
        assert gain["help"] == "what the bloom is multiplied by"
        assert (kind["kind"], kind["choices"]) == ("choice", ["plain", "squared"])

    @pytest.mark.parametrize(
        ("block", "ends"),
        [
            ("float\n3", (0, 6)),
            ("float\n//!MINIMUM 0\n0", (0, 1)),
            ("float\n//!MINIMUM -2\n0.5", (-2, 1)),
            ("float\n//!MAXIMUM -3\n-4", (-8, -3)),
            ("int\n5", (0, 10)),
            ("uint\n//!MINIMUM 2\n2", (2, 4)),
        ],
    )
    def test_a_param_without_limits_has_a_slider(
        self, file: Path, block: str, ends: tuple[float, float]
    ) -> None:
        text = TEXT.replace("//!HOOK", f"//!PARAM free\n//!TYPE {block}\n//!HOOK")
        file.write_text(text)
        kind: Any = vkbloom.load_method(file)
        (free,) = (
            field for field in controls()["methods"]["watched"]["fields"] if field["name"] == "free"
        )
        assert (free["from"], free["to"]) == ends
        # Its limits are those of the file, not of the slider.
        assert kind(free=ends[0]).free == ends[0]
        if "MAXIMUM" not in block:
            assert kind(free=100).free == 100

    def test_code_loads_the_file(self, file: Path) -> None:
        kind: Any = vkbloom.load_method(file)
        settings: Settings = kind(gain=3)
        assert as_code(settings) == f'vkbloom.load_method("{file}")(gain=3.0)'
        assert eval(as_code(settings), {"vkbloom": vkbloom}) == settings


class TestChanges:
    def test_a_saved_file_is_loaded_again(self, file: Path, viewer: Viewer) -> None:
        setup = ask(viewer, kind="setup")
        assert setup["has_files"]
        settings = setup["sides"]["a"]
        assert show(viewer, settings)[0, 0, 0] == 1
        unchanged = ask(viewer, kind="methods")
        assert (unchanged["methods"], unchanged["errors"]) == ({}, {})
        save(
            file, TEXT.replace("return gain", "return 3.0 * gain").replace("MAXIMUM 4", "MAXIMUM 9")
        )
        answer = ask(viewer, kind="methods")
        (method,) = answer["methods"].values()
        assert {field["name"]: field for field in method["fields"]}["gain"]["to"] == 9
        assert show(viewer, settings)[0, 0, 0] == 3
        # Each page is told once.
        assert ask(viewer, kind="methods")["methods"] == {}

    def test_a_saved_shader_of_a_description_is_loaded_again(
        self, tmp_path: Path, renderer: Renderer
    ) -> None:
        shader, path = tmp_path / "gain.frag", tmp_path / "gain.toml"
        text = "uniform sampler2D image;\nout vec4 made;\n"
        text += "void main() { made = 2.0 * texelFetch(image, ivec2(0), 0); }\n"
        shader.write_text(text)
        path.write_text(
            'bloom = "made"\n[[passes]]\nfile = "gain.frag"\noutput = "made"\n'
            'textures = { image = "glow" }\n'
        )
        image = np.full((8, 8, 3), 0.5, np.float32)
        viewer = Viewer(image, vkbloom.load_method(path)(), renderer=renderer)
        settings = ask(viewer, kind="setup")["sides"]["a"]
        assert show(viewer, settings)[0, 0, 0] == 1
        save(shader, text.replace("2.0", "4.0"))
        assert [*ask(viewer, kind="methods")["methods"]] == ["gain"]
        assert show(viewer, settings)[0, 0, 0] == 2

    def test_a_broken_file_says_the_line_and_the_method_stays(
        self, file: Path, viewer: Viewer
    ) -> None:
        settings = ask(viewer, kind="setup")["sides"]["a"]
        save(file, TEXT.replace("GLOW_tex(GLOW_pos)", "GLOW_text(GLOW_pos)"))
        for _ in range(2):
            answer = ask(viewer, kind="methods")
            assert answer["methods"] == {}
            text = answer["errors"]["watched"]
            assert text.startswith(f"{file}:15: ")
            assert "GLOW_text" in text.splitlines()[1]
            assert show(viewer, settings)[0, 0, 0] == 1
        save(file, TEXT)
        assert ask(viewer, kind="methods")["errors"] == {}
        file.unlink()
        assert "No such file" in ask(viewer, kind="methods")["errors"]["watched"]

    def test_two_pages(self, file: Path, viewer: Viewer, renderer: Renderer) -> None:
        other = Viewer(np.zeros((4, 4, 3), np.float32), viewer.settings["a"], renderer=renderer)
        for page in (viewer, other):
            ask(page, kind="setup")
        save(file, TEXT.replace("MAXIMUM 4", "MAXIMUM 9"))
        assert [list(ask(page, kind="methods")["methods"]) for page in (viewer, other)] == [
            ["watched"],
            ["watched"],
        ]

    def test_a_page_that_is_opened_later(
        self, file: Path, viewer: Viewer, renderer: Renderer
    ) -> None:
        """The settings that it begins with are of the class before."""
        begun = viewer.settings["a"].replace(gain=4.0, exposure=1.0)
        save(file, TEXT.replace("MAXIMUM 4", "MAXIMUM 3").replace("plain\nsquared", "plain\ncubed"))
        vkbloom.load_method(file)
        page = Viewer(np.zeros((4, 4, 3), np.float32), begun, renderer=renderer)
        settings: Any = settings_from(ask(page, kind="setup")["sides"]["a"])
        # A value that the new text does not accept is its default.
        assert (settings.gain, settings.exposure, settings.kind) == (2, 1, "plain")

    def test_without_own_methods_nothing_is_watched(self, renderer: Renderer) -> None:
        page = Viewer(np.zeros((4, 4, 3), np.float32), renderer=renderer)
        assert ask(page, kind="setup")["has_files"] is False
