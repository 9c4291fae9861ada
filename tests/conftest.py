"""Fixtures: a renderer on the software adapter under validation, scenes, and given files."""

from __future__ import annotations

import ctypes
import dataclasses
import functools
import gc
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import hypothesis
import pytest

import vkbloom
from tests.device.exceptions import reason_against
from tests.time_budget import TimeBudget
from vkbloom import AdapterInfo, Renderer, Scene, Settings, adapters
from vkbloom._custom.compiler import find_compiler
from vkbloom._renderer import interruptible
from vkbloom._settings.registry import METHODS

#: The adapter of the tests. For a GPU, set VKBLOOM_TEST_ADAPTER=hardware.
ADAPTER = os.environ.get("VKBLOOM_TEST_ADAPTER", "software")
#: Whether the core is built with sanitizers. The validation layer finds the same without them, and
#: would take a third of their time.
SANITIZED = "VKBLOOM_SANITIZED" in os.environ


def pytest_configure(config: pytest.Config) -> None:
    # A shell starts background jobs with SIGINT ignored, and the tests' processes would inherit
    # that.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    # A slow machine must not fail a test. Where more examples find more, a test asks for them.
    hypothesis.settings.register_profile(
        "untimed",
        deadline=None,
        max_examples=30,
        suppress_health_check=[
            hypothesis.HealthCheck.too_slow,
            hypothesis.HealthCheck.function_scoped_fixture,
        ],
    )
    hypothesis.settings.load_profile("untimed")
    config.pluginmanager.register(TimeBudget(), "time-budget")
    config.addinivalue_line("markers", "slow: takes more than ten seconds, or needs a plain heap")
    # What a collection of the tests makes is kept: a search for garbage finds none.
    gc.disable()


#: Seconds after which the other processes collect, whatever the first one does.
LONGEST_COLLECTION = 120


@functools.cache
def is_compiled() -> bool:
    """Whether a run before this one has compiled the tests."""
    return any(Path(__file__).parent.glob("*/__pycache__/test_*-pytest-*.pyc"))


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node: Any) -> None:
    """Where tests are not compiled yet, the first process of xdist does that for all others.

    Each would compile all tests and the packages that they import, for eight seconds.
    """
    node.workerinput["waits"] = not (is_compiled() or sys.dont_write_bytecode)


def collected(config: Any) -> Path | None:
    """Return the file that the first process makes when it has collected the tests."""
    given = getattr(config, "workerinput", {})
    name = f"vkbloom-collected-{given['testrunuid']}" if given.get("waits") else None
    return Path(tempfile.gettempdir(), name) if name else None


def is_first(config: Any) -> bool:
    return str(config.workerinput["workerid"]) == "gw0"


@pytest.hookimpl(tryfirst=True)
def pytest_collection(session: pytest.Session) -> None:
    """Wait for the first process."""
    if (file := collected(session.config)) and not is_first(session.config):
        end = time.monotonic() + LONGEST_COLLECTION
        while not file.exists() and time.monotonic() < end:
            time.sleep(0.1)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skip what the driver of this run cannot do."""
    for item in items:
        if reason := reason_against(item.name):
            item.add_marker(pytest.mark.skip(reason=reason))


def pytest_collection_finish(session: pytest.Session) -> None:
    """Hide what there is by now from garbage collections: each took a quarter of a second."""
    gc.collect()
    gc.freeze()
    gc.enable()
    if (file := collected(session.config)) and is_first(session.config):
        file.touch()


def pytest_unconfigure(config: pytest.Config) -> None:
    """Look for leaks in a worker of xdist, which may end without the look at its exit."""
    # Libraries complain about objects that are never collected.
    gc.unfreeze()
    if (file := collected(config)) and is_first(config):
        file.unlink(missing_ok=True)
    if SANITIZED and hasattr(config, "workerinput"):
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


@pytest.fixture(autouse=True)
def methods_of_the_package() -> Iterator[None]:
    """No test finds a method that another one has loaded."""
    yield
    for name in [*METHODS]:
        if METHODS.is_added(name):
            METHODS.unregister(name)


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
    """A renderer whose first validation message raises an exception, at the latest when it is
    closed."""
    with Renderer(validation=not SANITIZED) as opened:
        yield opened


@pytest.fixture
def new_renderer() -> Iterator[Callable[[], Renderer]]:
    """Opens renderers like `renderer`, and closes them after the test."""
    opened: list[Renderer] = []

    def open_one() -> Renderer:
        opened.append(Renderer(validation=not SANITIZED))
        return opened[-1]

    yield open_one
    for one in opened:
        one.close()


class Kept(Renderer):
    """Stays open for the next command, which does not compile the same shaders again."""

    def close(self) -> None:
        pass


@pytest.fixture(scope="module")
def kept(environment: None) -> Iterator[dict[object, Kept]]:
    """Open renderers, by what decides how they are opened."""
    opened: dict[object, Kept] = {}
    yield opened
    for one in opened.values():
        Renderer.close(one)


@pytest.fixture
def kept_renderers(kept: dict[object, Kept], monkeypatch: pytest.MonkeyPatch) -> None:
    """The commands of a module's tests share their renderers."""

    def open_renderer(adapter: str = "auto", *, validation: bool = False) -> Renderer:
        variables = sorted(item for item in os.environ.items() if item[0].startswith("V"))
        key = (adapter, validation, *variables)
        if key not in kept or kept[key].closed:
            kept[key] = Kept(adapter, validation=validation)
        return kept[key]

    monkeypatch.setattr(vkbloom, "Renderer", open_renderer)
    monkeypatch.setattr(interruptible, "Renderer", open_renderer)


@pytest.fixture(scope="session")
def software(environment: None) -> AdapterInfo:
    """The software adapter. A test that uses this is skipped if there is none."""
    for adapter in adapters():
        if adapter.type == "cpu":
            return adapter
    pytest.skip("there is no software adapter here, such as Mesa's lavapipe")


@pytest.fixture(scope="session")
def glslang() -> None:
    """A test that uses this is skipped if no compiler of shaders is here."""
    try:
        find_compiler()
    except vkbloom.ShaderError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="session")
def display(environment: None) -> Iterator[dict[str, str]]:
    """The environment of processes that open windows: an X server without a screen."""
    for module in ("glfw", "PIL.ImageGrab"):
        pytest.importorskip(module)
    if shutil.which("Xvfb") is None:
        pytest.skip("Xvfb is not here, whose windows no screen shows (Debian: xvfb)")
    read, write = os.pipe()
    # A server that resets itself when its last client leaves refuses the next one for a moment.
    options = ("-screen", "0", "800x600x24", "-nolisten", "tcp", "-noreset")
    command = ["Xvfb", "-displayfd", str(write), *options]
    with subprocess.Popen(command, pass_fds=[write], stderr=subprocess.DEVNULL) as server:
        os.close(write)
        with os.fdopen(read) as pipe:
            number = pipe.readline().strip()
        # A bundled driver has no windows.
        yield {**os.environ, "DISPLAY": f":{number}", "VKBLOOM_DRIVER": "system"}
        server.terminate()


@pytest.fixture(scope="session")
def scene() -> Scene:
    return Scene.ufo()


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Meshes and frames of the original program, which are stored beside the repository."""
    folder = Path(__file__).resolve().parents[2] / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("the original's meshes and frames (../shared/data) are not here")
    return folder
