"""Wrong use and failures of all commands: one line on standard error, a status, and no file."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import vkbloom
from tests.cli.calls import one_line, run
from tests.grid.stores import contents
from tests.images import noise_image
from tests.io.parts import written
from tests.refusals import assert_matches, rows

pytestmark = pytest.mark.usefixtures("kept_renderers")

oiio = pytest.importorskip("OpenImageIO")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with pictures, damaged files and settings."""
    made = tmp_path_factory.mktemp("errors")
    levels = noise_image(16, 24, 3, dtype="uint8")
    (made / "two").mkdir()
    for name in ("a.png", "b.png", "two/a.png", "two/b.png"):
        vkbloom.write(made / name, levels)
    vkbloom.write(made / "small.png", levels[:6, :, :1])
    vkbloom.write(made / "alpha.png", np.dstack([levels, levels[..., :1]]))
    vkbloom.write(made / "a.exr", noise_image(16, 24, 3))
    spec = oiio.ImageSpec(2, 2, 3, "float")
    spec.channelnames = ("X", "Y", "Z")
    written(made / "xyz.exr", spec, noise_image(2, 2, 3))
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
