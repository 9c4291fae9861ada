"""The pipeline cache on disk: kept, read, and never trusted."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.processes import output
from vkbloom import AdapterInfo, Pyramid, Renderer, Scene, Separable
from vkbloom._io import disk_cache

SIZE = (16, 16)


def read(driver: bytes) -> bytes | None:
    """Return the data for a driver, as another process reads it."""
    return disk_cache.DiskCache("pipelines").read(driver)


def write(driver: bytes, data: bytes) -> None:
    disk_cache.DiskCache("pipelines").write(driver, data)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "not" / "there yet"
    monkeypatch.setenv("VKBLOOM_CACHE_DIR", str(folder))
    return folder / "pipelines"


def render(scene: Scene) -> None:
    with Renderer(validation=True) as renderer:
        renderer.render(scene, size=SIZE)


def only_file(folder: Path) -> Path:
    """Return the one file that is there: no temporary one is left."""
    (file,) = folder.iterdir()
    return file


def driver_of(file: Path) -> bytes:
    return bytes.fromhex(file.stem)


def test_a_file_is_made_for_the_driver(folder: Path, scene: Scene) -> None:
    with Renderer() as renderer:
        assert not folder.exists()
        renderer.render(scene, size=SIZE)
        file = only_file(folder)
        assert file.read_bytes().startswith(disk_cache.MAGIC)
        kept = read(driver_of(file))
        # The header of Vulkan's cache data: its length, 32, and version, 1.
        assert kept is not None
        assert kept[:8] == bytes([32, 0, 0, 0, 1, 0, 0, 0])
        assert len(driver_of(file)) == 16


def test_it_is_written_only_for_new_pipelines(folder: Path, scene: Scene) -> None:
    with Renderer() as renderer:
        renderer.render(scene, size=SIZE)
        only_file(folder).unlink()
        renderer.render(scene, size=SIZE, time=0.5)
        assert list(folder.iterdir()) == []
        renderer.render(scene, Separable(tonemap="aces"), size=SIZE)
        only_file(folder)


def test_it_is_given_to_the_driver(file: Path, scene: Scene) -> None:
    # A second name, since the file itself is replaced where drivers keep nothing.
    other = file.parent.parent / "same"
    os.link(file, other)
    os.utime(file, (0, 0))
    render(scene)
    # What is read, and is undamaged, gets the time of its use.
    assert other.stat().st_mtime > 0


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory, scene: Scene) -> tuple[str, bytes]:
    """The name and the content of a file."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("VKBLOOM_CACHE_DIR", str(tmp_path_factory.mktemp("made")))
        render(scene)
        file = only_file(Path(os.environ["VKBLOOM_CACHE_DIR"]) / "pipelines")
        return file.name, file.read_bytes()


@pytest.fixture
def file(folder: Path, made: tuple[str, bytes]) -> Path:
    """The file, in the folder of the test."""
    folder.mkdir(parents=True)
    (folder / made[0]).write_bytes(made[1])
    return folder / made[0]


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda content: b"",
    "begun": lambda content: content[:5],
    "no digest": lambda content: content[: len(disk_cache.MAGIC) + 16],
    "cut": lambda content: content[:-1],
    "longer": lambda content: content + b"more",
    "bit flipped": lambda content: content[:-1] + bytes([content[-1] ^ 1]),
    "zeros": lambda content: bytes(len(content)),
    "foreign": lambda content: b"another program's file " * 100,
    "other version": lambda content: content.replace(b"cache 1", b"cache 2"),
    "random": lambda content: os.urandom(1 << 20),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_file_is_not_read(file: Path, damage: str) -> None:
    assert read(driver_of(file))
    file.write_bytes(DAMAGES[damage](file.read_bytes()))
    assert read(driver_of(file)) is None


def test_a_damaged_file_is_replaced(file: Path, scene: Scene) -> None:
    file.write_bytes(b"damaged")
    render(scene)
    assert read(driver_of(only_file(file.parent)))


def test_another_drivers_file_is_not_read(file: Path) -> None:
    data = read(driver_of(file))
    assert data is not None
    # Written for another driver, and then renamed.
    write(bytes(16), data)
    (file.parent / f"{bytes(16).hex()}.bin").replace(file)
    assert read(driver_of(file)) is None


@pytest.mark.parametrize(
    "data", [b"", b"\0", bytes(32), bytes([255]) * 100, os.urandom(4096)], ids=len
)
def test_a_right_digest_over_wrong_data_does_no_harm(file: Path, scene: Scene, data: bytes) -> None:
    # As a driver might leave it that changed its data but not its UUID. The validation layer says
    # so if such data reaches the driver with a header that promises more than there is.
    driver = driver_of(file)
    write(driver, data)
    assert read(driver) == data
    with Renderer() as renderer:
        renderer.render(scene, size=SIZE)
    assert read(driver) not in (data, None)


