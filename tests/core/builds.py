"""Builds of the core and of other programs for tests. A test is skipped if the build is not
possible."""

from __future__ import annotations

import functools
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

# Prints the folder of volk, or exits with the name of what is missing for a build of the core.
PROBE = """
import shutil, sys
import setuptools
setuptools.setup = lambda **_: None
import setup
setup.check_vulkan_headers()
print(setup.volk_folder())
if not (shutil.which("glslangValidator") or shutil.which("glslang")):
    sys.exit("glslangValidator is missing")
"""


def compiler() -> list[str]:
    """Return the command of the C compiler, or skip the test."""
    command = os.environ.get("CC", "cc").split()
    if os.name == "nt" or shutil.which(command[0]) is None:
        pytest.skip(f"there is no C compiler here: {command[0]}")
    return command


def require_header(name: str) -> None:
    """Skip the test if the compiler does not find the header."""
    done = subprocess.run(
        [*compiler(), "-fsyntax-only", "-x", "c", "-"],
        input=f"#include <{name}>\n",
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        pytest.skip(f"the header {name} is not here")


@functools.cache
def _probe() -> tuple[str, str]:
    done = subprocess.run(
        [sys.executable, "-c", PROBE], cwd=ROOT, capture_output=True, text=True, check=False
    )
    if done.returncode == 0:
        return done.stdout.strip(), ""
    return "", done.stderr.strip().splitlines()[-1]


def volk_folder() -> str:
    """Return the folder of volk, or skip the test if the core cannot be built."""
    require_header("stdio.h")
    folder, missing = _probe()
    if missing:
        pytest.skip(f"the core cannot be built here: {missing}")
    return folder


def succeed(tree: Path, *command: str | Path) -> None:
    """Run a command of a build in its tree."""
    done = subprocess.run(
        command,
        cwd=tree,
        # Not optimized: the compiler takes most of the time.
        env={**os.environ, "CFLAGS": "-O0 -g0", "VKBLOOM_CFLAGS": "-DVKBLOOM_FAULTS -Wall -Werror"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


@contextmanager
def _lock(path: Path) -> Iterator[None]:
    import fcntl

    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def core_with_faults(temporary: Path) -> Path:
    """Build a core that can be made to fail (VKBLOOM_FAULTS), once for each test run.

    A run with sanitizers skips the test: it would compile all of this core, without them.

    Parameters
    ----------
    temporary
        The folder of this process's temporary files; xdist's workers share the one above.

    Returns
    -------
    Path
        The tree with sources, objects and, in ``python``, the package.
    """
    if "VKBLOOM_SANITIZED" in os.environ:
        pytest.skip("it has a core of its own, without sanitizers")
    volk_folder()
    shared = temporary.parent if "PYTEST_XDIST_WORKER" in os.environ else temporary
    tree, whole = shared / "faults", shared / "faults.whole"
    with _lock(shared / "faults.lock"):
        if not whole.exists():
            shutil.rmtree(tree, ignore_errors=True)
            ignored = shutil.ignore_patterns("*.so", "*.pyd", "__pycache__", "*.egg-info")
            for folder in ("csrc", "shaders", "python"):
                shutil.copytree(ROOT / folder, tree / folder, ignore=ignored)
            # With its shaders' modules, which are compiled again if these are not their sources.
            if (ROOT / "build" / "spirv").is_dir():
                shutil.copytree(ROOT / "build" / "spirv", tree / "build" / "spirv")
            for name in ("setup.py", "pyproject.toml", "README.md"):
                shutil.copy2(ROOT / name, tree / name)
            succeed(tree, sys.executable, "setup.py", "--quiet", "build_ext", "--inplace")
            whole.touch()
    return tree


# The folder of the validation layer, which must come first to be above the layers of tests.
_EXPLICIT_LAYERS = tuple(
    str(folder / "vulkan/explicit_layer.d")
    for folder in (Path("/usr/share"), Path("/usr/local/share"), Path("/etc"))
)


def build_layer(source: Path, folder: Path) -> Path:
    """Build a Vulkan layer, VK_LAYER_VKBLOOM_ and the file's name; return its manifest's folder."""
    require_header("vulkan/vk_layer.h")
    library = folder / f"{source.stem}.so"
    options = ("-std=c11", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC", "-fvisibility=hidden")
    subprocess.run([*compiler(), *options, source, "-o", library], check=True)
    about = {
        "name": f"VK_LAYER_VKBLOOM_{source.stem}",
        "type": "GLOBAL",
        "library_path": str(library),
        "api_version": "1.3.0",
        "implementation_version": "1",
        "description": "A device of the tests",
    }
    manifest = {"file_format_version": "1.2.0", "layer": about}
    (folder / f"{source.stem}.json").write_text(json.dumps(manifest))
    return folder


def layer_variables(folder: Path, name: str) -> dict[str, str]:
    """Return the environment that puts the layer below the validation layer."""
    folders = (os.environ.get("VK_LAYER_PATH"), *_EXPLICIT_LAYERS, str(folder))
    return {
        "VK_LAYER_PATH": os.pathsep.join(filter(None, folders)),
        "VK_INSTANCE_LAYERS": os.pathsep.join(("VK_LAYER_KHRONOS_validation", name)),
    }
