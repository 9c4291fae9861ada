"""Grids on disk: complete, resumable, rejected if they differ, repaired if they are damaged."""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.exhaustive import by_turns
from tests.grid.stores import AXES, POINTS, REDUCE, Reduced, Stop, contents, make, source
from tests.images import noise
from vkbloom import Frames, Pyramid, Renderer, Separable, check_grid, psf

xr = pytest.importorskip("xarray")
zarr = pytest.importorskip("zarr")
google_crc32c = pytest.importorskip("google_crc32c")
zstd = pytest.importorskip("numcodecs.zstd")


def count_frames(frames: Frames) -> int:
    return len(frames)


pytestmark = pytest.mark.usefixtures("kept_renderers")


@pytest.fixture
def copy(undisturbed: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(undisturbed, tmp_path / "copy.zarr"))


class TestWhole:
    def test_store_equals_the_grid_in_memory(self, undisturbed: Path, renderer: Renderer) -> None:
        expected = vkbloom.grid(
            source(),
            Separable(),
            AXES,
            framebuffers=("final", "bloom"),
            reduce=REDUCE,
            renderer=renderer,
        )
        found = xr.open_zarr(undisturbed)
        assert set(found) == {*expected, "done"}
        for name in expected:
            assert found[name].dims == expected[name].dims
            assert found[name].dtype == expected[name].dtype
            assert found[name].attrs.items() >= expected[name].attrs.items()
            np.testing.assert_array_equal(found[name].values, expected[name].values)
        for name in expected.coords:
            np.testing.assert_array_equal(found[name].values, expected[name].values)
            assert found[name].attrs == expected[name].attrs
        assert found["done"].values.all()

    def test_black_pictures_are_stored_too(self, tmp_path: Path) -> None:
        black = np.zeros((4, 4, 3), np.uint8)
        make(tmp_path / "a.zarr", source=black, reduce=None, framebuffers="final")
        assert check_grid(tmp_path / "a.zarr").complete

    def test_scenes_and_one_point(self, tmp_path: Path, scene: vkbloom.Scene) -> None:
        plain: dict[str, Any] = {"chunks": None, "reduce": None, "framebuffers": "final"}
        lone = make(tmp_path / "a.zarr", source=scene, axes={}, size=(20, 10), **plain)
        assert lone["final"].shape == (10, 20, 4)
        assert bool(lone["done"])
        moving = make(
            tmp_path / "b.zarr", source=scene, axes={"time": [0, 0.5]}, size=(20, 10), **plain
        )
        np.testing.assert_array_equal(moving["final"][0].values, lone["final"].values)
        assert check_grid(tmp_path / "b.zarr").complete

    @pytest.mark.parametrize(
        ("settings", "axis", "values"),
        [
            (Pyramid(levels=2), "glare", [(), vkbloom.Halo(), "godot_dirt"]),
            (vkbloom.Convolution(), "psf", [psf.gaussian(1), np.ones((3, 5), np.float32)]),
            (
                Pyramid(glare=(vkbloom.Dirt(),)),
                "glare.0.image",
                [None, np.ones((2, 3), np.float32)],
            ),
        ],
    )
    def test_fields_that_are_objects_are_axes(
        self, tmp_path: Path, settings: Any, axis: str, values: Any
    ) -> None:
        store = tmp_path / "a.zarr"
        stored = vkbloom.grid(source(), settings, {axis: values}, store=store)
        renderer = vkbloom.default_renderer()
        for place, value in enumerate(values):
            expected = renderer.apply(source(), settings.replace(**{axis: value}))["final"]
            np.testing.assert_array_equal(stored["final"][place], expected)
        in_memory = vkbloom.grid(
            source(), settings, {axis: values}, progress=False, renderer=renderer
        )
        assert list(in_memory[axis].values) == list(stored[axis].values)
        kept = contents(store)
        vkbloom.grid(source(), settings, {axis: values}, store=store)
        assert contents(store) == kept
        with pytest.raises(ValueError, match=rf"axes\.{axis}"):
            vkbloom.grid(source(), settings, {axis: values[:1]}, store=store)

    def test_uploaded_images_have_their_masks(self, tmp_path: Path, renderer: Renderer) -> None:
        levels = np.arange(16 * 21, dtype=np.uint16).reshape(16, 21).astype(np.uint8)
        store = tmp_path / "glow.zarr"

        def make(mask: Any, **more: Any) -> Any:
            image = renderer.upload(source(), mask=mask)
            axes = {"exposure": [0.0, 1.0]}
            return vkbloom.grid(image, Pyramid(), axes, renderer=renderer, **more)

        grid = make(levels, store=store)
        expected = renderer.apply(source(), Pyramid(exposure=1.0), mask=levels)["final"]
        assert np.array_equal(grid["final"].isel(exposure=1), expected)
        assert np.array_equal(make(levels)["final"], grid["final"])
        kept = contents(store)
        make(levels, store=store)
        assert contents(store) == kept
        with pytest.raises(ValueError, match=r"source\.images"):
            make(255 - levels, store=store)

    def test_masks_and_emissions_beside_an_array(self, tmp_path: Path, renderer: Renderer) -> None:
        levels = np.arange(16 * 21, dtype=np.uint16).reshape(16, 21).astype(np.uint8)
        beside: dict[str, Any] = {
            "mask": levels,
            "emission": noise(16, 21, 3, dtype="float32", seed=9),
        }
        plain: dict[str, Any] = {"axes": {"exposure": [0.0, 1.0]}, "chunks": None, "reduce": None}
        store = tmp_path / "glow.zarr"
        grid = make(store, **beside, **plain)
        for index, exposure in enumerate((0.0, 1.0)):
            expected = renderer.apply(source(), Separable(exposure=exposure), **beside)
            for name in ("final", "bloom"):
                assert np.array_equal(grid[name][index], expected[name])
        in_memory = make(None, **beside, **plain)
        assert np.array_equal(in_memory["bloom"], grid["bloom"])
        kept = contents(store)
        make(store, **beside, **plain)
        assert contents(store) == kept
        for name, array in beside.items():
            with pytest.raises(ValueError, match=r"source\.images"):
                make(store, **{**beside, name: array[::-1].copy()}, **plain)

    def test_default_chunks_hold_about_a_megabyte(self, tmp_path: Path) -> None:
        axes = {"intensity": np.linspace(0, 1, 40), "blur_scale": np.linspace(1, 2, 3)}
        picture = noise(128, 96, 3, dtype="uint8")
        made = make(
            tmp_path / "a.zarr",
            source=picture,
            axes=axes,
            chunks=None,
            reduce=None,
            framebuffers="final",
        )
        # 36 KiB a point: 28 of them, along the axis that is visited fastest.
        assert made["final"].chunks[:2] == ((28, 12), (1, 1, 1))

    def test_complete_store_is_reported_complete(self, undisturbed: Path) -> None:
        report = check_grid(undisturbed)
        assert report.complete
        assert str(report) == f"{POINTS} of {POINTS} points are done"


