"""Photographs on the command line: highlights are expanded and glow, and nothing becomes darker."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from tools.look_sheet import WITH_RAYS, measure

import vkbloom
from tests.cli.calls import run
from tests.io.parts import facts_in, reread, store_ultra_hdr
from tests.io.profiles import DISPLAY_P3, REC_709, curv, profile, profile_chunk, store_png
from tests.srgb import decode_srgb

pytestmark = pytest.mark.usefixtures("kept_renderers")

data = pytest.importorskip("skimage.data")

Image = NDArray[Any]
SIDE = 160


def night() -> Image:
    """Return lamps of several colours before a dark wall."""
    image = np.full((SIDE, SIDE, 3), 12, np.uint8)
    for index, colour in enumerate(((255, 240, 200), (255, 60, 40), (255, 255, 255))):
        image[30 + 40 * index : 36 + 40 * index, 70:78] = colour
    return image


def room() -> Image:
    """Return bright windows in a dark wall."""
    image = np.full((SIDE, SIDE, 3), (90, 80, 70), np.uint8)
    image[30:90, 20:60] = image[30:90, 100:140] = 254
    return image


def snow() -> Image:
    """Return a field that is nearly white, with trees."""
    noise = np.random.default_rng(0).integers(225, 256, (SIDE, SIDE, 1))
    image = np.repeat(noise, 3, axis=2).astype(np.uint8)
    image[60:120, ::20] = 30
    return image


# Five kinds of photographs; those of scikit-image are in its wheel.
PHOTOS: dict[str, Callable[[], Image]] = {
    "night": night,
    "room": room,
    "snow": snow,
    "astronaut": lambda: data.astronaut()[::3, ::3],
    "coffee": lambda: data.coffee()[::3, ::3],
}


apply = functools.partial(run, "apply")


def png(path: Path, image: Image) -> Path:
    return vkbloom.write(path, np.ascontiguousarray(image))


@pytest.mark.parametrize("name", PHOTOS)
def test_nothing_becomes_darker(name: str, tmp_path: Path) -> None:
    image = PHOTOS[name]()
    result = apply(png(tmp_path / "a.png", image), tmp_path / "b.png")
    assert result.exit_code == 0, result.output
    after = reread(tmp_path / "b.png")[1].astype(int)
    assert (after.max(axis=2) - image.max(axis=2)).min() >= -1
    # A highlight takes the hue of a glow over it, which is some levels less in other components.
    is_full = (after.max(axis=2) == 255)[..., np.newaxis]
    assert (after - image).min(where=~is_full, initial=0) >= -1
    assert (after - image).min() >= -4
    has_lights = (image.max(axis=2) == 255).mean() > 1e-3
    if has_lights:
        assert (after - image).mean() > 0.1
        assert result.stderr == ""


@pytest.mark.parametrize(
    ("suffix", "alpha"), [(".png", False), (".png", True), (".tif", True), (".jpg", False)]
)
def test_colours_of_graphics_keep_their_hue(suffix: str, alpha: bool, tmp_path: Path) -> None:
    """Expanded highlights are scaled back to 1; a clip of each component turns orange yellow."""
    colours = [(255, 128, 0), (255, 245, 220), (200, 230, 255), (57, 255, 20), (255, 0, 0)]
    image = np.zeros((40, 40 * len(colours), 4 if alpha else 3), np.uint8)
    image[..., 3:] = 255
    for index, colour in enumerate(colours):
        image[8:32, 40 * index + 8 : 40 * index + 32, :3] = colour
    files = tmp_path / f"a{suffix}", tmp_path / f"b{suffix}"
    vkbloom.write(files[0], image, quality=100 if suffix == ".jpg" else None)
    assert apply(*files).exit_code == 0
    # What Python writes has the same hues.
    values = vkbloom.read(files[0], expand=4)
    vkbloom.write(tmp_path / "c.png", values)
    # Over each colour lies a little of its neighbours' glow.
    for file, most in ((files[1], 14), (tmp_path / "c.png", 3)):
        after = reread(file)[1][20, 20::40, :3].astype(int)
        assert np.abs(after - colours).max() <= most, (file.name, after)


def test_the_command_is_the_preset_in_python(tmp_path: Path, renderer: vkbloom.Renderer) -> None:
    path = png(tmp_path / "a.png", room())
    assert apply(path, tmp_path / "b.png").exit_code == 0
    photo = vkbloom.read(path, expand=4)
    final = renderer.apply(photo, vkbloom.presets["photo"])["final"]
    written = vkbloom.write(tmp_path / "c.png", final, expand=4)
    np.testing.assert_array_equal(reread(tmp_path / "b.png")[1], reread(written)[1])
    # So is what a notebook shows.
    shown = vkbloom.apply(path, renderer=renderer)._repr_png_()
    (tmp_path / "d.png").write_bytes(shown or b"")
    np.testing.assert_array_equal(reread(tmp_path / "b.png")[1], reread(tmp_path / "d.png")[1])


@pytest.mark.parametrize("words", [("--amount", "0"), ("--no-bloom",)])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize(
    "stored",
    [
        profile("Display P3", DISPLAY_P3),
        profile("a power", DISPLAY_P3, 2.19921875),
        profile("a table", REC_709, curve=curv(*(i**2 for i in range(256)))),
    ],
)
def test_colours_of_a_profile_come_back(
    stored: bytes, dtype: type, words: tuple[str, ...], tmp_path: Path
) -> None:
    """Photographs of telephones have colours that Rec. 709 has not."""
    levels = np.random.default_rng(0).integers(0, np.iinfo(dtype).max + 1, (48, 64, 3))
    levels[0, :3] = np.iinfo(dtype).max * np.eye(3)
    pixels: Image = levels.astype(dtype)
    store_png(tmp_path / "a.png", pixels, profile_chunk(stored))
    # Without bloom, highlights are expanded and compressed, and some levels are one beside. Of a
    # black component, the matrix leaves 1e-8 in single floats, of which a power makes 15 of 65535.
    most = 20 if dtype is np.uint16 else int(words[0] == "--no-bloom")
    for name in ("b.png", "c.tif"):
        result = apply(tmp_path / "a.png", tmp_path / name, *words)
        assert (result.exit_code, result.stderr) == (0, "")
        spec, after = reread(tmp_path / name)
        assert np.abs(after.astype(int) - levels).max() <= most
        assert bytes(spec["ICCProfile"]) == stored
    # So does a picture of a grid.
    axis = ("-o", tmp_path / "g", "--axis", "intensity=0,0.1")
    assert run("grid", tmp_path / "a.png", *axis).exit_code == 0
    spec, _ = reread(tmp_path / "g" / "000_final.png")
    assert bytes(spec["ICCProfile"]) == stored
    # In another encoding, colours are of Rec. 709.
    other = ("--output-colour", "srgb")
    assert apply(tmp_path / "a.png", tmp_path / "d.png", *other).exit_code == 0
    assert reread(tmp_path / "d.png")[0].getattribute("ICCProfile") is None


def test_a_bloom_by_a_profile_is_that_of_light(tmp_path: Path, renderer: vkbloom.Renderer) -> None:
    """The file has the same light as that of Rec. 709, where this has the colours."""
    image = PHOTOS["astronaut"]()
    chunk = profile_chunk(profile("Display P3", DISPLAY_P3))
    path = store_png(tmp_path / "a.png", image // 2, chunk)
    assert apply(path, tmp_path / "b.png", "--preset", "mist", "--expand", "1").exit_code == 0
    final = renderer.apply(vkbloom.read(path), vkbloom.presets["mist"])["final"]
    # Half a level of 8 bits, where the curve is steepest.
    np.testing.assert_allclose(vkbloom.read(tmp_path / "b.png"), final, atol=0.005)


@pytest.mark.parametrize("suffix", [".png", ".exr"])
def test_a_tone_mapping_or_a_file_of_floats_gets_what_is_rendered(
    suffix: str, tmp_path: Path, renderer: vkbloom.Renderer
) -> None:
    path = png(tmp_path / "a.png", room())
    tonemap = "aces" if suffix == ".png" else "none"
    assert apply(path, tmp_path / f"b{suffix}", "--tonemap", tonemap).exit_code == 0
    settings = vkbloom.presets["photo"].replace(tonemap=tonemap)
    final = renderer.apply(vkbloom.read(path, expand=4), settings)["final"]
    written = vkbloom.write(tmp_path / f"c{suffix}", final)
    np.testing.assert_array_equal(reread(tmp_path / f"b{suffix}")[1], reread(written)[1])


@pytest.mark.parametrize("expand", [1, 1.5, 4, 1024])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_expanded_highlights_come_back(dtype: type, expand: float, tmp_path: Path) -> None:
    levels = np.random.default_rng(0).integers(0, np.iinfo(dtype).max + 1, (64, 64, 3))
    levels[:8] = np.arange(8)[:, None, None] + np.iinfo(dtype).max - 7
    path = png(tmp_path / "a.png", levels.astype(dtype))
    image = vkbloom.read(path, expand=expand)
    bits = np.dtype(dtype).itemsize * 8
    written = vkbloom.write(tmp_path / "b.png", image, bits=bits, expand=expand)
    np.testing.assert_array_equal(reread(written)[1], levels)


def test_expand(tmp_path: Path) -> None:
    path = png(tmp_path / "a.png", room())
    files = {value: tmp_path / f"{value}.exr" for value in ("1", "2", "8")}
    for value, file in files.items():
        assert apply(path, file, "--expand", value, "--no-bloom").exit_code == 0
    decoded = decode_srgb(room().astype(np.float32) / 255)
    np.testing.assert_allclose(vkbloom.read(files["1"]), decoded, atol=1e-3)
    largest = [float(vkbloom.read(file).max()) for file in files.values()]
    assert largest == sorted(largest)
    assert largest[0] < 1 < largest[1] < 2 < largest[2] < 8


class TestRead:
    def test_formula(self, tmp_path: Path) -> None:
        levels = np.arange(256, dtype=np.uint8)
        path = png(tmp_path / "a.png", np.repeat(levels[None, :, None], 3, axis=2))
        plain, found = vkbloom.read(path), vkbloom.read(path, expand=4)
        # Highlights begin at 0.8.
        knee = 0.8
        steep = 1 / (1 - knee) - 1 / (4 - knee)
        over = np.maximum(plain.astype(np.float64) - knee, 0)
        expected = np.where(plain > knee, knee + over / (1 - steep * over), plain)
        np.testing.assert_allclose(found, expected, rtol=1e-5)
        assert found.max() == pytest.approx(4, rel=1e-5)
        for off in (None, 1):
            np.testing.assert_array_equal(vkbloom.read(path, expand=off), plain)

    def test_floats_stay(self, tmp_path: Path) -> None:
        image = np.random.default_rng(0).random((4, 4, 3), np.float32) * 3
        path = vkbloom.write(tmp_path / "a.exr", image)
        np.testing.assert_array_equal(vkbloom.read(path, expand=4), image)


@pytest.mark.parametrize(
    ("name", "store", "preset"),
    [("a.exr", vkbloom.write, "bevy_natural"), ("a.jpg", store_ultra_hdr, "photo")],
)
def test_where_files_of_floats_start(
    tmp_path: Path, renderer: vkbloom.Renderer, name: str, store: Any, preset: str
) -> None:
    path = tmp_path / name
    store(path, (np.random.default_rng(0).random((64, 64, 3)) * 2).astype(np.float16))
    assert apply(path, tmp_path / "b.exr").exit_code == 0
    expected = renderer.apply(vkbloom.read(path), vkbloom.presets[preset])["final"]
    np.testing.assert_array_equal(vkbloom.read(tmp_path / "b.exr"), expected)


class TestSettingsOfFiles:
    @pytest.fixture
    def image(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Image:
        monkeypatch.chdir(tmp_path)
        image = np.random.default_rng(0).random((12, 16, 3), np.float32)
        vkbloom.write("a.png", image)
        vkbloom.write("a.exr", image * 3)
        return image

    @pytest.mark.usefixtures("image")
    @pytest.mark.parametrize("source", ["a.png", "a.exr"])
    @pytest.mark.parametrize("made", ["b.png", "b.exr"])
    @pytest.mark.parametrize(
        "words", [(), ("--preset", "kino"), ("--expand", "9", "--knee", "0.3")]
    )
    def test_a_picture_gives_the_same_picture_again(
        self, source: str, made: str, words: tuple[str, ...]
    ) -> None:
        first = apply(source, made, *words)
        assert first.exit_code == 0, first.stderr
        suffix = Path(made).suffix
        assert apply(source, f"c{suffix}", "--settings", made).exit_code == 0
        np.testing.assert_array_equal(vkbloom.read(f"c{suffix}"), vkbloom.read(made))

    def test_what_the_explorer_saves_gives_what_it_shows(
        self, image: Image, renderer: vkbloom.Renderer
    ) -> None:
        settings = vkbloom.presets["photo"].replace(intensity=0.5)
        for text in (settings.to_json(), json.dumps(settings.to_dict(), indent=2) + "\n"):
            Path("settings.json").write_text(text)
            assert apply("a.png", "b.exr", "--settings", "settings.json").exit_code == 0
            expected = renderer.apply(vkbloom.read("a.png", expand=4), settings)["final"]
            found = vkbloom.read("b.exr").astype(np.float32)
            np.testing.assert_allclose(found, expected, rtol=1e-3)
        # Options change the settings, of every command.
        words = ("--settings", "settings.json", "--intensity", "0.25", "--bits", "32")
        assert apply("a.png", "b.exr", *words).exit_code == 0
        assert json.loads(facts_in(Path("b.exr"))["settings"])["intensity"] == 0.25
        words = ("--size", "16x16", "--bloom-size", "8x8", "--settings", "b.exr")
        drawn = run("render", "-o", "r.exr", *words)
        assert drawn.exit_code == 0, drawn.stderr
        assert json.loads(facts_in(Path("r.exr"))["settings"])["intensity"] == 0.25


def test_a_picture_of_a_grid_gives_itself_again(tmp_path: Path) -> None:
    image = np.random.default_rng(0).random((12, 16, 3), np.float32)
    file, out = vkbloom.write(tmp_path / "a.png", image), tmp_path / "g"
    assert run("grid", file, "-o", out, "--axis", "intensity=0.5").exit_code == 0
    made = out / "000_final.png"
    assert apply(file, tmp_path / "b.png", "--settings", made).exit_code == 0
    np.testing.assert_array_equal(vkbloom.read(tmp_path / "b.png"), vkbloom.read(made))


_TWICE = ("--amount", "2", "--intensity", "0.002")


class TestFaintBlooms:
    """A bloom that adds less than 1 % of the light has a note with the remedy."""

    @pytest.mark.parametrize(
        ("source", "words", "told"),
        [
            ("a.png", ("--preset", "blender_streaks"), "lower --threshold, or --expand 8"),
            ("a.png", ("--preset", "blender_streaks", "--expand", "8"), ""),
            ("a.png", ("--preset", "blender_streaks", "--expand", "1"), "or --expand 8"),
            ("a.png", ("--preset", "blender_streaks", "--expand", "1.2"), "or --expand 2.4"),
            ("a.exr", ("--preset", "kino", "--intensity", "0.002"), "light: lower --threshold\n"),
            ("a.png", ("--preset", "bevy_natural"), ""),
            ("a.png", ("--preset", "bevy_natural", "--intensity", "0.004"), "0.39 % of the"),
            ("a.exr", ("--method", "pyramid", "--intensity", "0.004"), "light: --amount 2\n"),
            (
                "a.exr",
                ("--method", "pyramid", "--amount", "2", "--intensity", "0.002"),
                "raise --int",
            ),
            # Of an expanded picture, "screen" makes white.
            (
                "a.png",
                ("--preset", "star4", "--amount", "0.1"),
                "threshold, or --amount 2\n",
            ),
            ("a.png", ("--preset", "kino", "--no-bloom"), ""),
            ("a.png", ("--preset", "blender_streaks", "--mask", "mask.png"), ""),
            ("a.png", (), ""),
            # Of a picture without lights, that of the default says what shows.
            ("dim.png", (), "adds 0.19 % of the picture's light; the presets mist"),
            ("dark.png", (), "the brightest value is 0.212; the presets mist, soft and dreamy"),
            ("dim.png", ("--intensity", "0.2"), ""),
            ("dim.png", ("--preset", "mist"), ""),
            ("dim.png", ("--amount", "0"), ""),
        ],
    )
    def test_note(
        self,
        tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch,
        source: str,
        words: tuple[str, ...],
        told: str,
    ) -> None:
        monkeypatch.chdir(tmp_path)
        image = PHOTOS["astronaut"]()
        png(Path("a.png"), image)
        png(Path("dim.png"), np.minimum(image, 206))
        png(Path("dark.png"), image // 2)
        vkbloom.write("a.exr", vkbloom.read("a.png"))
        vkbloom.write("mask.png", np.full(image.shape[:2], 255, np.uint8))
        result = apply(source, "b.exr", *words)
        assert result.exit_code == 0, result.stderr
        assert ("note: the bloom" in result.stderr) is bool(told)
        assert told in result.stderr


LOOKS = ("mist", "soft", "dreamy", "film_halation", "star4", "star6", "anamorphic")


PICTURES: dict[str, Callable[[], Image]] = {
    "rocket": data.rocket,
    "hubble": data.hubble_deep_field,
    "motorcycle": lambda: data.stereo_motorcycle()[0],
    "coffee": data.coffee,
    "astronaut": data.astronaut,
    "chelsea": data.chelsea,
}


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[Path, Image]:
    folder = tmp_path_factory.mktemp("photographs")
    images = {}
    for name, load in PICTURES.items():
        image = load()
        step = max(image.shape) // 320
        images[png(folder / f"{name}.png", image[::step, ::step])] = image[::step, ::step]
    return images


class TestLooks:
    """Each look is visible and breaks nothing, on photographs that scikit-image has."""

    @pytest.mark.parametrize("amount", [1, 2])
    @pytest.mark.parametrize("look", LOOKS)
    def test_visible(
        self, files: dict[Path, Image], look: str, amount: float, tmp_path: Path
    ) -> None:
        result = apply(*files, "-o", f"{tmp_path}/", "--preset", look, "--amount", amount)
        assert result.exit_code == 0, result.stderr
        for file, image in files.items():
            change = measure(image, reread(tmp_path / file.name)[1])
            if look not in WITH_RAYS:
                assert change.seen > 0.07, file.stem
            elif file.stem == "chelsea":
                # It has no lights.
                assert change.seen < 0.01
            else:
                # Rays are narrow, and a picture stays between them.
                assert 0.015 < change.seen < 0.35, file.stem
            assert change.fault(look) == "", file.stem

    @pytest.mark.parametrize("look", ["mist", "soft", "dreamy"])
    @pytest.mark.parametrize("shown", ["a lake before dawn", "a leaf"])
    def test_a_dim_picture_without_details(self, shown: str, look: str, tmp_path: Path) -> None:
        """Fine glows alone are invisible where there is neither a light nor an edge."""
        down, across = np.mgrid[:SIDE, : SIDE * 3 // 2] / SIDE
        if shown == "a leaf":
            level = 165 + 60 * np.sin(14 * (across + 0.4 * down))
            tint = (0.55, 1.0, 0.1)
        else:
            # A shore rises into the sky at the right.
            shore = 1 / (1 + np.exp(-(down - 1.3 + 0.6 * across) / 0.08))
            level = (110 + 70 * np.cos(1.2 * (down - 0.3))) * (1 - shore) + 25 * shore
            tint = (0.4, 0.65, 1.0)
        image = np.rint(level[..., None] * tint).astype(np.uint8)
        file = png(tmp_path / "a.png", image)
        assert apply(file, tmp_path / "b.png", "--preset", look).exit_code == 0
        change = measure(image, reread(tmp_path / "b.png")[1])
        assert change.seen > 0.07
        assert change.fault(look) == ""

    @pytest.mark.parametrize("look", WITH_RAYS)
    def test_a_bright_wall_has_no_rays(self, look: str, tmp_path: Path) -> None:
        """Neither its corner nor its edge is a small light, of which a part of a star is seen."""
        image = np.full((SIDE, SIDE, 3), (0, 80, 110), np.uint8)
        down, across = np.mgrid[:SIDE, :SIDE]
        image[(across > 80) & (down > 60 + (across - 80) * 0.3)] = (215, 242, 225)
        file = png(tmp_path / "a.png", image)
        assert apply(file, tmp_path / "b.png", "--preset", look).exit_code == 0
        difference = reread(tmp_path / "b.png")[1].astype(int) - image
        assert (difference.max(axis=2) > 8).mean() < 0.005
        assert difference.max() < 50

    @pytest.mark.parametrize("look", ["photo", *LOOKS])
    def test_a_bright_sky_keeps_its_clouds(self, look: str, tmp_path: Path) -> None:
        """From blue to white, over a dark ground; each step of the sky is there afterwards."""
        across = np.linspace(0, 1, SIDE)
        clouds = 6 * np.sin(np.arange(SIDE)[:, None] / 5)
        sky = np.stack([205 + 40 * across, 222 + 26 * across, 236 + 12 * across], axis=-1)
        image = np.rint(sky + clouds[..., None]).astype(np.uint8)
        image[120:] = 40
        result = apply(png(tmp_path / "a.png", image), tmp_path / "b.png", "--preset", look)
        assert result.exit_code == 0, result.stderr
        after = reread(tmp_path / "b.png")[1]
        change = measure(image, after)
        assert change.cut == 0
        assert change.white < 0.02
        assert change.contrast > 0.6
        # The brightest component of a row has no outline where something is cut off.
        peaks = after[20:80].max(axis=2).astype(int)
        assert np.abs(np.diff(peaks, axis=1)).max() <= 3
        assert (peaks == 255).mean() < 0.02

    @pytest.mark.parametrize("look", ["photo", *LOOKS])
    def test_a_bright_sky_is_not_speckled(self, look: str, tmp_path: Path) -> None:
        """Noise of a few levels, as of JPEG, does not become colours."""
        noise = np.random.default_rng(0).integers(-3, 4, (SIDE, SIDE, 1))
        sky = (np.array([240, 247, 252]) + noise).astype(np.uint8)
        assert (
            apply(png(tmp_path / "a.png", sky), tmp_path / "b.png", "--preset", look).exit_code == 0
        )
        after = reread(tmp_path / "b.png")[1].astype(int)
        assert (after[..., 2] - after[..., 0]).std() < 3

    @pytest.mark.parametrize("look", ["film_halation", "anamorphic", "mist"])
    def test_a_grey_picture_gets_the_light_of_a_look(
        self, look: str, tmp_path: Path, renderer: vkbloom.Renderer
    ) -> None:
        """Red alone is blurred by halation, and an anamorphic streak is mostly blue."""
        grey = np.ascontiguousarray(PHOTOS["astronaut"]()[:, :, 1])
        file = png(tmp_path / "a.png", grey)
        assert apply(file, tmp_path / "b.png", "--preset", look).exit_code == 0
        after = reread(tmp_path / "b.png")[1]
        assert after.shape == (*grey.shape, 1)
        start = vkbloom.read(file, expand=4 if look == "mist" else None)
        final = renderer.apply(start, vkbloom.presets[look])["final"][..., :3]
        light = np.repeat((final @ (0.2126, 0.7152, 0.0722))[..., None], 3, axis=2)
        expand = 4 if look == "mist" else None
        vkbloom.write(tmp_path / "c.png", light.astype(np.float32), expand=expand)
        expected = reread(tmp_path / "c.png")[1][..., :1]
        assert np.abs(after.astype(int) - expected).max() <= 1

    @pytest.mark.parametrize("look", ["photo", *LOOKS])
    def test_an_amount_of_0_changes_nothing(self, look: str, tmp_path: Path) -> None:
        image = PHOTOS["astronaut"]()
        # Transparent pixels hide a bloom, but not one of none.
        alpha = np.tile(np.linspace(0, 255, image.shape[1]), (len(image), 1)).astype(np.uint8)
        image = np.dstack([image, alpha])
        words = ("--preset", look, "--amount", "0")
        result = apply(png(tmp_path / "a.png", image), tmp_path / "b.png", *words)
        assert (result.exit_code, result.stderr) == (0, "")
        np.testing.assert_array_equal(reread(tmp_path / "b.png")[1], image)

    @pytest.mark.parametrize(
        ("preset", "amount", "intensity"),
        [("mist", 0.5, 0.075), ("star4", 2, 72), ("halation", 2, 1), ("photo", 1.5, 0.225)],
    )
    def test_the_amount_is_a_factor_of_intensities(
        self, preset: str, amount: float, intensity: float, tmp_path: Path
    ) -> None:
        file = png(tmp_path / "a.png", PHOTOS["room"]())
        words = ("--preset", preset, "--amount", amount, "--glare", "streaks:intensity=0.5")
        assert apply(file, tmp_path / "b.png", *words).exit_code == 0
        made = json.loads(facts_in(tmp_path / "b.png")["settings"])
        assert made["intensity"] == pytest.approx(intensity)
        assert made["glare"][0]["intensity"] == 0.5 * amount
        # The settings of the file have it.
        assert apply(file, tmp_path / "c.png", "--settings", tmp_path / "b.png").exit_code == 0
        first, again = (reread(tmp_path / name)[1] for name in ("b.png", "c.png"))
        np.testing.assert_array_equal(first, again)

    def test_which_looks_are_expanded(self, tmp_path: Path) -> None:
        file = png(tmp_path / "a.png", PHOTOS["room"]()[::4, ::4])
        found = set()
        for look in ("photo", *LOOKS, "bevy_natural", "halation"):
            assert apply(file, tmp_path / "b.png", "--preset", look).exit_code == 0
            found |= {look} if facts_in(tmp_path / "b.png").get("expand") == "4" else set()
        assert found == {"photo", "mist", "dreamy"}

    def test_amounts_beyond_2_are_refused(self, tmp_path: Path) -> None:
        result = apply("a.png", tmp_path / "b.png", "--amount", "3")
        assert result.exit_code == 2
        assert "--amount" in result.stderr
