"""What ``vkbloom apply`` keeps of an OpenEXR file that bloom does not change."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest

import vkbloom
from tests.cli.calls import run
from tests.io.parts import reread

KEPT: dict[str, tuple[str, Any]] = {
    "smpte:TimeCode": ("timecode", (16909060, 2271560481)),
    "smpte:KeyCode": ("keycode", (1, 2, 3, 4, 5, 4, 64)),
    "FramesPerSecond": ("rational", (24000, 1001)),
    "PixelAspectRatio": ("float", 2.0),
    "screenWindowWidth": ("float", 1.5),
    "screenWindowCenter": ("float2", (0.25, 0.5)),
    "worldToCamera": ("matrix", tuple(map(float, range(16)))),
    "Copyright": ("string", "me"),
    "DateTime": ("string", "2024:01:02 03:04:05"),
    "ExposureTime": ("float", 0.5),
    "isoSpeed": ("float", 400.0),
    "textureformat": ("string", "LatLong Environment"),
    "openexr:lineOrder": ("string", "decreasingY"),
    "view": ("string", "left"),
    "nuke/version": ("string", "13"),
    "commitHash": ("string", "abc"),
    "share": ("string", "of it"),
    "studio text": ("string", "ä"),
    "studio int": ("int", -7),
    "studio numbers": ("vector", (1.0, 2.0, 3.0)),
    "studio names": ("string[2]", ("a", "b")),
}
OF_COLOURS: dict[str, tuple[str, Any]] = {
    "adoptedNeutral": ("float2", (0.25, 0.5)),
    "renderingTransform": ("string", "a"),
}
UNTRUE: dict[str, tuple[str, Any]] = {
    "md5": ("string", "x"),
    "image checksum": ("string", "x"),
    "studio/sha256": ("string", "x"),
    "nuke/node_hash": ("string", "x"),
    "cryptomatte/12/manifest": ("string", "{}"),
    "multiView": ("string[2]", ("left", "right")),
    "vkbloom:expand": ("string", "4"),
    "vkbloom:framebuffer": ("string", "final"),
}


def store(path: Path, compression: str = "piz", parts: int = 1) -> Path:
    """Write parts whose attribute "studio int" is -7, -8 and so on."""
    specs = []
    for number in range(parts):
        spec = oiio.ImageSpec(24, 20, 3, "half")
        spec.x, spec.y = 2, 3
        spec.full_x, spec.full_y, spec.full_width, spec.full_height = 0, 0, 30, 32
        for name, (kind, value) in {**KEPT, **OF_COLOURS, **UNTRUE}.items():
            # (OpenEXR's own attributes of all parts are the same.)
            changed = value - number if name == "studio int" else value
            spec.attribute(name, oiio.TypeDesc(kind), changed)
        spec.attribute("compression", compression)
        if parts > 1:
            spec.attribute("oiio:subimagename", f"part{number}")
        specs.append(spec)
    writer = oiio.ImageOutput.create(str(path))
    assert writer is not None
    for number in range(parts):
        mode = ("AppendSubimage",) if number else ()
        assert writer.open(str(path), specs if parts > 1 and not number else specs[number], *mode)
        assert writer.write_image(np.full((20, 24, 3), number + 0.5, np.float16))
    assert writer.close(), writer.geterror()
    return path


def attributes(path: Path) -> dict[str, Any]:
    return {attribute.name: attribute.value for attribute in reread(path)[0].extra_attribs}


@pytest.mark.parametrize("compression", ["piz", "none", "zips", "dwaa:80", "b44"])
def test_exr_to_exr(tmp_path: Path, compression: str) -> None:
    source, target = store(tmp_path / "a.exr", compression), tmp_path / "b.exr"
    before = attributes(source)
    assert run("apply", source, target, "--intensity", 0).exit_code == 0
    found = attributes(target)
    expected = {name: value for name, (_, value) in {**KEPT, **OF_COLOURS}.items()}
    assert {name: found.get(name) for name in expected} == expected
    assert found["compression"] == before["compression"]
    assert found.get("openexr:dwaCompressionLevel") == before.get("openexr:dwaCompressionLevel")
    assert not {*UNTRUE} & {*found}
    assert "vkbloom:settings" in found
    old, new = reread(source)[0], reread(target)[0]
    # (The data window grows to the display window, which bloom fills.)
    for name in ("full_x", "full_y", "full_width", "full_height"):
        assert getattr(old, name) == getattr(new, name)
    # The settings of the result are those that made it.
    again = run("apply", target, tmp_path / "c.exr", "--settings", target)
    assert again.exit_code == 0
    assert {*attributes(tmp_path / "c.exr")} == {*found}


def test_a_chosen_part(tmp_path: Path) -> None:
    source, target = store(tmp_path / "a.exr", parts=2), tmp_path / "b.exr"
    assert run("apply", source, target, "--subimage", 1).exit_code == 0
    found = attributes(target)
    assert (found["studio int"], found["oiio:subimagename"]) == (-8, "part1")
    assert found["smpte:TimeCode"] == KEPT["smpte:TimeCode"][1]
    assert found["compression"] == "piz"


@pytest.mark.parametrize("words", [("--input-colour", "ACEScg"), ("--primaries", "p3")])
def test_converted_colours(tmp_path: Path, words: tuple[str, ...]) -> None:
    source, target = store(tmp_path / "a.exr"), tmp_path / "b.exr"
    assert run("apply", source, target, *words).exit_code == 0
    found = attributes(target)
    assert not {*OF_COLOURS} & {*found}
    assert found["smpte:TimeCode"] == KEPT["smpte:TimeCode"][1]


def test_other_formats_and_arrays_have_none_of_it(tmp_path: Path) -> None:
    source = store(tmp_path / "a.exr")
    assert run("apply", source, tmp_path / "b.png").exit_code == 0
    assert not {name for name in attributes(tmp_path / "b.png") if name.startswith("studio")}
    _, facts = vkbloom.read(source, metadata=True)
    assert not {name for name in facts if name.startswith(("studio", "smpte"))}