class TestResumed:
    def test_resume_renders_only_missing_points(self, tmp_path: Path, undisturbed: Path) -> None:
        store = tmp_path / "a.zarr"
        # In the fourth of the chunks, which have six points each.
        Reduced.count, Reduced.last = 0, 3 * 6 + 2
        try:
            with pytest.raises(Stop):
                make(store)
        finally:
            Reduced.count, Reduced.last = 0, None
        # It opens while it is not complete.
        part = xr.open_zarr(store)
        stored = int(part["done"].sum())
        assert stored in {2 * 6, 3 * 6}
        whole = xr.open_zarr(undisturbed)
        for name in ("final", "mean"):
            there = part[name].where(part["done"]).dropna("exposure", how="all")
            xr.testing.assert_equal(
                there, whole[name].where(part["done"]).dropna("exposure", how="all")
            )
        made = make(store)
        # And one for the shapes of what is reduced.
        assert Reduced.count == POINTS - stored + 1
        assert made["done"].values.all()
        assert contents(store) == contents(undisturbed)

    def test_resume_false_refuses_an_existing_store(self, copy: Path) -> None:
        before = contents(copy)
        with pytest.raises(FileExistsError, match="already has a grid"):
            make(copy, resume=False)
        assert contents(copy) == before

    def test_default_chunks_are_those_of_the_store(self, copy: Path, undisturbed: Path) -> None:
        make(copy, chunks=None)
        assert contents(copy) == contents(undisturbed)


