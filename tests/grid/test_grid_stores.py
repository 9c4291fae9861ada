"""Grids in stores that are no folders: a cloud, or memory."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import vkbloom
from tests.cli import calls
from tests.grid.conftest import KINDS
from tests.grid.grid_in_parts import render
from tests.grid.stores import AXES, colour, contents, keys_of, make
from tests.images import noise
from vkbloom import Frames, Separable, check_grid

xr = pytest.importorskip("xarray")
zarr = pytest.importorskip("zarr")

pytestmark = pytest.mark.usefixtures("kept_renderers")

ROOT = Path(__file__).resolve().parents[2]
#: How many points are left until the user interrupts the call.
LEFT = [1000]


def mean(frames: Frames) -> float:
    LEFT[0] -= 1
    if LEFT[0] == 0:
        raise KeyboardInterrupt
    return float(frames["final"].mean())


FORTY: dict[str, Any] = {
    "axes": {**AXES, "exposure": [0.0, 1.0, 2.0, 3.0, 4.0]},
    "reduce": {"mean": mean, "colour": colour},
}


@pytest.fixture(scope="module")
def forty(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store of 40 points that was written without an interruption."""
    store = tmp_path_factory.mktemp("grid") / "forty.zarr"
    make(store, **FORTY)
    return store


@pytest.mark.parametrize("elsewhere", KINDS, indirect=True)
def test_every_store_does_what_a_folder_does(
    elsewhere: Any, forty: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = elsewhere
    with pytest.raises(FileNotFoundError, match="does not exist or is empty"):
        check_grid(store)
    monkeypatch.setattr(sys.modules[__name__], "LEFT", [20])
    with pytest.raises(KeyboardInterrupt):
        make(store, **FORTY)
    monkeypatch.undo()
    report = check_grid(store)
    assert (report.points, report.problems) == (40, ())
    assert 0 < report.done < 20
    for part in ("2/2", "1/2"):
        made = make(store, **FORTY, part=part)
    assert made["done"].values.all()
    whole = contents(forty)
    assert contents(store) == whole

    keys = keys_of(store)
    keys.write("final/c.0.0.1.0.0.0", (whole["final/c.0.0.1.0.0.0"] or b"")[:-7])
    keys.remove("mean/c.1.1.0")
    problems = sorted(check_grid(store).problems)
    assert [text.split(" (")[0].split(",")[0] for text in problems] == [
        "final/c.0.0.1.0.0.0 is damaged",
        "mean/c.1.1.0 is missing",
    ]
    make(store, **FORTY)
    assert contents(store) == whole
    for change, error, message in (
        ({"resume": False}, FileExistsError, "already has a grid"),
        ({"settings": Separable(intensity=0.5)}, ValueError, "contains another grid; settings"),
    ):
        with pytest.raises(error, match=message):
            make(store, **FORTY, **change)
    keys.write("zarr.json", b"{}")
    for call in (make, check_grid):
        with pytest.raises(ValueError, match="its content is not a grid of vkbloom"):
            call(store)


@pytest.mark.parametrize("elsewhere", KINDS, indirect=True)
def test_of_processes_that_start_at_once_one_creates_the_store(
    elsewhere: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    keys = keys_of(elsewhere)
    keys.create("zarr.json", b"first")

    async def is_there(*_: object) -> bool:
        return False

    # As if this process had asked before the other one wrote.
    monkeypatch.setattr(type(keys.store), "exists", is_there)
    keys.create("zarr.json", b"second")
    assert keys.read("zarr.json") == b"first"


def test_a_killed_process_is_resumed(s3: str, tmp_path: Path) -> None:
    store = "s3://grids/killed.zarr"
    words = [sys.executable, "-m", "tests.grid.grid_in_parts", store]
    killed = subprocess.run(words, check=False, input="killed 1/1", text=True, cwd=ROOT)
    assert killed.returncode == -signal.SIGKILL
    assert 0 < check_grid(store).done < check_grid(store).points
    render(store, None)
    render(tmp_path / "whole.zarr", None)
    assert contents(store) == contents(tmp_path / "whole.zarr")


def test_the_command(tmp_path: Path) -> None:
    image = vkbloom.write(tmp_path / "a.png", noise(9, 12, 3, dtype="uint8"))
    url = "memory://grids/command.zarr"
    for out in (["-o", tmp_path / "a.zarr"], ["--store", url]):
        done = calls.succeed("grid", image, "--axis", "exposure=0,1", *out)
        assert done.stdout.startswith(f"wrote {out[1]}, 2 points")
    assert contents(url) == contents(tmp_path / "a.zarr")
    for out in ([], ["-o", tmp_path / "b", "--store", url]):
        assert calls.run("grid", image, "--axis", "exposure=0,1", *out).exit_code == 2


class TestRefused:
    @pytest.mark.parametrize(
        ("url", "error", "message"),
        [
            ("s3://no-bucket/a.zarr", OSError, "^s3://no-bucket/a.zarr: The specified bucket"),
            ("gs://grids/a.zarr", ImportError, "^store: gs://grids/a.zarr: .*gcsfs"),
        ],
    )
    def test_urls(self, s3: str, url: str, error: Any, message: str) -> None:
        for call in (make, check_grid):
            with pytest.raises(error, match=message):
                call(url)

    def test_s3_without_its_package(self, monkeypatch: pytest.MonkeyPatch) -> None:
        registry = pytest.importorskip("fsspec.registry")
        monkeypatch.delitem(registry._registry, "s3", raising=False)
        monkeypatch.setitem(sys.modules, "s3fs", None)
        with pytest.raises(ImportError, match=r"s3fs.*: pip install vkbloom\[cloud\]"):
            make("s3://grids/a.zarr")

    def test_a_store_that_cannot_be_read_is_not_damaged(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        url = "memory://grids/unreachable.zarr"
        make(url)
        before = contents(url)
        get = zarr.storage.FsspecStore.get

        async def failing(self: Any, key: str, *rest: Any, **more: Any) -> Any:
            if key.startswith("mean/c"):
                raise ConnectionError("no route")
            return await get(self, key, *rest, **more)

        with monkeypatch.context() as patched:
            patched.setattr(zarr.storage.FsspecStore, "get", failing)
            for call in (make, check_grid):
                with pytest.raises(
                    OSError, match=r"^memory://grids/unreachable.zarr/mean/c.*route"
                ):
                    call(url)
        assert contents(url) == before

    def test_what_a_cluster_cannot_write(self) -> None:
        for store in (zarr.storage.MemoryStore(), "memory://grids/a.zarr"):
            with pytest.raises(ValueError, match="is in this process alone"):
                make(store, client=3)

    def test_a_read_only_store_is_only_checked(self, undisturbed: Path, tmp_path: Path) -> None:
        store = zarr.storage.LocalStore(undisturbed, read_only=True)
        assert check_grid(store).complete
        zipped = zarr.storage.ZipStore(tmp_path / "a.zip", mode="w")
        for cannot in (store, zipped):
            with pytest.raises(ValueError, match="cannot write, remove and list keys"):
                make(cannot)
