"""Textures from glTF: images in all places, samplers, texture coordinates, damaged files."""

from __future__ import annotations

import base64
import dataclasses
import json
import math
import sys
import warnings
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.exhaustive import EXHAUSTIVE
from tests.framebuffers import write_image
from tests.images import noise
from tests.refusals import assert_refused, rows
from tests.scene.gltf_documents import (
    BYTE,
    FLOAT,
    SHORT,
    Document,
    at,
    load_or_refuse,
    nested,
    places,
    refusals,
)
from tests.scene.parts import WHITE, Mesh, Texture, load_mesh
from tests.screens import CAMERA, panel
from tests.srgb import decode_srgb
from vkbloom import Renderer, Scene

Array = NDArray[Any]
HALF = 2.0**-11  # half of the last bit of a half float, relative

CORNERS = [[-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0]]
PLACES = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]]
FRONT = [0, 1, 2, 0, 2, 3]


def encode(pixels: Array, folder: Path, suffix: str = ".png", **attributes: Any) -> bytes:
    """Return an image file of pixels (h, w, C), uint8 or uint16."""
    path = write_image(folder / f"encoded{suffix}", pixels, **attributes)
    data = path.read_bytes()
    path.unlink()
    return data


def linear(pixels: Array) -> NDArray[np.float64]:
    """Return the light of sRGB integers."""
    return decode_srgb(pixels[..., :3] / np.iinfo(pixels.dtype).max)