class TestRefused:
    @pytest.mark.parametrize(
        ("changes", "message"),
        [
            (
                {"settings": Separable(intensity=0.5)},
                r"settings.intensity: 1.0 in .* 0.5 requested",
            ),
            (
                {"settings": Pyramid(), "axes": {"exposure": AXES["exposure"]}, "chunks": None},
                r"settings.method: \"separable\"",
            ),
            ({"axes": {**AXES, "exposure": [0.0, 1.0, 2.5]}}, r"axes.exposure: \[0.0, 1.0, 2.0\]"),
            ({"axes": dict(reversed(AXES.items()))}, "order of axes"),
            ({"axes": {**AXES, "knee": [0.0]}}, "axes.knee: not in the store"),
            ({"source": noise(16, 21, 3, dtype="float32", seed=9)}, "source.images"),
            ({"framebuffers": "final"}, "variables.bloom: .* not requested"),
            ({"reduce": {**REDUCE, "mean": count_frames}}, "reduce.mean"),
            ({"chunks": {}}, r"chunk: \[3, 1, 2\] in the store, \[1, 1, 1\] requested"),
        ],
    )
    def test_another_grid_is_refused_with_its_differences(
        self, copy: Path, changes: Any, message: str
    ) -> None:
        before = contents(copy)
        with pytest.raises(ValueError, match=f"another grid; .*{message}.*; delete it or name"):
            make(copy, **changes)
        assert contents(copy) == before

    def test_another_version_is_refused(self, copy: Path) -> None:
        change_identity(copy, version="9.9")
        with pytest.raises(ValueError, match=r'version: "9.9" in the store, "0.1.0" requested'):
            make(copy)

    def test_another_format_version_is_refused(self, copy: Path) -> None:
        change_identity(copy, format=99)
        for call in (make, check_grid):
            with pytest.raises(ValueError, match="its format version 99 is not 3"):
                call(copy)

    def test_something_else(self, tmp_path: Path) -> None:
        (tmp_path / "a").mkdir()
        (tmp_path / "a" / "letter.txt").write_text("dear")
        zarr.open_group(tmp_path / "b", mode="w")
        for name in ("a", "b"):
            before = contents(tmp_path / name)
            for call in (make, check_grid):
                with pytest.raises(ValueError, match="its content is not a grid"):
                    call(tmp_path / name)
            assert contents(tmp_path / name) == before

    def test_nothing(self, tmp_path: Path) -> None:
        with pytest.raises(FileNotFoundError):
            check_grid(tmp_path / "a.zarr")


NAMED = r"exposure=0\.\.2, threshold=0.5, blur_scale=1.5\.\.2"
NESTED = b'{"attributes": ' + b"[" * 100_000


def flip_bit(content: bytes) -> bytes:
    """Change a bit among the values, where nothing but the checksum can tell."""
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]


def of_zeros(size: int) -> bytes:
    """Return a right chunk of another size."""
    return with_sum(bytes(zstd.Zstd().encode(bytes(size))))


#: A file, what becomes of its content (None: it is removed), and what is told.
DAMAGES: list[tuple[str, Callable[[bytes], bytes] | None, str]] = [
    ("final/c.0.1.1.0.0.0", lambda content: content[:-7], f" is damaged .*, of {NAMED}"),
    ("final/c.0.1.1.0.0.0", flip_bit, f" is damaged .*, of {NAMED}"),
    ("final/c.0.1.1.0.0.0", lambda _: of_zeros(0), r" is damaged \(.*"),
    ("done/c.0.0.0", lambda _: of_zeros(100), r" is damaged \(.*"),
    ("channel/c.0", lambda _: of_zeros(100_000), r" is damaged \(.*"),
    ("mean/c.0.1.1", None, f" is missing, of {NAMED}"),
    ("bloom/zarr.json", None, " is missing, of all points"),
    ("final/zarr.json", lambda content: content[:100], r" is damaged \(.*, of all points"),
    ("final/zarr.json", lambda _: NESTED, " is damaged.*"),
    ("done/c.0.1.1", lambda _: b"x", f" is damaged .*, of {NAMED}"),
    ("exposure/c.0", None, " is missing, of all points"),
]


class TestDamaged:
    @pytest.mark.parametrize(("key", "change", "message"), DAMAGES)
    def test_damage_is_reported_and_mended(
        self, copy: Path, undisturbed: Path, key: str, change: Any, message: str
    ) -> None:
        content = (copy / key).read_bytes()
        (copy / key).unlink()
        if change is not None:
            (copy / key).write_bytes(change(content))
        before = contents(copy)
        report = check_grid(copy)
        assert not report.complete
        assert len(report.problems) == 1
        assert re.fullmatch(key + message, report.problems[0])
        assert contents(copy) == before
        make(copy)
        assert contents(copy) == contents(undisturbed)
        assert check_grid(copy).complete


def with_sum(content: bytes) -> bytes:
    summed: int = google_crc32c.value(content)
    return content + summed.to_bytes(4, "little")


def rewritten(path: Path, change: Callable[[dict[str, Any]], object]) -> None:
    metadata = json.loads(path.read_text())
    change(metadata)
    path.write_text(json.dumps(metadata))


def change_identity(store: Path, **changes: Any) -> None:
    """Change what a store says of its grid."""

    def change(root: dict[str, Any]) -> None:
        attributes = root["attributes"]
        attributes["vkbloom_grid"] = json.dumps(json.loads(attributes["vkbloom_grid"]) | changes)

    rewritten(store / "zarr.json", change)