def test_a_folder_in_place_of_the_file(file: Path, folder: Path, scene: Scene) -> None:
    file.unlink()
    file.mkdir()
    render(scene)
    assert only_file(folder).is_dir()


def test_a_folder_that_cannot_be_written(
    tmp_path: Path, scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Below a file, where also those cannot write who may write anywhere.
    (tmp_path / "file").write_bytes(b"")
    monkeypatch.setenv("VKBLOOM_CACHE_DIR", str(tmp_path / "file" / "folder"))
    render(scene)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_no_folder_is_no_cache(
    tmp_path: Path, scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("VKBLOOM_CACHE_DIR", "")
    monkeypatch.chdir(tmp_path)
    render(scene)
    assert list(tmp_path.iterdir()) == []


def test_files_of_others_stay(folder: Path) -> None:
    foreign = {
        "a.txt": b"x" * 400,
        "00.txt": b"",
        "0ff.bin": disk_cache.MAGIC,
        "aa.bin": b"x" * 400,
    }
    base = folder.parent / "shaders"
    (base / "bb.bin").mkdir(parents=True)
    for name, content in foreign.items():
        (base / name).write_bytes(content)
        os.utime(base / name, (0, 0))
    cache = disk_cache.DiskCache("shaders")
    cache.max_bytes = 1000
    for number in range(12):
        cache.written = {}
        cache.write(bytes([number]), bytes(100 - disk_cache.HEADER_SIZE))
    kept = {file.name: file.read_bytes() for file in base.iterdir() if file.is_file()}
    assert {name: kept.pop(name) for name in foreign} == foreign
    assert (base / "bb.bin").is_dir()
    assert sorted(kept) == [f"{number:02x}.bin" for number in range(2, 12)]


def test_files_of_each_kind_are_bounded(folder: Path) -> None:
    for kind in ("pipelines", "shaders"):
        for number in range(4):
            cache = disk_cache.DiskCache(kind)  # of another process
            cache.max_bytes = 300
            cache.write(bytes([number]), bytes(100 - disk_cache.HEADER_SIZE))
            cache.write(bytes([number]), bytes(100 - disk_cache.HEADER_SIZE))
        names = sorted(file.stem for file in (folder.parent / kind).iterdir())
        assert names == ["01", "02", "03"]


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have other folders")
def test_the_users_cache_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("VKBLOOM_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert disk_cache.folder() == tmp_path / "vkbloom"
    monkeypatch.setenv("HOME", str(tmp_path))
    for ignored in ("", "relative"):
        monkeypatch.setenv("XDG_CACHE_HOME", ignored)
        assert disk_cache.folder() == tmp_path / ".cache" / "vkbloom"
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert disk_cache.folder() == tmp_path / ".cache" / "vkbloom"


def test_a_cpu_compiles_each_shader_of_a_plan_once(
    new_renderer: Callable[[], Renderer], scene: Scene
) -> None:
    """Whoever reads a target, and whichever way a line is blurred, the pipeline is the same."""
    # Of this size some levels are drawn, and some of these are read by draws, others by dispatches.
    image, pyramid = np.zeros((200, 300, 4), np.float16), Pyramid(levels=6)
    renderer = new_renderer()
    if renderer.info.type != "cpu":
        pytest.skip("GPUs have other variants, and know who reads a target")
    renderer.apply(image, pyramid, framebuffers="final")
    created = renderer._core.pipeline_count
    shaders = [step.shader for step in renderer.plan(image, pyramid, framebuffers="final").passes]
    # Passes of one shader differ by what their filters are.
    assert len(set(shaders)) <= created < len(shaders)
    renderer.render(scene, size=SIZE, framebuffers="final")
    plan = renderer.plan(scene, size=SIZE, framebuffers="final")
    shaders = [step.shader for step in plan.passes]
    assert renderer._core.pipeline_count - created == len(set(shaders)) < len(shaders)


def test_mesa_compiles_no_more_for_sizes_of_buffers(tmp_path: Path, software: AdapterInfo) -> None:
    """Mesa 22.3 takes a byte of the size of texels for a level: of 64 x 768 it is 0."""
    if software.driver != "llvmpipe":
        pytest.skip("the cache on disk is Mesa's")
    counts = []
    for height in (704, 768):
        folder = tmp_path / str(height)
        folder.mkdir()
        code = (
            "import sys, numpy, vkbloom\n"
            f"image = numpy.zeros(({height}, 64, 3), numpy.float16)\n"
            "with vkbloom.Renderer(sys.argv[1]) as renderer:\n"
            "    renderer.apply(image, vkbloom.Pyramid(levels=4), framebuffers=('final',))\n"
        )
        output("-c", code, software.name, MESA_SHADER_CACHE_DIR=str(folder))
        counts.append(sum(file.is_file() for file in folder.rglob("*")))
    assert counts[0] == counts[1] > 1