def make_textured(image: dict[str, Any] | None = None, **texture: Any) -> Document:
    """Return a square whose base colour has a texture; y is up in the file and down in the mesh."""
    document = Document()
    primitive = document.primitive(CORNERS, indices=document.accessor(FRONT, SHORT), material=0)
    primitive["attributes"]["TEXCOORD_0"] = document.accessor(PLACES)
    document.json["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    document.json["textures"] = [{"source": 0, **texture}]
    document.json["images"] = [{"uri": "a.png"} if image is None else image]
    return document


def base(mesh: Mesh) -> Texture:
    (surface,) = mesh.surfaces
    return surface.base


def places_of(mesh: Mesh) -> Array:
    """Return the texture coordinates of the base colour."""
    assert mesh.texcoords is not None
    return mesh.texcoords[:, :2]


@pytest.fixture
def load(tmp_path: Path) -> Callable[[Document], Mesh]:
    """Loads a document as a file without a warning; "a.png" beside it is an image of 4 x 3."""

    def load_it(document: Document) -> Mesh:
        if not (tmp_path / "a.png").exists():
            (tmp_path / "a.png").write_bytes(encode(noise(3, 4, 3, dtype="uint8"), tmp_path))
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return document.load(tmp_path)

    return load_it


Load = Callable[[Document], Mesh]


# Images


@pytest.mark.parametrize("dtype", ["uint8", "uint16"])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_images_are_decoded_from_srgb(
    load: Load, tmp_path: Path, channels: int, dtype: str
) -> None:
    pixels = noise(30, 40, channels, dtype=dtype)
    # A file's own words on its colours do not count.
    data = encode(pixels, tmp_path, **{"oiio:ColorSpace": "lin_rec709_scene"})
    (tmp_path / "a.png").write_bytes(data)
    level = base(load(make_textured())).levels[0]
    assert level.shape == (30, 40, 4)
    colours = linear(pixels[..., :3] if channels > 2 else pixels[..., [0, 0, 0]])
    np.testing.assert_allclose(level[..., :3], colours, rtol=1.01 * HALF, atol=1e-7)
    assert (level[..., 3] == 1).all()


def test_jpeg(load: Load, tmp_path: Path) -> None:
    # Smooth, or compression would change much.
    ramp = np.linspace(0, 255, 64).astype(np.uint8)
    pixels = np.stack(np.broadcast_arrays(ramp, ramp[:, np.newaxis], np.uint8(100)), axis=-1)
    data = encode(pixels, tmp_path, ".jpg", Compression="jpeg:98", Orientation=6)
    (tmp_path / "a b.jpg").write_bytes(data)
    level = base(load(make_textured({"uri": "a%20b.jpg"}))).levels[0]
    # Exif's orientation is no part of glTF: nothing is turned.
    np.testing.assert_allclose(level[..., :3], linear(pixels), atol=0.04)


def test_images_wherever_they_lie(load: Load, tmp_path: Path) -> None:
    data = encode(noise(4, 5, 3, dtype="uint8"), tmp_path)
    (tmp_path / "a.png").write_bytes(data)
    (tmp_path / "inner").mkdir()
    # The name and the MIME type say nothing: the first bytes do.
    (tmp_path / "inner" / "b.bin").write_bytes(data)
    by_view = make_textured()
    by_view.json["images"] = [{"bufferView": by_view.view(data), "mimeType": "image/jpeg"}]
    (tmp_path / "mesh.glb").write_bytes(by_view.as_glb())
    loaded = [
        load(make_textured()),
        load(make_textured({"uri": "inner/b.bin"})),
        load(make_textured({"uri": "data:image/png;base64," + base64.b64encode(data).decode()})),
        load(by_view),
        load_mesh(tmp_path / "mesh.glb"),
    ]
    for mesh in loaded:
        np.testing.assert_array_equal(base(mesh).levels[0], base(loaded[0]).levels[0])
        assert mesh.texcoords is not None
        np.testing.assert_array_equal(mesh.texcoords, loaded[0].texcoords)


def test_an_image_is_read_once(load: Load, monkeypatch: pytest.MonkeyPatch) -> None:
    document = make_textured()
    second = document.primitive(CORNERS, material=1, indices=document.accessor(FRONT, BYTE))
    second["attributes"]["TEXCOORD_0"] = document.accessor(PLACES)
    document.json["materials"].append(
        {"emissiveFactor": [1.0, 1.0, 1.0], "emissiveTexture": {"index": 1}}
    )
    document.json["textures"].append({"source": 0})
    monkeypatch.setattr("vkbloom._scene.gltf_textures.MAX_TEXELS", 4 * 3)
    first, last = load(document).surfaces
    assert first.base is last.emission
    assert first.emission is last.base is WHITE
    # With another sampler it is another texture.
    document.json["samplers"] = [{"wrapS": 33071}]
    document.json["textures"][1]["sampler"] = 0
    with pytest.raises(ValueError, match=r"mesh\.gltf.*images\[0\].*too many"):
        load(document)


# What is drawn


def test_factor_times_vertex_colour_times_texture(
    renderer: Renderer, load: Load, tmp_path: Path
) -> None:
    size = (8, 6)
    colours, lights = noise(*size[::-1], 3, dtype="uint8"), noise(3, 4, 3, dtype="uint8")
    (tmp_path / "a.png").write_bytes(encode(colours, tmp_path))
    (tmp_path / "b.png").write_bytes(encode(lights, tmp_path))
    document = make_textured(sampler=0)
    wall = panel(size)
    positions = wall.vertices[:, :3] * (1, -1, 1)
    (primitive,) = document.json["meshes"][0]["primitives"]
    attributes = primitive["attributes"]
    attributes["POSITION"] = document.accessor(positions)
    attributes["COLOR_0"] = document.accessor([[0.5, 1.0, 0.25]] * 4)
    attributes["NORMAL"] = document.accessor([[0, 0, 1]] * 4)
    attributes["TEXCOORD_0"] = document.accessor(places_of(wall))
    # Its own texture coordinates: upside down.
    attributes["TEXCOORD_1"] = document.accessor(places_of(wall) * (1, -1))
    primitive["indices"] = document.accessor(wall.indices, SHORT)
    document.json["samplers"] = [{"magFilter": 9728, "minFilter": 9728}]
    document.json["textures"].append({"source": 1, "sampler": 0})
    document.json["images"].append({"uri": "b.png"})
    material = document.json["materials"][0]
    material["pbrMetallicRoughness"]["baseColorFactor"] = [1.0, 0.5, 0.125, 1.0]
    material["emissiveFactor"] = [1.0, 0.5, 0.25]
    material["emissiveTexture"] = {"index": 1, "texCoord": 1}
    material["extensions"] = {"KHR_materials_emissive_strength": {"emissiveStrength": 6.0}}
    document.json["extensionsUsed"] = ["KHR_materials_emissive_strength"]
    scene = Scene(body=load(document), camera=CAMERA)
    shown = renderer.render(scene, None, size, shading="deferred")
    expected = linear(colours) * (0.5, 0.5, 0.03125)
    # The texture is rounded to half, and so is the product.
    np.testing.assert_allclose(shown["albedo"][..., :3], expected, rtol=2.1 * HALF, atol=1e-7)
    expected = linear(lights)[::-1].repeat(2, 0).repeat(2, 1) * (6.0, 3.0, 1.5)
    np.testing.assert_allclose(shown["brightness"][..., :3], expected, rtol=2.1 * HALF, atol=1e-6)
    # And the files' vertex colours and textures reach the forward system.
    lit = renderer.render(scene, None, size)["scene"]
    other = dataclasses.replace(scene, body=dataclasses.replace(scene.body, surfaces=()))
    assert np.abs(lit.astype(int) - renderer.render(other, None, size)["scene"]).max() > 50


def test_triangles_without_a_texture_come_first(load: Load) -> None:
    document = make_textured()
    document.primitive([[5.0, 0, 0], [6.0, 0, 0], [5.0, 1, 0]])
    mesh = load(document)
    (surface,) = mesh.surfaces
    assert surface.index_count == 6
    assert mesh.indices.tolist() == [6, 7, 8, 0, 1, 2, 3, 4, 5]
    assert mesh.texcoords is not None
    assert not mesh.texcoords[6:].any()


def test_flat_normals_take_the_texture_coordinates_with_them(load: Load) -> None:
    mesh = load(make_textured())
    np.testing.assert_array_equal(places_of(mesh), np.array(PLACES)[FRONT])
    # x = -1 is the left, y = 1 the top, which the mesh has at -1.
    np.testing.assert_array_equal(mesh.vertices[:, :2] / 2 + 0.5, places_of(mesh))


@pytest.mark.parametrize("factor", [None, [0.0, 0.0, 0.0]])
def test_no_emission_needs_no_texture(load: Load, factor: Any) -> None:
    document = make_textured()
    del document.json["materials"][0]["pbrMetallicRoughness"]
    document.json["materials"][0]["emissiveTexture"] = {"index": 0}
    document.json["images"][0]["uri"] = "gone.png"
    if factor is not None:
        document.json["materials"][0]["emissiveFactor"] = factor
    mesh = load(document)
    assert mesh.emission is None
    assert not mesh.surfaces


# Samplers


@pytest.mark.parametrize(
    ("sampler", "address_mode", "filters", "levels"),
    [
        (None, ("repeat", "repeat"), ("linear", "linear", "linear"), 3),
        ({}, ("repeat", "repeat"), ("linear", "linear", "linear"), 3),
        ({"wrapS": 33071}, ("clamp-to-edge", "repeat"), ("linear", "linear", "linear"), 3),
        ({"wrapT": 33648}, ("repeat", "mirror-repeat"), ("linear", "linear", "linear"), 3),
        ({"magFilter": 9728}, ("repeat", "repeat"), ("nearest", "linear", "linear"), 3),
        ({"minFilter": 9728}, ("repeat", "repeat"), ("linear", "nearest", "nearest"), 1),
        ({"minFilter": 9729}, ("repeat", "repeat"), ("linear", "linear", "nearest"), 1),
        ({"minFilter": 9984}, ("repeat", "repeat"), ("linear", "nearest", "nearest"), 3),
        ({"minFilter": 9985}, ("repeat", "repeat"), ("linear", "linear", "nearest"), 3),
        ({"minFilter": 9986}, ("repeat", "repeat"), ("linear", "nearest", "linear"), 3),
        ({"minFilter": 9987}, ("repeat", "repeat"), ("linear", "linear", "linear"), 3),
    ],
)
def test_samplers(
    load: Load, sampler: Any, address_mode: Any, filters: tuple[str, ...], levels: int
) -> None:
    document = make_textured() if sampler is None else make_textured(sampler=0)
    document.json["samplers"] = [sampler or {}]
    made = base(load(document))
    assert made.address_mode == address_mode
    assert (made.mag_filter, made.min_filter, made.mipmap_filter) == filters
    assert len(made.levels) == levels


# Texture coordinates


@pytest.mark.parametrize(("component", "full"), [(BYTE, 255), (SHORT, 65535)])
def test_normalized_integers(load: Load, component: int, full: int) -> None:
    document = make_textured()
    attributes = document.json["meshes"][0]["primitives"][0]["attributes"]
    places = np.array([[0, 0], [0, full], [full, full], [full // 3, 0]])
    attributes["TEXCOORD_0"] = document.accessor(places, component, normalized=True)
    np.testing.assert_allclose(places_of(load(document)), (places / full)[FRONT], atol=1e-7)
    document.json["accessors"][-1]["normalized"] = False
    with pytest.raises(ValueError, match=r"mesh\.gltf.*TEXCOORD_0.*not normalized"):
        load(document)


def turn(offset: tuple[float, float], angle: float, scale: tuple[float, float]) -> Array:
    """Scale, then turn counter-clockwise as one sees it with v down, then move."""
    u, v = (np.array(PLACES) * scale).T
    complex_places = (u - 1j * v) * np.exp(1j * angle)
    return np.stack((complex_places.real + offset[0], -complex_places.imag + offset[1]), axis=1)


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({}, PLACES),
        ({"offset": [0.25, -3.0]}, turn((0.25, -3.0), 0, (1, 1))),
        ({"scale": [2.0, -0.5]}, turn((0, 0), 0, (2, -0.5))),
        ({"rotation": 0.3}, turn((0, 0), 0.3, (1, 1))),
        (
            {"offset": [0.1, 0.2], "rotation": -2.0, "scale": [3.0, 0.5]},
            turn((0.1, 0.2), -2.0, (3.0, 0.5)),
        ),
        # The extension's example: the lower left quarter of the picture.
        (
            {"offset": [0, 1], "rotation": math.pi / 2, "scale": [0.5, 0.5]},
            [[0, 1], [0.5, 1], [0.5, 0.5], [0, 0.5]],
        ),
    ],
)
def test_texture_transforms(load: Load, given: dict[str, Any], expected: Any) -> None:
    document = make_textured()
    info = document.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
    info["extensions"] = {"KHR_texture_transform": given}
    document.json["extensionsUsed"] = ["KHR_texture_transform"]
    document.json["extensionsRequired"] = ["KHR_texture_transform"]
    np.testing.assert_allclose(places_of(load(document)), np.array(expected)[FRONT], atol=1e-6)


@pytest.mark.parametrize("place", [1, 3])
def test_other_sets_of_texture_coordinates(load: Load, place: int) -> None:
    document = make_textured()
    info = document.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
    info["texCoord"] = place
    others = np.array(PLACES) * 0.5
    attributes = document.json["meshes"][0]["primitives"][0]["attributes"]
    attributes[f"TEXCOORD_{place}"] = document.accessor(others)
    np.testing.assert_allclose(places_of(load(document)), others[FRONT])
    # The transform's own number goes before it.
    info["extensions"] = {"KHR_texture_transform": {"texCoord": 0}}
    document.json["extensionsUsed"] = ["KHR_texture_transform"]
    np.testing.assert_allclose(places_of(load(document)), np.array(PLACES)[FRONT])


# What is left out, and what is wrong


def test_other_textures_are_named(load: Load, tmp_path: Path) -> None:
    document = make_textured()
    material = document.json["materials"][0]
    material["normalTexture"] = {"index": 0}
    material["occlusionTexture"] = {"index": 0}
    material["pbrMetallicRoughness"]["metallicRoughnessTexture"] = {"index": 0}
    material["emissiveFactor"] = [1.0, 1.0, 1.0]
    material["emissiveTexture"] = {"index": 1}
    document.json["textures"].append({"extensions": {"KHR_texture_basisu": {"source": 0}}})
    document.json["extensionsUsed"] = ["KHR_texture_basisu"]
    (tmp_path / "a.png").write_bytes(encode(noise(3, 4, 3, dtype="uint8"), tmp_path))
    with pytest.warns(UserWarning, match="left out") as caught:
        mesh = document.load(tmp_path)
    assert len(caught) == 1
    for part in (
        "metallic-roughness textures",
        "normal textures",
        "occlusion textures",
        "whose image only an extension gives",
        "extension KHR_texture_basisu",
    ):
        assert part in str(caught[0].message)
    assert base(mesh) is not WHITE


INFO = "materials.0.pbrMetallicRoughness.baseColorTexture"


@pytest.mark.parametrize(("call", "error"), rows(__file__, "damaged textures of glTF"))
def test_damage_is_named(tmp_path: Path, call: str, error: str) -> None:
    folder = tmp_path / "model"
    folder.mkdir()
    for file in (folder / "a.png", tmp_path / "a.png"):
        file.write_bytes(encode(noise(3, 4, 3, dtype="uint8"), tmp_path))
    (folder / "link.png").symlink_to(tmp_path / "a.png")

    def damage(path: str, value: Any) -> Mesh:
        document = make_textured()
        if path == "samplers":
            document.json["textures"][0]["sampler"] = 0
        at(document.json, path, value)
        return document.load(folder)

    assert_refused(call, error, {"damage": damage, "INFO": INFO})


def test_a_missing_image_is_an_os_error_that_names_it(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"images\[0\] of .*mesh\.gltf.*a\.png"):
        make_textured().load(tmp_path)


def test_too_few_texture_coordinates(load: Load) -> None:
    document = make_textured()
    attributes = document.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["TEXCOORD_0"] = document.accessor(PLACES[:3])
    with pytest.raises(ValueError, match=r"mesh\.gltf.*TEXCOORD_0 has 3 entries for 4 vertices"):
        load(document)
    attributes["TEXCOORD_0"] = document.accessor([*PLACES[:3], [np.nan, 0]])
    with pytest.raises(ValueError, match=r"mesh\.gltf.*TEXCOORD_0 holds NaN"):
        load(document)
    attributes["TEXCOORD_0"] = document.accessor(PLACES, FLOAT, type="SCALAR")
    with pytest.raises(ValueError, match=r"mesh\.gltf.*'SCALAR'.*VEC2"):
        load(document)


@pytest.mark.parametrize("suffix", [".png", ".jpg"])
def test_an_image_cut_anywhere_is_refused(tmp_path: Path, suffix: str) -> None:
    data = encode(noise(16, 16, 3, dtype="uint8"), tmp_path, suffix)
    for length in [*range(0, len(data) // 2, len(data) // 12), len(data) - 40]:
        (tmp_path / "a.png").write_bytes(data[:length])
        with pytest.raises(ValueError, match=r"mesh\.gltf: images\[0\]") as caught:
            make_textured().load(tmp_path)
        assert "vkbloom-" not in str(caught.value)


def huge_png(width: int, height: int) -> bytes:
    """Return a PNG whose header promises more than it holds."""
    header = width.to_bytes(4, "big") + height.to_bytes(4, "big") + b"\x08\x02\0\0\0"
    data = b"\x89PNG\r\n\x1a\n"
    for kind, body in ((b"IHDR", header), (b"IDAT", zlib.compress(b"\0" * 99)), (b"IEND", b"")):
        data += len(body).to_bytes(4, "big") + kind + body
        data += zlib.crc32(kind + body).to_bytes(4, "big")
    return data


@pytest.mark.parametrize("size", [(16385, 1), (1, 16385), (12000, 12000), (2**20, 2**20)])
def test_huge_images_are_refused_by_their_header(tmp_path: Path, size: tuple[int, int]) -> None:
    (tmp_path / "a.png").write_bytes(huge_png(*size))
    with pytest.raises(ValueError, match=r"mesh\.gltf: images\[0\]"):
        make_textured().load(tmp_path)


def test_an_image_file_that_is_too_long(tmp_path: Path) -> None:
    # Without blocks on the disk.
    with (tmp_path / "a.png").open("wb") as file:
        file.truncate(2**30 + 1)
    with pytest.raises(ValueError, match=r"mesh\.gltf.*images\[0\].*too many"):
        make_textured().load(tmp_path)


def test_without_openimageio_the_message_says_what_to_install(
    load: Load, monkeypatch: pytest.MonkeyPatch
) -> None:
    load(make_textured())
    monkeypatch.setitem(sys.modules, "OpenImageIO", None)
    with pytest.raises(ModuleNotFoundError, match=r"textures.*pip install vkbloom\[images\]"):
        load(make_textured())


def test_any_json_value_in_any_place_loads_or_is_refused(tmp_path: Path) -> None:
    document = nested()
    document.json["accessors"][0]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": document.view(b"\0"), "componentType": BYTE},
        "values": {"bufferView": document.view(b"\0")},
    }
    (primitive,) = document.json["meshes"][0]["primitives"]
    primitive["attributes"]["TEXCOORD_0"] = document.accessor(PLACES[:3])
    data = encode(noise(3, 4, 3, dtype="uint8"), tmp_path)
    document.json["images"] = [{"bufferView": document.view(data), "mimeType": "image/png"}]
    document.json["samplers"] = [
        {"wrapS": 33071, "wrapT": 33648, "magFilter": 9728, "minFilter": 9986}
    ]
    document.json["textures"] = [{"source": 0, "sampler": 0}]
    (material,) = document.json["materials"]
    material["pbrMetallicRoughness"]["baseColorTexture"] = {"index": 0}
    transform = {"offset": [0.0, 1.0], "rotation": 0.5, "scale": [2.0, 2.0], "texCoord": 0}
    material["emissiveTexture"] = {
        "index": 0,
        "texCoord": 0,
        "extensions": {"KHR_texture_transform": transform},
    }
    material["emissiveFactor"] = [1.0, 1.0, 1.0]
    material["extensions"] = {"KHR_materials_emissive_strength": {"emissiveStrength": 2.0}}
    document.json["extensionsUsed"] = ["KHR_texture_transform", "KHR_materials_emissive_strength"]
    document.json["nodes"].append({"matrix": np.eye(4).ravel().tolist(), "children": []})
    original = json.loads(document.as_gltf())
    path = tmp_path / "mesh.gltf"
    assert load_or_refuse(path, json.dumps(original).encode()) is not None
    # Most of them break something; were all let through, the checks would be off.
    step, least = (1, 2400) if EXHAUSTIVE else (10, 240)
    assert refusals(path, original, places(original), step=step) > least