CHUNKS_OF_KINDS = ["final/c.0.1.1.0.0.0", "done/c.0.0.0", "channel/c.0", "exposure/c.0"]
#: A Zstandard frame of 19 bytes that declares 64 GiB, and one of 8 KB that contains 256 MiB.
DECLARES_TOO_MUCH = b"\x28\xb5\x2f\xfd\xe0" + (1 << 36).to_bytes(8, "little") + b"\x19\0\0abc"
ONES = ((1 << 17 << 3) | 2).to_bytes(3, "little") + b"\1"
CONTAINS_TOO_MUCH = bytes.fromhex("28b52ffd0058") + ONES * 2048 + b"\1\0\0"


class TestHostile:
    """Stores that fuzzing found, or would."""

    @pytest.mark.parametrize(
        ("key", "frame"), by_turns(CHUNKS_OF_KINDS, turns=[DECLARES_TOO_MUCH, CONTAINS_TOO_MUCH])
    )
    def test_chunk_with_wrong_checksum_is_not_decompressed(
        self, copy: Path, undisturbed: Path, key: str, frame: bytes
    ) -> None:
        (copy / key).write_bytes(frame + b"\0\0\0\0")
        tracemalloc.start()
        try:
            (problem,) = check_grid(copy).problems
            make(copy)
            _, most = tracemalloc.get_traced_memory()
        finally:
            tracemalloc.stop()
        assert problem.startswith(f"{key} is damaged (Stored and computed checksum do not match")
        assert most < 64 << 20
        assert contents(copy) == contents(undisturbed)

    def test_lack_of_memory_is_not_damage(
        self, copy: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def fails(*_: object) -> None:
            raise MemoryError

        before = contents(copy)
        monkeypatch.setattr(zarr.Array, "__getitem__", fails)
        for call in (make, check_grid):
            with pytest.raises(MemoryError):
                call(copy)
        assert contents(copy) == before

    @pytest.mark.parametrize("identity", [3, [], "x", None], ids=str)
    @pytest.mark.parametrize("place", ["vkbloom_grid", "attributes"])
    def test_identity_of_a_wrong_type_is_refused(
        self, copy: Path, place: str, identity: Any
    ) -> None:
        rewritten(
            copy / "zarr.json",
            lambda root: (root if place in root else root["attributes"]).update({place: identity}),
        )
        before = contents(copy)
        for call in (make, check_grid):
            with pytest.raises(ValueError, match="its content is not a grid"):
                call(copy)
        assert contents(copy) == before


def test_partial_files_of_others_stay(tmp_path: Path) -> None:
    folder = tmp_path / "a.zarr"
    number = "0123456789abcdef" * 2
    names = ["movie.mkv.partial", "c.partial", "deeper/c.0.partial", f"deeper/c.0.{number}.partial"]
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(b"mine")
    with pytest.raises(ValueError, match="its content is not a grid"):
        make(folder)
    assert sorted(contents(folder)) == sorted(names)
    shutil.rmtree(folder)
    make(folder)
    (folder / "deeper").mkdir()
    for name in names:
        (folder / name).write_bytes(b"mine")
    killed = [folder / f"final/c.0.{number}.partial", folder / f"zarr.{number}.partial"]
    for path in killed:
        path.write_bytes(b"half of it")
    make(folder)
    assert all((folder / name).read_bytes() == b"mine" for name in names)
    assert not any(path.exists() for path in killed)


@pytest.mark.parametrize("room", [3, 20, 30, 33])
def test_a_full_disk_keeps_what_is_done(
    tmp_path: Path, undisturbed: Path, room: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A disk with room for some more keys."""
    left = [room]
    put = zarr.storage.LocalStore.set

    async def full(self: Any, key: str, value: Any) -> None:
        if left[0] <= 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        left[0] -= 1
        await put(self, key, value)

    with monkeypatch.context() as patched:
        patched.setattr(zarr.storage.LocalStore, "set", full)
        with pytest.raises(OSError, match="No space left"):
            make(tmp_path / "a.zarr")
    assert not list((tmp_path / "a.zarr").rglob("*.partial"))
    make(tmp_path / "a.zarr")
    assert contents(tmp_path / "a.zarr") == contents(undisturbed)


def test_file_size_limit_leaves_no_partial_file(tmp_path: Path) -> None:
    resource = pytest.importorskip("resource")
    image = noise(256, 256, 3, dtype="uint8")
    store = tmp_path / "a.zarr"
    # Files may not grow beyond a limit, which stops a write in its middle as a full disk does.
    # (Python ignores the signal.)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, before[1]))
    try:
        with pytest.raises(OSError, match="File too large") as caught:
            vkbloom.grid(
                image, Separable(), {"intensity": [0, 1]}, store=store, chunks={"intensity": 2}
            )
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert str(caught.value).startswith(f"[Errno 27] File too large: '{store}/")
    assert not list(store.rglob("*.partial"))
    assert check_grid(store).done == 0
    assert not check_grid(store).problems
