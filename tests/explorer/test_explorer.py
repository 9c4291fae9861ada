"""The explorer without a browser: controls, settings as code, and the viewer's answers."""

from __future__ import annotations

import ast
import base64
import dataclasses
import itertools
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.device.abilities import infinities
from tests.exhaustive import some
from tests.explorer.pages import Viewer, as_code, controls, picture_of, reduce, settings_from
from tests.framebuffers import decode, make
from tests.images import noise
from tests.io.parts import facts_in
from tests.kinds import METHODS
from tests.refusals import assert_refused, rows
from vkbloom import KinoBloom, Pyramid, Renderer, Scene, Separable, Settings, glares, presets

EXAMPLES = [
    *presets.values(),
    Separable(weights=(0.5, 0.25), layers=((1, 0.5), (2, 1)), bloom_size=(64, 32), threshold=None),
    Pyramid(threshold=1.5, tonemap="agx", bloom=False, exposure=-1),
    *(kind() for kind in METHODS.values()),
]


def ask(viewer: Viewer, **message: Any) -> tuple[dict[str, Any], list[bytes]]:
    """Send a message as a page does. JSON must not change it or the answer."""
    answer, buffers = viewer.answer(json.loads(json.dumps(message, allow_nan=False)))
    return json.loads(json.dumps(answer, allow_nan=False)), buffers


def frame(viewer: Viewer, settings: Settings, **rest: Any) -> tuple[dict[str, Any], bytes]:
    answer, buffers = ask(viewer, kind="frame", sides={"a": settings.to_dict()}, **rest)
    assert answer["kind"] == "frame", answer
    assert "error" not in answer["sides"]["a"], answer
    (picture,) = buffers
    return answer["sides"]["a"], picture


@pytest.fixture
def image() -> np.ndarray[Any, Any]:
    return (np.random.default_rng(3).random((30, 40, 3)) ** 8 * 20).astype(np.float16)


@pytest.fixture
def viewer(scene: Scene, renderer: Renderer) -> Viewer:
    return Viewer(scene, renderer=renderer, size=(64, 36), shading="forward")


