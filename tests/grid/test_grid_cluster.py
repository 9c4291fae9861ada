"""Grids over the workers of a Dask cluster."""

from __future__ import annotations

import os
import re
import signal
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.grid.stores import contents, make
from vkbloom import Frames, check_grid
from vkbloom._grid import cluster

distributed = pytest.importorskip("distributed")
xr = pytest.importorskip("xarray")

# Of sockets and event loops that Dask leaves to the garbage collector.
pytestmark = [
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with (
        distributed.LocalCluster(
            n_workers=2,
            threads_per_worker=1,
            dashboard_address="127.0.0.1:0",
            silence_logs=50,
            # By default all clusters of a user share one.
            local_directory=str(tmp_path_factory.mktemp("workers")),
        ) as local,
        distributed.Client(local) as opened,
    ):
        yield opened


def slow_mean(frames: Frames) -> float:
    time.sleep(0.04)
    return float(frames["final"].mean())


slow_mean.framebuffers = ("final",)  # type: ignore[attr-defined]


def test_runs_are_made_in_linear_time() -> None:
    class Counted:
        reads = 0

        @property
        def count(self) -> int:
            Counted.reads += 1
            return 1

    blocks: Any = [Counted() for _ in range(1000)]
    layout: Any = SimpleNamespace(point_size=1)
    runs = list(cluster._runs(blocks, layout, 300))
    assert [len(run) for run in runs] == [300, 300, 300, 100]
    assert Counted.reads <= 2 * len(blocks)


def test_workers_write_what_one_process_writes(
    client: Any, tmp_path: Path, undisturbed: Path
) -> None:
    made = make(tmp_path / "a.zarr", client=client)
    assert contents(tmp_path / "a.zarr") == contents(undisturbed)
    assert made["done"].values.all()


def test_workers_write_to_a_cloud(client: Any, s3: str, tmp_path: Path) -> None:
    url = "s3://grids/cluster.zarr"
    # The workers have other variables of the environment than this process.
    options = {"endpoint_url": s3, "key": "anything", "secret": "anything"}
    store = pytest.importorskip("zarr").storage.FsspecStore.from_url(url, storage_options=options)
    mask = np.linspace(0, 1, 16 * 21, dtype=np.float32).reshape(16, 21)
    made = make(store, client=client, mask=mask)
    assert made["done"].values.all()
    make(tmp_path / "a.zarr", mask=mask)
    assert contents(store) == contents(tmp_path / "a.zarr")


def test_killed_worker_is_replaced(client: Any, tmp_path: Path, undisturbed: Path) -> None:
    killed = threading.Event()

    def kill() -> None:
        while not any((tmp_path / "a.zarr" / "mean").glob("c.*")):
            time.sleep(0.02)
        first = min(client.run(os.getpid).values())
        os.kill(first, signal.SIGKILL)
        killed.set()

    killer = threading.Thread(target=kill)
    killer.start()
    plain: dict[str, Any] = {"reduce": {"mean": slow_mean}, "framebuffers": ("final",)}
    made = make(tmp_path / "a.zarr", client=client, chunks={"exposure": 3}, **plain)
    killer.join()
    assert killed.is_set()
    assert made["done"].values.all()
    np.testing.assert_array_equal(made["final"].values, xr.open_zarr(undisturbed)["final"].values)
    assert check_grid(tmp_path / "a.zarr").complete
    client.wait_for_workers(2, timeout=120)


class Failing:
    """Fails at one point, until a file is there."""

    framebuffers = ("final",)

    def __init__(self, file: Path, *, mends: bool) -> None:
        self.file, self.mends = file, mends

    def __call__(self, frames: Frames) -> float:
        if frames.settings.exposure == 1.0 and not self.file.exists():
            if self.mends:
                self.file.touch()
            raise ZeroDivisionError("this point")
        return 1.0


def test_failed_run_is_repeated(client: Any, tmp_path: Path) -> None:
    reduce = {"n": Failing(tmp_path / "tried", mends=True)}
    made = make(tmp_path / "a.zarr", client=client, reduce=reduce, framebuffers=())
    assert made["done"].values.all()


def test_repeated_failure_keeps_completed_blocks(client: Any, tmp_path: Path) -> None:
    reduce = {"n": Failing(tmp_path / "mended", mends=False)}
    changes: dict[str, Any] = {"reduce": reduce, "framebuffers": (), "chunks": {"blur_scale": 4}}
    with pytest.raises(ZeroDivisionError, match="this point"):
        make(tmp_path / "a.zarr", client=client, **changes)
    report = check_grid(tmp_path / "a.zarr")
    assert 0 < report.done < report.points
    assert not report.problems
    (tmp_path / "mended").touch()
    assert make(tmp_path / "a.zarr", client=client, **changes)["done"].values.all()


def test_a_worker_without_the_adapter(
    client: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(vkbloom.AdapterNotFoundError):
        make(tmp_path / "a.zarr", client=client, adapter="no such")
    assert not (tmp_path / "a.zarr").exists()


@pytest.mark.parametrize(
    ("what", "other"), [("adapter", "Radeon"), ("driver", "Mesa 1.2.3"), ("version", "0.0.1")]
)
def test_a_worker_with_another_driver_or_version_is_refused(
    client: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, what: str, other: str
) -> None:
    """As if the grid were laid out on another machine than the workers."""
    lay_out = cluster.lay_out_there

    def lay_out_elsewhere(*arguments: Any) -> Any:
        layout = lay_out(*arguments)
        return replace(layout, origin={**layout.origin, what: other})

    monkeypatch.setattr(cluster, "lay_out_there", lay_out_elsewhere)
    software = next(one for one in vkbloom.adapters() if one.type == "cpu")
    driver = software.driver_info or software.driver
    own = {"adapter": software.name, "driver": driver, "version": vkbloom.__version__}[what]
    words = f"{what}: the worker's {re.escape(own)}.* is not the grid's {other}"
    with pytest.raises(ValueError, match=words):
        make(tmp_path / "a.zarr", client=client)
    assert check_grid(tmp_path / "a.zarr").done == 0


def test_what_is_no_client_is_refused() -> None:
    with pytest.raises(TypeError, match="client"):
        make(Path("a.zarr"), client=3)
