"""Every door to a file starts with the same preset and expansion, and gives equal pixels."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.cli.calls import run
from tests.explorer.pages import Viewer
from tests.images import lights
from tests.io import foreign
from tests.io.parts import reread, store_ultra_hdr
from vkbloom._cli import live
from vkbloom._io.picture import Picture

pytestmark = pytest.mark.usefixtures("kept_renderers")

Pixels = NDArray[Any]
#: What a door starts from: the words of a command, and the settings of a call in Python.
Begin = tuple[tuple[str, ...], Any]


def picture(channels: int = 3, highest: float = 6.0) -> Pixels:
    image = lights(40, 28, channels, highest=highest)
    if channels == 4:
        image[..., 3] = np.clip(image[..., 3] + 0.3, 0, 1)
        # Half of it is opaque, and a part is clear.
        image[14:, :, 3], image[:4, :, 3] = 1, 0
    return image


def levels(bits: int, channels: int = 3) -> Pixels:
    scaled = np.rint(np.clip(picture(channels, 1.2), 0, 1) * (2**bits - 1))
    return np.asarray(scaled, f"uint{bits}")


def hdr(path: Path, curve: Any) -> None:
    vkbloom.write(path, np.minimum(picture(highest=3), 3), encoding=curve, bits=16)


def ultra_hdr(path: Path) -> None:
    image = np.repeat(np.repeat(picture(), 2, axis=0), 2, axis=1)
    store_ultra_hdr(path, image.astype(np.float16))


def unsigned_fits(path: Path) -> None:
    """Unsigned numbers, which FITS has as signed ones with an offset."""
    planes = np.moveaxis(levels(16)[::-1], -1, 0)
    signed = (planes.astype(int) - 32768).astype(np.int16)
    foreign.fits(path, signed, BSCALE=1, BZERO=32768)


def with_preview(path: Path) -> None:
    """Light, after a preview of integers."""
    tifffile = pytest.importorskip("tifffile")
    with tifffile.TiffWriter(path) as file:
        file.write(levels(8)[::4, ::4], photometric="rgb", subfiletype=1)
        file.write(picture(), photometric="rgb")


#: Files by name, and whether they are expanded.
FILES: dict[str, tuple[Callable[[Path], object], bool]] = {
    "photo.jpg": (lambda path: vkbloom.write(path, levels(8), quality=95), True),
    "deep.png": (lambda path: vkbloom.write(path, levels(16)), True),
    "alpha.png": (lambda path: vkbloom.write(path, levels(8, 4)), True),
    "page.tif": (lambda path: vkbloom.write(path, levels(16, 4)), True),
    "pq.png": (lambda path: hdr(path, "pq"), False),
    "hlg.png": (lambda path: hdr(path, "hlg"), False),
    "half.exr": (lambda path: vkbloom.write(path, picture().astype(np.float16)), False),
    "alpha.exr": (lambda path: vkbloom.write(path, picture(4)), False),
    "radiance.hdr": (lambda path: vkbloom.write(path, picture()), False),
    "gain_map.jpg": (ultra_hdr, False),
    "unsigned.fits": (unsigned_fits, True),
    "preview.tif": (with_preview, False),
}
BEGINNINGS: dict[str, Begin] = {
    "nothing": ((), None),
    "another preset": (("--preset", "unity_urp"), "unity_urp"),
    "alpha of the bloom": (("--preset", "unity_urp", "--alpha", "max"), None),
}
#: Results whose settings others start from, by the words that made them.
SAVED: dict[str, tuple[str, ...]] = {
    "a photo without its threshold": ("--preset", "photo", "--threshold", "0.6"),
    "stars": ("--preset", "blender_streaks", "--expand", "8"),
    "not expanded": ("--preset", "photo", "--expand", "1"),
}


class Doors:
    """What each door makes of a file, as floats of RGB or RGBA."""

    def __init__(self, renderer: vkbloom.Renderer, patch: pytest.MonkeyPatch) -> None:
        self.renderer, self.patch = renderer, patch

    def python(self, file: str, words: tuple[str, ...], settings: Any) -> Pixels:
        fields: dict[str, Any] = {"alpha": "max"} if "--alpha" in words else {}
        chosen = "unity_urp" if fields else settings
        return vkbloom.apply(file, chosen, renderer=self.renderer, **fields)["final"]

    def apply(self, file: str, words: tuple[str, ...]) -> Pixels:
        """Return what is written, before colours are divided by alpha again."""
        kept: list[Pixels] = []

        def finish(picture: Picture, final: Pixels, settings: object) -> Picture:
            kept.append(final)
            return Picture.of_values(final, "float", "linear")

        with self.patch.context() as patch:
            patch.setattr("vkbloom._cli.apply.finish", finish)
            succeed("apply", file, "-o", "applied.exr", *words)
        return kept[0]

    def explore(self, file: str, words: tuple[str, ...]) -> Pixels:
        made: list[Viewer] = []

        async def serve(new_viewer: Callable[[], Viewer], *_: object) -> int:
            made.append(new_viewer())
            return 0

        with self.patch.context() as patch:
            patch.setattr(live, "_serve", serve)
            succeed("explore", "--no-open", file, *words)
        return self.show(made[0])

    def notebook(self, file: str, settings: Any) -> Pixels:
        return self.show(vkbloom.explore(file, settings, renderer=self.renderer)._viewer)

    def open(self, file: str) -> Pixels:
        viewer = Viewer(vkbloom.Scene.ufo(), renderer=self.renderer, size=(8, 8))
        message = {"kind": "open", "name": file}
        answer, _ = viewer.answer(message, [Path(file).read_bytes()])
        assert answer["kind"] == "open", answer
        return self.show(viewer)

    def show(self, viewer: Viewer, expand: Any = None, settings: Any = None) -> Pixels:
        viewer.renderer = self.renderer
        message: dict[str, Any] = {
            "kind": "frame",
            "sides": {"a": (settings or viewer.settings["a"]).to_dict()},
            **({} if expand is None else {"expand": {"a": expand}}),
        }
        answer, _ = viewer.answer(message)
        assert "error" not in answer["sides"]["a"], answer
        return viewer.frames["a"]["final"]

    def view(self, file: str, words: tuple[str, ...], keys: str = "") -> Pixels:
        presented: list[Pixels] = []

        class Surface:
            def __init__(surface, renderer: vkbloom.Renderer, _: object) -> None:
                surface.renderer = renderer

            def __enter__(surface) -> Any:
                return surface

            def __exit__(surface, *_: object) -> None:
                pass

            def present(surface, source: Any, settings: Any, **_: object) -> bool:
                presented.append(surface.renderer.apply(source, settings)["final"])
                for key in keys[len(presented) - 1 :][:1]:
                    held[0].press(key, [])
                held[0].closed = len(presented) > len(keys)
                return True

        held: list[live.Live] = []
        with self.patch.context() as patch:
            patch.setattr(live, "import_extra", lambda *_: _Glfw())
            patch.setattr(live, "_open_window", lambda *_: contextlib.nullcontext())
            patch.setattr(live, "_listen", lambda _, __, ___, state: held.append(state))
            patch.setattr(live, "Surface", Surface)
            succeed("view", file, *words)
        return presented[-1]

    def grid(self, file: str, words: tuple[str, ...]) -> Pixels:
        import xarray as xr

        shutil.rmtree(f"{file}.zarr", ignore_errors=True)
        succeed("grid", file, "-o", f"{file}.zarr", "--axis", "dither_seed=3", *words)
        with xr.open_zarr(f"{file}.zarr") as grid:
            return np.asarray(grid["final"].values[0])

    def fit(self, file: str, words: tuple[str, ...]) -> Pixels:
        found: list[Pixels] = []

        def fit(image: Pixels, _: object, begun: Any, **__: object) -> list[Any]:
            found.append(self.renderer.apply(image, begun[0])["final"])
            return []

        with self.patch.context() as patch:
            patch.setattr("vkbloom._fit.fit", fit)
            succeed("fit", file, file, *words)
        return found[0]


class _Glfw:
    def __getattr__(self, name: str) -> Any:
        return lambda *_: False


def succeed(*words: str) -> None:
    result = run(*words)
    assert result.exit_code == 0, result.stderr


@pytest.fixture
def doors(renderer: vkbloom.Renderer, monkeypatch: pytest.MonkeyPatch) -> Doors:
    return Doors(renderer, monkeypatch)


@pytest.fixture
def file(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    FILES[request.param][0](Path(request.param))
    return str(request.param)


def differing(results: dict[str, Pixels]) -> list[str]:
    """Return the doors whose pixels are not those of the first one."""
    first, *_ = results.values()
    return [name for name, found in results.items() if not np.array_equal(first, found)]


@pytest.mark.parametrize("file", FILES, indirect=True)
def test_all_doors_start_alike(doors: Doors, file: str) -> None:
    wrong = {}
    for name, (words, settings) in BEGINNINGS.items():
        is_blended = "--alpha" in words
        if is_blended and "alpha" not in file:
            continue
        results = {
            door: getattr(doors, door)(file, words) for door in ("apply", "explore", "view", "grid")
        }
        results["python"] = doors.python(file, words, settings)
        if not is_blended:
            results["notebook"] = doors.notebook(file, settings)
            results["fit"] = doors.fit(file, words)
        if not words:
            results["opened on the page"] = doors.open(file)
        if found := differing(results):
            wrong[name] = found
    assert wrong == {}


@pytest.mark.parametrize("file", ["photo.jpg", "half.exr"], indirect=True)
def test_the_expansion_of_a_call(doors: Doors, file: str) -> None:
    words = ("--expand", "8")
    results = {door: getattr(doors, door)(file, words) for door in ("apply", "explore", "grid")}
    assert differing(results) == []
    # A photograph is expanded up to 4 without these words, and floats never are.
    is_same = np.array_equal(results["apply"], doors.apply(file, ()))
    assert is_same == (file != "photo.jpg")


@pytest.mark.parametrize("file", FILES, indirect=True)
def test_settings_of_a_result_give_it_again(doors: Doors, file: str) -> None:
    wrong = {}
    for place, (name, words) in enumerate(SAVED.items()):
        made = f"b{('.png', '.exr')[place % 2]}"
        succeed("apply", file, "-o", made, *words)
        again = ("--settings", made)
        results = {"first": doors.apply(file, words)}
        for door in ("apply", "explore", "view", "grid", "fit"):
            results[door] = getattr(doors, door)(file, again)
        if found := differing(results):
            wrong[name] = found
    assert wrong == {}


@pytest.mark.parametrize("file", FILES, indirect=True)
def test_which_files_are_expanded(file: str) -> None:
    """With the largest values: HLG of 3 stays 3, and a photograph's 1 becomes 4."""
    begun = vkbloom.apply(file, bloom=False)
    plain = vkbloom.read(file, premultiplied=file.endswith(".exr"))
    colours = begun["final"][..., :3].astype(float).max()
    assert begun.info.get("expand") == (4 if FILES[file][1] else None)
    is_photograph = FILES[file][1] or file == "gain_map.jpg"
    assert begun.settings.method == "bevy"
    assert begun.settings.composite == ("add" if is_photograph else "mix")
    if FILES[file][1]:
        assert 3 < colours <= 4.001
    else:
        np.testing.assert_array_equal(begun["final"], plain)