class TestControls:
    def test_every_method_has_controls_of_its_fields(self) -> None:
        described = json.loads(json.dumps(controls(), allow_nan=False))
        assert described["methods"].keys() == METHODS.keys()
        for name, method in described["methods"].items():
            fields = {field["name"]: field for field in method["fields"]}
            defaults = METHODS[name]().to_dict()
            assert "glare" in fields
            # What has no control is a sequence, an object, or refused by the method.
            for missing in set(defaults) - {*fields, "method", "bloom_size", "pixels_per_degree"}:
                usual = defaults[missing]
                if not isinstance(usual, list | dict):
                    other = {int: 1, bool: True, str: usual}.get(type(usual), 0.5)
                    with pytest.raises((TypeError, ValueError)):
                        METHODS[name]().replace(**{missing: other})
            first = [field["name"] for field in method["fields"] if field["first"]]
            assert first[:2] == ["bloom", "intensity"]
            assert first[-2:] == ["exposure", "tonemap"]
            assert len(first) <= 11
            for field in fields.values():
                value = defaults[field["name"]]
                if field["kind"] == "number":
                    assert field["low"] <= field["from"] < field["to"] <= field["high"]
                    assert 0 < field["step"] <= field["to"] - field["from"]
                    # Of 1, 2 and 5 times powers of ten, neighbours are 2.5 times apart at the most.
                    steps = (field["to"] - field["from"]) / field["step"]
                    assert field["integer"] or 200 <= steps * (1 + 1e-9) <= 500
                    assert value is None or field["low"] <= value <= field["high"]
                    assert field["integer"] == (type(value) is int)
                elif field["kind"] == "choice":
                    assert value in field["choices"] or (value in (None, []) and field["optional"])
                else:
                    assert type(value) is bool

    def test_point_spread_functions(self) -> None:
        """Every value that a control offers makes a function."""
        described = json.loads(json.dumps(controls(), allow_nan=False))["functions"]
        for name, function in described.items():
            defaults = function["defaults"]
            assert defaults["psf"] == name
            assert settings_from({"method": "convolution", "psf": defaults})
            for field in function["fields"]:
                assert field["help"], (name, field)
                *outer, key = field["name"].split(".")
                value = defaults[outer[0]][key] if outer else defaults[key]
                if field["kind"] == "number":
                    assert field["from"] <= value <= field["to"]
                    assert field["integer"] == (type(value) is int)
                for end in field.get("choices", [field.get("from"), field.get("to")]):
                    made = json.loads(json.dumps(defaults))
                    (made[outer[0]] if outer else made)[key] = end
                    assert settings_from({"method": "convolution", "psf": made})
        assert {field["name"] for field in described["cie_total"]["fields"]} == {"age", "pigment"}

    def test_stages_of_glare(self) -> None:
        """Every value that a control offers makes a stage; presets are those of `glares`."""
        described = json.loads(json.dumps(controls(), allow_nan=False))["glare"]
        assert set(described["presets"]) == set(glares)
        for name, stage in described["stages"].items():
            defaults = stage["defaults"]
            assert defaults["stage"] == name
            for field in stage["fields"]:
                assert field["help"], (name, field)
                for end in field.get("choices", [field.get("from"), field.get("to")]):
                    glare = [defaults, defaults | {field["name"]: end}][name == "dirt" :]
                    assert settings_from({"method": "pyramid", "glare": glare})
                if field["kind"] == "number":
                    assert field["low"] <= field["from"] < field["to"] <= field["high"]
                    assert field["integer"] == (type(defaults[field["name"]]) is int)
        fields = {field["name"] for field in described["stages"]["streaks"]["fields"]}
        assert {"intensity", "directions", "fade", "halvings"} <= fields

    @pytest.mark.parametrize("settings", EXAMPLES)
    def test_code_makes_the_settings(self, settings: Settings) -> None:
        code = as_code(settings)
        ast.parse(code)
        assert eval(code, {"vkbloom": vkbloom}) == settings

    def test_code_of_a_preset_with_another_look(self) -> None:
        settings = presets["jimenez2014"].replace(tonemap="aces", exposure=1)
        code = 'vkbloom.presets["jimenez2014"].replace(tonemap="aces", exposure=1.0)'
        assert sorted(as_code(settings)) == sorted(code)
        assert eval(as_code(settings), {"vkbloom": vkbloom}) == settings
        assert as_code(settings.replace(levels=3)).startswith("vkbloom.Pyramid(")

    def test_code_is_short(self) -> None:
        assert as_code(Separable()) == "vkbloom.Separable()"
        assert as_code(presets["outline"]) == 'vkbloom.presets["outline"]'
        assert as_code(KinoBloom(radius=3)) == "vkbloom.KinoBloom(radius=3.0)"
        assert as_code(Pyramid(tonemap="aces", threshold=0.5)) == (
            'vkbloom.Pyramid(threshold=0.5, tonemap="aces")'
        )


class TestShown:
    @pytest.mark.parametrize("dtype", ["uint8", "float16", "float32"])
    @pytest.mark.parametrize("encoding", ["none", "srgb"])
    @pytest.mark.parametrize("name", ["final", "bloom", "normal", "position"])
    def test_pictures_are_those_of_a_contact_sheet(
        self, dtype: str, encoding: Any, name: str, tmp_path: Path
    ) -> None:
        array = noise(9, 14, 4, dtype=dtype)
        if dtype != "uint8":
            array = np.abs(array / 200)
            array[0, 0] = (np.nan, np.inf, -np.inf, 1)
        whole = make({name: array}, settings=Separable(encoding=encoding))
        expected = decode(whole._repr_png_(), tmp_path)[:, :, :3].astype(int)
        picture = picture_of(array, name, encoding=encoding, stops=0.0)
        shown = decode(picture, tmp_path)
        # float32 colours are rounded to half floats first: a level where two meet.
        allowed = 1 if dtype == "float32" else 0
        assert np.abs(shown - expected).max() <= allowed

    def test_stops(self, tmp_path: Path) -> None:
        array = np.full((1, 1, 3), 4, np.float32)
        cases: tuple[tuple[str, Any, int], ...] = (("bloom", "none", 188), ("final", "srgb", 128))
        for name, encoding, level in cases:
            shown = decode(picture_of(array, name, encoding=encoding, stops=-3), tmp_path)
            assert shown[0, 0, 0] == level

    def test_depth(self, tmp_path: Path) -> None:
        depth = np.array([[0.5, 1.0]], np.float32)
        shown = decode(picture_of(depth, "depth", encoding="none", stops=0), tmp_path)
        assert shown[0, :, 0].tolist() == [255, 0]


