"""Fixtures: a renderer on the software adapter under validation, scenes, and given files."""

from __future__ import annotations

import ctypes
import dataclasses
import gc
import os
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import hypothesis
import pytest

from vkbloom import AdapterInfo, Renderer, Scene, Settings, adapters

#: What the tests run on; a GPU is tested by hand, with VKBLOOM_TEST_ADAPTER=hardware.
ADAPTER = os.environ.get("VKBLOOM_TEST_ADAPTER", "software")


def pytest_configure(config: pytest.Config) -> None:
    # A shell starts background jobs with SIGINT ignored, which the tests' processes would inherit.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    # A slow machine is no failure.
    hypothesis.settings.register_profile("untimed", deadline=None)
    hypothesis.settings.load_profile("untimed")
    config.addinivalue_line("markers", "slow: takes more than ten seconds, or needs a plain heap")


def pytest_unconfigure(config: pytest.Config) -> None:
    """Look for leaks in a worker of xdist, which may end without the look at its exit."""
    if "VKBLOOM_SANITIZED" in os.environ and hasattr(config, "workerinput"):
        gc.collect()
        # (Of the library that is preloaded.)
        ctypes.CDLL(None)["__lsan_do_recoverable_leak_check"]()


def pytest_make_parametrize_id(val: object) -> str | None:
    """Name settings in the names of tests by what is not the default."""
    if not isinstance(val, Settings):
        return None
    changes = {
        field.name: getattr(val, field.name)
        for field in dataclasses.fields(val)
        if getattr(val, field.name) != field.default
    }
    return ",".join(f"{name}={value}" for name, value in changes.items()) or "default"


@pytest.fixture(scope="session", autouse=True)
def environment(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """No test reads or writes the pipeline cache of the user, or follows the user's choice: the
    adapter of all that name none is the tests' one, in the processes that they start too."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("VKBLOOM_CACHE_DIR", str(tmp_path_factory.mktemp("pipelines")))
        patch.setenv("VKBLOOM_ADAPTER", ADAPTER)
        yield


class RunsOwnModules:
    """In place of pytester's snapshot of all modules: a run's own files are forgotten alone.

    Libraries that a run is the first to import would be imported twice, which NumPy, scikit-image
    and the core's types do not stand.
    """

    def __init__(self, preserve: object) -> None:
        self.before = set(sys.modules)

    def restore(self) -> None:
        for name in set(sys.modules) - self.before:
            file = getattr(sys.modules[name], "__file__", None)
            if file and Path(file).is_relative_to(self.folder):
                del sys.modules[name]

    folder: Path


@pytest.fixture(scope="session", autouse=True)
def modules_stay(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    RunsOwnModules.folder = tmp_path_factory.getbasetemp()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("_pytest.pytester.SysModulesSnapshot", RunsOwnModules)
        yield


@pytest.fixture(scope="session")
def renderer(environment: None) -> Iterator[Renderer]:
    """A renderer whose first validation message raises, at the latest when it is closed."""
    with Renderer(validation=True) as opened:
        yield opened


@pytest.fixture
def new_renderer() -> Iterator[Callable[[], Renderer]]:
    """Opens renderers as `renderer` is one, and closes them after the test."""
    opened: list[Renderer] = []

    def open_one() -> Renderer:
        opened.append(Renderer(validation=True))
        return opened[-1]

    yield open_one
    for one in opened:
        one.close()


@pytest.fixture(scope="session")
def software(environment: None) -> AdapterInfo:
    """The software adapter, for tests of it; they are skipped where there is none."""
    for adapter in adapters():
        if adapter.type == "cpu":
            return adapter
    pytest.skip("there is no software adapter here, such as Mesa's lavapipe")


@pytest.fixture(scope="session")
def scene() -> Scene:
    return Scene.ufo()


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Meshes and frames of the original program, which lie beside the repository."""
    folder = Path(__file__).resolve().parents[2] / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("the original's meshes and frames (../shared/data) are not here")
    return folder