@pytest.mark.parametrize("file", ["photo.jpg", "pq.png"], indirect=True)
def test_a_preset_that_is_chosen_later(doors: Doors, file: str) -> None:
    """On the page and with the key P, a preset starts as a call with its name does."""
    words = ("--preset", "blender_streaks")
    expected = doors.apply(file, words)
    viewer = vkbloom.explore(file, renderer=doors.renderer)._viewer
    streaks = vkbloom.presets["blender_streaks"]
    assert np.array_equal(doors.show(viewer, "auto", streaks), expected)
    first, second = [*vkbloom.presets][:2]
    pressed = doors.view(file, ("--preset", first), keys="p")
    assert np.array_equal(pressed, doors.apply(file, ("--preset", second)))
    last = [*vkbloom.presets][-2:]
    pressed = doors.view(file, ("--preset", last[0]), keys="p")
    assert np.array_equal(pressed, doors.apply(file, ("--preset", last[1])))


@pytest.mark.parametrize("file", ["photo.jpg", "deep.png", "alpha.png", "half.exr"], indirect=True)
@pytest.mark.parametrize("expand", [None, 8])
def test_the_picture_of_the_page(doors: Doors, file: str, expand: float | None) -> None:
    """A PNG of the explorer holds its settings, and the command makes it again from them."""
    viewer = vkbloom.explore(file, renderer=doors.renderer)._viewer
    settings = vkbloom.presets["blender_streaks"].replace(intensity=0.7)
    message = {"kind": "save", "settings": settings.to_dict(), "expand": expand}
    _, (png,) = viewer.answer(message)
    Path("page.png").write_bytes(png)
    succeed("apply", file, "again.png", "--settings", "page.png", "--bits", "8")
    found, again = (reread(Path(name))[1][..., :3] for name in ("page.png", "again.png"))
    np.testing.assert_array_equal(found, again)
    # Also the JSON of "Save settings", which says the expansion beside the settings.
    text = settings.to_json()[:-1] + f', "vkbloom:expand": {expand or 1}}}'
    Path("page.json").write_text(text)
    succeed("apply", file, "again.png", "--settings", "page.json", "--bits", "8")
    np.testing.assert_array_equal(reread(Path("again.png"))[1][..., :3], found)
    assert vkbloom.Settings.from_json(text) == settings


@pytest.mark.parametrize("file", ["photo.jpg"], indirect=True)
def test_frames_of_a_path_hold_the_expansion(doors: Doors, file: str) -> None:
    frames = vkbloom.apply(file, "photo", renderer=doors.renderer, threshold=0.6)
    frames.save("frames.exr")
    assert vkbloom.Frames.load("frames.exr").info["expand"] == 4
    assert np.array_equal(doors.apply(file, ("--settings", "frames.exr")), frames["final"])
