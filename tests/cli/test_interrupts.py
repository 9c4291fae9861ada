"""Ctrl-C ends the program with the status 130 and one line, at any moment of its start."""

from __future__ import annotations

import os
import random
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import vkbloom
from tests.core.builds import compiler
from tests.exhaustive import EXHAUSTIVE
from tests.processes import output, python
from vkbloom._grid import grid

# Sends SIGINT to itself at an import, counted from the moment at which the program answers it.
AT_AN_IMPORT = """
import os, runpy, signal, sys

left, way = int(sys.argv.pop(1)), sys.argv.pop(1)

def at_import(event, _):
    global left
    answer = getattr(signal.getsignal(signal.SIGINT), "__name__", "")
    if event == "import" and (left < FIRST or answer == "leave"):
        left -= 1
        if left == 0:
            os.kill(os.getpid(), signal.SIGINT)

FIRST = left
sys.addaudithook(at_import)
if way == "script":
    from vkbloom._cli import main
    main()
else:
    runpy.run_module("vkbloom", run_name="__main__")
"""
IMPORTS = sorted({1, 2, 3, *random.Random(5).sample(range(4, 200), 9)})


@pytest.mark.parametrize("way", ["script", "module"])
@pytest.mark.parametrize("number", IMPORTS)
def test_at_an_import(number: int, way: str) -> None:
    ended = python("-c", AT_AN_IMPORT, str(number), way, "glares", "--json")
    assert (ended.returncode, ended.stderr) == (130, "vkbloom: interrupted\n")


@pytest.mark.parametrize("words", [("adapters",), ("apply", "a.exr", "b.exr")])
def test_at_any_time(tmp_path: Path, words: tuple[str, ...]) -> None:
    vkbloom.write(tmp_path / "a.exr", np.ones((16, 16, 3), np.float32))
    code = "from vkbloom._cli import main; print(flush=True); main()"
    chosen = random.Random(7)
    for _ in range(20 if EXHAUSTIVE else 8):
        with subprocess.Popen(
            [sys.executable, "-c", code, *words],
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        ) as process:
            assert process.stdout is not None
            process.stdout.readline()
            # Before it, Python itself would answer.
            time.sleep(chosen.uniform(0.05, 1.0))
            process.send_signal(signal.SIGINT)
            _, stderr = process.communicate()
        left = stderr.splitlines()
        # What was done before the signal came is a success.
        assert (process.returncode, left) in [(130, ["vkbloom: interrupted"]), (0, [])], stderr
        assert {file.name for file in tmp_path.iterdir()} <= {"a.exr", "b.exr"}


def test_what_ignores_interrupts_goes_on_to_do_so() -> None:
    code = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN);" + AT_AN_IMPORT.replace(
        'answer == "leave"', "True"
    )
    ended = python("-c", code, "20", "script", "glares", "--json")
    assert (ended.returncode, ended.stderr) == (0, "")


def test_imports_of_compiled_packages_are_not_interrupted(tmp_path: Path) -> None:
    """An exception inside of nanobind's modules aborts the process."""
    (tmp_path / "compiled.py").write_text(
        "import os, signal\nos.kill(os.getpid(), signal.SIGINT)\nwhole = 1\n"
    )
    code = (
        "import sys; from vkbloom._extras import import_extra\n"
        "try: import_extra('compiled', 'images', '')\n"
        "except KeyboardInterrupt: print(sys.modules['compiled'].whole)"
    )
    ended = python("-c", code, cwd=tmp_path)
    assert (ended.returncode, ended.stdout) == (0, "1\n"), ended.stderr


# Under a limit of address space; tests/core/test_low_memory.py has its errors.


def test_doctor_does_not_blame_the_driver() -> None:
    size = 600 << 20
    ended = subprocess.run(
        [sys.executable, "-m", "vkbloom._cli", "doctor"],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (size, size)),
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 1
    assert "memory is short: a limit leaves" in ended.stdout
    assert "Update its driver" not in ended.stdout
    assert "mesa-vulkan-drivers" not in ended.stdout.partition("adapters ")[2].partition("\n")[0]


def test_grids_leave_a_reserve(monkeypatch: pytest.MonkeyPatch, renderer: vkbloom.Renderer) -> None:
    image = np.zeros((16, 16, 4), np.float32)
    size = 2 * image.nbytes
    monkeypatch.setattr(grid, "free_memory", lambda: size + size // 20)
    with pytest.raises(MemoryError, match="a tenth as reserve"):
        vkbloom.grid(image, axes={"exposure": [0, 1]}, renderer=renderer)


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 0)])
def test_explore_ends_with_the_status_of_shells(number: int, status: int) -> None:
    pytest.importorskip("tornado")
    words = ["-u", "-m", "vkbloom._cli", "explore", "--no-open", "--adapter", "software"]
    running = subprocess.Popen([sys.executable, *words], stdout=subprocess.PIPE, text=True)
    assert running.stdout is not None
    for line in running.stdout:
        if "Ctrl-C" in line:
            running.send_signal(number)
            break
    assert running.wait(60) == status
    running.stdout.close()


# ``vkbloom warm``: later processes find the pipelines in the caches.


APPLY = """
import numpy as np, vkbloom
with vkbloom.Renderer("software") as renderer:
    renderer.apply(np.ones((24, 32, 3), np.float32), vkbloom.presets["kino"])
"""


# Mesa writes its files in threads, which end with the process: here each file takes long.
SLOW_FILES = """
#define _GNU_SOURCE
#include <dlfcn.h>
#include <string.h>
#include <unistd.h>

int rename(const char *from, const char *to)
{
    int (*next)(const char *, const char *) = dlsym(RTLD_NEXT, "rename");
    if (strstr(to, "/mesa_shader_cache/"))
        usleep(300000);
    return next(from, to);
}
"""


def slow_files(folder: Path) -> Path:
    """Return a library for LD_PRELOAD."""
    source, library = folder / "slow.c", folder / "slow.so"
    source.write_text(SLOW_FILES)
    command = [*compiler(), "-shared", "-fPIC", "-o", str(library), str(source), "-ldl"]
    subprocess.run(command, check=True)
    return library


def warm_files(folder: Path) -> set[Path]:
    return {path for path in folder.rglob("*") if path.is_file() and path.suffix != ".tmp"}


@pytest.mark.skipif(os.environ.get("MESA_SHADER_CACHE_DISABLE", "") == "true", reason="cache off")
def test_a_later_process_compiles_nothing(tmp_path: Path) -> None:
    with vkbloom.Renderer("software") as renderer:
        if "Mesa" not in renderer.info.driver_info:
            pytest.skip("no Mesa")
    ours, drivers = tmp_path / "ours", tmp_path / "drivers"
    drivers.mkdir()
    cached = {"VKBLOOM_CACHE_DIR": str(ours), "MESA_SHADER_CACHE_DIR": str(drivers)}
    words = ["-m", "vkbloom", "warm", "--preset", "kino", "--size", "32x24"]
    words += ["--adapter", "software"]
    slow = {"LD_PRELOAD": str(slow_files(tmp_path))} if sys.platform == "linux" else {}
    assert "12 kinds of calls on" in output(*words, **cached, **slow)
    filled = {path: path.stat().st_size for path in warm_files(drivers)}
    assert filled
    assert warm_files(ours)
    output("-c", APPLY, **cached)
    assert {path: path.stat().st_size for path in warm_files(drivers)} == filled