class TestViewer:
    def test_setup(self, viewer: Viewer) -> None:
        answer, buffers = ask(viewer, kind="setup", view="v", id=4)
        assert (answer["kind"], answer["view"], answer["id"], buffers) == ("setup", "v", 4, [])
        assert answer["sides"]["a"] == json.loads(json.dumps(Separable().to_dict()))
        assert answer["sides"]["b"]["bloom"] is False
        assert (answer["animated"], answer["source_size"]) == (True, [64, 36])

    def test_the_scene_to_begin_with(self, renderer: Renderer) -> None:
        """Its lights tell all presets apart, by more than 15 levels somewhere: pictures that are
        alike differ by rounding alone, which is two levels at most."""
        viewer = Viewer(renderer=renderer, size=(160, 90))
        answer, _ = ask(viewer, kind="setup")
        assert (answer["shading"], answer["glow"], answer["animated"]) == ("deferred", 6, True)
        assert answer["shadings"] == ["forward", "deferred"]
        begun = presets["tutorial"].replace(tonemap="aces", encoding="srgb")
        assert settings_from(answer["sides"]["a"]) == begun
        pictures = {}
        for name, preset in some(presets.items(), 8):
            frame(viewer, preset.replace(tonemap="aces", encoding="srgb"))
            pictures[name] = viewer.frames["a"]["final"][..., :3].astype(int)
        for one, other in itertools.combinations(pictures, 2):
            difference = np.abs(pictures[one] - pictures[other])
            assert difference.mean() > 0.5, (one, other)
            assert difference.max() > 15, (one, other)

    def test_shading_and_glow(self, viewer: Viewer, scene: Scene, renderer: Renderer) -> None:
        frame(viewer, Pyramid(), shading="deferred", glow=9)
        bright = dataclasses.replace(scene, glow_intensity=9)
        expected = renderer.render(bright, Pyramid(), (64, 36), shading="deferred")["final"]
        assert np.array_equal(viewer.frames["a"]["final"], expected)
        # What a message leaves out stays.
        frame(viewer, Pyramid())
        assert np.array_equal(viewer.frames["a"]["final"], expected)
        frame(viewer, Pyramid(), shading="forward")
        expected = renderer.render(scene, Pyramid(), (64, 36))["final"]
        assert np.array_equal(viewer.frames["a"]["final"], expected)

    def test_a_file_is_opened(
        self, viewer: Viewer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        pixels = np.random.default_rng(1).integers(0, 256, (21, 34, 3), dtype=np.uint8)
        path = vkbloom.write(tmp_path / "a.png", pixels)
        answer, _ = viewer.answer({"kind": "open", "name": "folder/photo.png"}, [path.read_bytes()])
        assert (answer["kind"], answer["name"]) == ("open", "photo.png")
        assert (answer["source_size"], answer["shadings"]) == ((34, 21), [])
        # A scene's settings turn photographs white.
        assert settings_from(answer["sides"]["a"]) == presets["photo"]
        assert answer["note"] == "highlights expanded up to 4"
        facts, _ = frame(viewer, Separable(bloom=False))
        # The code also reads the image as it is shown.
        scope: dict[str, Any] = {"vkbloom": vkbloom}
        monkeypatch.chdir(tmp_path)
        vkbloom.write("photo.png", pixels)
        exec(facts["code"], scope)
        assert np.array_equal(scope["image"], vkbloom.read(path, expand=4))
        assert scope["settings"] == Separable(bloom=False)
        assert np.array_equal(viewer.frames["a"]["final"], vkbloom.read(path, expand=4))
        # It is saved with the levels of the file that the command writes, and shown with those of
        # half floats.
        _, shown = frame(viewer, presets["photo"])
        _, (saved,) = ask(viewer, kind="save", settings=presets["photo"].to_dict(), expand=4)
        final = vkbloom.apply(path, "photo")["final"]
        written = vkbloom.write(tmp_path / "c.png", final, expand=4).read_bytes()
        expected = decode(written, tmp_path)
        assert np.array_equal(decode(saved, tmp_path), expected)
        assert np.abs(decode(shown, tmp_path).astype(int) - expected).max() <= 1
        frame(viewer, Separable(bloom=False))
        # Of the next image, the settings stay.
        answer, _ = viewer.answer({"kind": "open", "name": "b.png"}, [path.read_bytes()])
        assert settings_from(answer["sides"]["a"]) == Separable(bloom=False)

    def test_files_of_floats_begin_as_arrays_do(self, viewer: Viewer, tmp_path: Path) -> None:
        pixels = np.random.default_rng(1).random((21, 34, 3), np.float32) * 3
        path = vkbloom.write(tmp_path / "a.exr", pixels)
        answer, _ = viewer.answer({"kind": "open", "name": "a.exr"}, [path.read_bytes()])
        assert settings_from(answer["sides"]["a"]) == presets["bevy_natural"]
        assert answer["note"] == ""
        assert frame(viewer, presets["bevy_natural"])[0]["code"] == "vkbloom.BevyBloom()"
        # A photograph after it begins as one, as nothing was changed.
        photo = vkbloom.write(tmp_path / "a.png", pixels).read_bytes()
        answer, _ = viewer.answer({"kind": "open", "name": "a.png"}, [photo])
        assert settings_from(answer["sides"]["a"]) == presets["photo"]

    def test_file_that_is_not_an_image_is_an_error(self, viewer: Viewer) -> None:
        for name in ("words.png", "no extension", "../../x.exr", "a." + "x" * 300):
            answer, _ = viewer.answer({"kind": "open", "name": name}, [b"words"])
            assert answer["kind"] == "error"
            assert Path(name).name in answer["error"]
            assert "image." not in answer["error"]
        # What was looked at is still there.
        assert frame(viewer, Separable())[0]["size"] == [64, 36]

    def test_the_picture_is_saved_in_its_own_size(
        self, image: Any, renderer: Renderer, tmp_path: Path
    ) -> None:
        viewer = Viewer(image, renderer=renderer)
        frame(viewer, Pyramid(), size=[20, 15])
        answer, (picture,) = ask(viewer, kind="save", settings=Pyramid().to_dict(), stops=-2)
        assert answer["framebuffer"] == "final"
        whole = renderer.apply(image, Pyramid())["final"]
        shown = picture_of(whole, "final", encoding="none", stops=-2.0)
        assert np.array_equal(decode(picture, tmp_path), decode(shown, tmp_path))
        # It holds its settings as files of the command do.
        (tmp_path / "final.png").write_bytes(picture)
        facts = facts_in(tmp_path / "final.png")
        assert Settings.from_json(facts["settings"]) == Pyramid()
        assert "expand" not in facts

    def test_a_frame_is_that_of_the_renderer(
        self, viewer: Viewer, scene: Scene, renderer: Renderer, tmp_path: Path
    ) -> None:
        settings = Separable(blur_scale=1.5)
        facts, picture = frame(viewer, settings, size=[80, 45], time=0.25)
        expected = renderer.render(scene, settings, (80, 45), time=0.25)
        assert np.array_equal(decode(picture, tmp_path), expected["final"][:, :, :3])
        assert facts["names"] == list(expected)
        assert (facts["framebuffer"], facts["size"], facts["dtype"]) == ("final", [80, 45], "uint8")
        assert facts["code"] == "vkbloom.Separable(blur_scale=1.5)"
        assert set(facts["passes"]) <= {"glow", "blur_vertical", "bloom", "scene", "final"}
        plan = renderer.plan(scene, settings, (80, 45), framebuffers="final")
        rows = [{**one._asdict(), "sentence": plan.sentences[one.name]} for one in plan.passes]
        assert json.loads(json.dumps(facts["plan"])) == json.loads(json.dumps(rows))
        assert viewer.settings["a"] == settings
        assert np.array_equal(viewer.frames["a"]["final"], expected["final"])
        # Without a size, the scene's own.
        assert frame(viewer, settings)[0]["size"] == [64, 36]

    def test_a_page_shows_sdr(self, viewer: Viewer) -> None:
        settings = Separable(encoding="pq")
        facts, _ = frame(viewer, settings, size=[16, 9])
        assert facts["note"] == "this page shows SDR: final's pq signal is shown as sRGB"
        assert not frame(viewer, settings, size=[16, 9], framebuffer="bloom")[0]["note"]

    def test_both_sides_at_once(self, viewer: Viewer, tmp_path: Path) -> None:
        sides = {"b": Separable(bloom=False).to_dict(), "a": Separable().to_dict()}
        answer, buffers = ask(viewer, kind="frame", sides=sides)
        with_bloom, without = (
            decode(buffers[answer["sides"][side]["picture"]], tmp_path).astype(int).sum()
            for side in "ab"
        )
        assert with_bloom > without

    def test_an_image_is_reduced_unless_its_own_size_is_asked_for(
        self, image: Any, renderer: Renderer, tmp_path: Path
    ) -> None:
        viewer = Viewer(image, renderer=renderer)
        settings = Pyramid(levels=2)
        facts, _ = frame(viewer, settings, size=[20, 99])
        assert facts["size"] == [20, 15]
        expected = renderer.apply(reduce(image, (20, 99)), settings)
        assert np.array_equal(viewer.frames["a"]["final"], expected["final"])
        for size in (None, [400, 300]):
            facts, picture = frame(viewer, settings, size=size, stops=-2)
            assert facts["size"] == [40, 30]
            whole = renderer.apply(image, settings)["final"]
            shown = picture_of(whole, "final", encoding="none", stops=-2)
            assert np.array_equal(decode(picture, tmp_path), decode(shown, tmp_path))

    def test_the_pointer_reads_the_framebuffer_itself(self, image: Any, renderer: Renderer) -> None:
        infinity, _ = infinities(renderer, "float16")
        image[29, 39] = (1.2345, infinity, 3000)
        viewer = Viewer(image, renderer=renderer)
        settings = Separable(bloom=False)
        facts, _ = frame(viewer, settings, view="v", at=[1, 1])
        # The half float that is nearest to 1.2345, in as few digits as tell it from the next.
        assert facts["probe"] == {"x": 39, "y": 29, "values": ["1.234", str(infinity), "3000.0"]}
        answer, _ = ask(viewer, kind="probe", view="v", at=[0.5, 0.1])
        found = answer["sides"]["a"]["probe"]
        assert (found["x"], found["y"]) == (20, 3)
        assert np.array_equal(np.array(found["values"], np.float16), image[3, 20])
        # Another view has shown nothing yet; what many others show is not kept for ever.
        assert ask(viewer, kind="probe", view="w", at=[0, 0])[0]["sides"] == {}
        for view in range(20):
            ask(viewer, kind="probe", view=str(view), at=[0, 0])
        assert ask(viewer, kind="probe", view="v", at=[0, 0])[0]["sides"] == {}

    def test_a_side_that_fails_leaves_the_other(self, viewer: Viewer) -> None:
        wrong = {"method": "kino", "composite": "mix"}
        sides = {"a": wrong, "b": Separable().to_dict()}
        answer, buffers = ask(viewer, kind="frame", sides=sides)
        assert "composite: 'mix' is not one of add" in answer["sides"]["a"]["error"]
        assert "code" in answer["sides"]["b"]
        assert len(buffers) == 1
        assert viewer.settings["a"] == Separable()

    @pytest.mark.parametrize(
        "message",
        [
            None,
            [],
            {"kind": "close"},
            {"kind": ["frame"]},
            {"kind": "frame"},
            {"kind": "frame", "sides": {"c": {}}},
            {"kind": "frame", "sides": {}, "size": [0, 5]},
            {"kind": "frame", "sides": {}, "size": "5x5"},
            {"kind": "frame", "sides": {}, "time": "now"},
            {"kind": "frame", "sides": {}, "stops": 1e9},
            {"kind": "frame", "sides": {}, "at": [2, 0]},
            {"kind": "frame", "sides": {}, "shading": "x"},
            {"kind": "frame", "sides": {}, "glow": -1},
            {"kind": "open", "name": "a.png"},
            {"kind": "save"},
            {"kind": "probe"},
            {"kind": "probe", "at": [None, 0]},
        ],
    )
    def test_wrong_messages_are_refused(self, viewer: Viewer, message: Any) -> None:
        answer, buffers = viewer.answer(message)
        assert (answer["kind"], buffers) == ("error", [])
        assert answer["error"]

    @pytest.mark.parametrize(("call", "error"), rows(__file__, "arguments"))
    def test_arguments(
        self, scene: Scene, renderer: Renderer, image: Any, call: str, error: str
    ) -> None:
        names = {"scene": scene, "renderer": renderer, "image": image}
        assert_refused(call, error, {**globals(), **names})

    def test_the_renderer(
        self, scene: Scene, renderer: Renderer, new_renderer: Callable[[], Renderer]
    ) -> None:
        Viewer(scene, renderer=renderer).close()
        assert not renderer.closed
        owner = Viewer(scene)
        owner.close()
        owner.close()
        assert owner.renderer.closed
        closed = new_renderer()
        closed.close()
        with pytest.raises(ValueError, match="closed"):
            Viewer(scene, renderer=closed)

    def test_a_later_change_of_the_image_is_not_seen(self, image: Any, renderer: Renderer) -> None:
        viewer = Viewer(image, Separable(bloom=False), renderer=renderer)
        before = image.copy()
        image[...] = 0
        frame(viewer, Separable(bloom=False))
        assert np.array_equal(viewer.frames["a"]["final"], before)


class TestWidget:
    @pytest.fixture
    def sent(self, monkeypatch: pytest.MonkeyPatch) -> list[tuple[Any, Any]]:
        anywidget = pytest.importorskip("anywidget")
        found: list[tuple[Any, Any]] = []
        monkeypatch.setattr(
            anywidget.AnyWidget,
            "send",
            lambda self, content, buffers=None: found.append((content, buffers)),
        )
        return found

    def test_messages_are_answered(
        self, scene: Scene, renderer: Renderer, sent: list[tuple[Any, Any]]
    ) -> None:
        explorer = vkbloom.explore(scene, size=(64, 36), renderer=renderer)
        assert explorer.frames is None
        settings = Pyramid(levels=3)
        message = {"kind": "frame", "id": 1, "sides": {"a": settings.to_dict()}}
        explorer._handle_custom_msg(message, [])
        ((answer, buffers),) = sent
        assert answer["sides"]["a"]["framebuffer"] == "final"
        assert buffers[0].startswith(b"\x89PNG")
        assert explorer.settings == settings
        assert explorer.frames is not None
        assert explorer.frames["final"].shape == (36, 64, 4)
        explorer.close()
        assert not renderer.closed

    def test_code_changes_the_page(
        self, scene: Scene, renderer: Renderer, sent: list[tuple[Any, Any]]
    ) -> None:
        against = Separable(loops=2)
        explorer = vkbloom.explore(scene, renderer=renderer, against=against)
        assert explorer.against == against
        explorer.settings = Pyramid()
        explorer.against = Separable()
        assert [list(content["sides"]) for content, _ in sent] == [["a"], ["b"]]
        assert sent[0][0]["sides"]["a"] == Pyramid().to_dict()
        assert (explorer.settings, explorer.against) == (Pyramid(), Separable())
        with pytest.raises(TypeError, match="settings"):
            explorer.settings = Pyramid

    def test_settings_are_traits(
        self, scene: Scene, renderer: Renderer, sent: list[tuple[Any, Any]]
    ) -> None:
        """Cells react to what the page or code sets; wrong fields of a page change nothing."""
        explorer = vkbloom.explore(scene, renderer=renderer)
        seen: list[Any] = []
        explorer.observe(lambda change: seen.append(change["new"]), "settings")
        explorer.settings = Pyramid()
        fields = Separable(loops=2).to_dict()
        explorer._handle_custom_msg({"kind": "frame", "sides": {"a": fields}}, [])
        explorer.set_state({"settings": Pyramid(levels=2).to_dict()})
        explorer.set_state({"settings": {"method": "none"}})
        assert seen == [Pyramid(), Separable(loops=2), Pyramid(levels=2)]
        assert explorer.settings == Pyramid(levels=2)
        assert explorer.get_state("settings")["settings"] == Pyramid(levels=2).to_dict()

    def test_pictures_and_files_are_text_where_buffers_do_not_arrive(
        self, scene: Scene, renderer: Renderer, sent: list[tuple[Any, Any]]
    ) -> None:
        explorer = vkbloom.explore(scene, size=(64, 36), renderer=renderer)
        message = {"kind": "frame", "sides": {"a": Pyramid().to_dict()}}
        explorer._handle_custom_msg(message, [])
        explorer._handle_custom_msg({**message, "text": True}, [])
        (binary, buffers), (text, nothing) = sent
        assert (binary["count"], text["count"], nothing) == (1, 0, [])
        assert [base64.b64decode(one) for one in text["pictures"]] == buffers
        file = base64.b64encode(base64.b64decode(text["pictures"][0])).decode()
        opened = {"kind": "open", "name": "a.png", "text": True, "files": [file]}
        explorer._handle_custom_msg(opened, [])
        assert sent[-1][0]["name"] == "a.png"

    def test_the_first_picture_is_below_the_page(
        self, scene: Scene, renderer: Renderer, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """A notebook that is executed without a browser keeps it."""
        pytest.importorskip("anywidget")
        shown: list[Any] = []
        monkeypatch.setattr("IPython.display.display", lambda one, **_: shown.append(one))
        vkbloom.explore(scene, size=(64, 36), renderer=renderer)._ipython_display_()
        page, still = shown
        assert "application/vnd.jupyter.widget-view+json" in page
        assert still.data.startswith(b"\x89PNG")

    def test_without_anywidget(self, scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(sys.modules, "anywidget", None)
        with pytest.raises(ModuleNotFoundError, match=r"pip install vkbloom\[notebook\]"):
            vkbloom.explore(scene)
