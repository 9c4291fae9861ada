"""Files that can be read or written only once: pipes, and standard streams that are closed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

import vkbloom
from tests.cli.calls import run

VKBLOOM = f"'{sys.executable}' -m vkbloom"
MAX_SECONDS = 120  # seconds
SMALL = "--size 16x16 --bloom-size 8x8"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with pictures and named pipes."""
    monkeypatch.chdir(tmp_path)
    image = np.random.default_rng(0).random((12, 24, 3), np.float32)
    vkbloom.write("a.png", image)
    vkbloom.write("m.png", image[:, :, 0])
    vkbloom.write("a.exr", image)
    for name in ("in", "out.png"):
        os.mkfifo(name)
    return tmp_path


def bash(line: str) -> subprocess.CompletedProcess[str]:
    """Run a line of a shell, in which VK is the program."""
    return subprocess.run(
        ["bash", "-c", f'VK() {{ {VKBLOOM} -q "$@"; }}; {line}'],
        capture_output=True,
        text=True,
        check=False,
        timeout=MAX_SECONDS,
    )


@contextmanager
def stream_of(file: str, kind: str) -> Iterator[str]:
    """Yield the name of a pipe with the content of a file."""
    content = Path(file).read_bytes()
    name: str = "in"
    target: str | int = name
    if kind == "substitution":
        reading, target = os.pipe()
        name = f"/dev/fd/{reading}"

    def write() -> None:
        with open(target, "wb") as stream:
            stream.write(content)

    writer = threading.Thread(target=write, daemon=True)
    writer.start()
    yield name
    writer.join(MAX_SECONDS)
    if kind == "substitution":
        os.close(reading)


@pytest.mark.parametrize(
    ("line", "file"),
    [
        ("apply {} out.exr", "a.png"),
        ("apply a.png out.exr --mask {}", "m.png"),
        ("apply a.png out.exr --emission {}", "a.png"),
        ("apply a.png out.exr --method convolution --psf {}", "a.png"),
        ("apply a.png out.exr --glare dirt:image={}", "a.png"),
        (f"render -o out.exr --framebuffers final --skybox {{}} {SMALL}", "a.exr"),
        ("grid {} -o out --axis intensity=0.5 --image-format exr", "a.png"),
        ("compare a.png {} --diff out.exr", "a.exr"),
    ],
)
@pytest.mark.parametrize("kind", ["standard input", "named pipe", "substitution"])
@pytest.mark.usefixtures("kept_renderers")
def test_streams_are_read_like_files(folder: Path, line: str, file: str, kind: str) -> None:
    asked = run(*line.replace("out", "asked").format(file).split())
    if kind == "standard input":
        if "--psf" in line:
            pytest.skip("its word may be a name")
        content = Path(file).read_bytes()
        done = run(*line.format("-").split(), input=content)
    else:
        with stream_of(file, kind) as name:
            done = run(*line.format(name).split())
    assert done.exit_code == asked.exit_code == int(line.startswith("compare")), done.stderr
    for name in ("out.exr", "out/000.exr"):
        expected = folder / name.replace("out", "asked")
        if expected.exists():
            written, same = vkbloom.read(folder / name), vkbloom.read(expected)
            np.testing.assert_array_equal(written, same)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("VK apply - b.png <&-", "standard input: is closed"),
        ("VK apply - b.png < /dev/null", "standard input: is not a readable image"),
        ("VK apply a.png - >&-", "standard output: is closed"),
        ("VK apply a.png - > /dev/full", "No space left on device"),
        ("VK presets > /dev/full", "No space left on device"),
        ("printf x | VK apply - b.png", "standard input: is not a readable image"),
        ("VK render -o b.png --scene <(printf x)", "not a glTF 2.0 document"),
        ("VK apply a.png b.png --method <(printf x)", "unknown method"),
        ("VK check <(printf x)", "there is no such file"),
        ("VK apply a.png none/b.png", "none/b.png: there is no folder none"),
        ("VK render -o none/deep/b.png " + SMALL, "there is no folder none"),
        ("VK compare a.png a.png --diff none/b.png", "none/b.png: there is no folder none"),
        ("VK apply a.png a.exr -o /dev/null", "one pipe cannot hold 2 images"),
        ("VK compare . a.png", ".: Is a directory"),
    ],
)
def test_errors_are_one_line(folder: Path, line: str, message: str) -> None:
    done = bash(line)
    assert done.returncode in (1, 2)
    assert message in done.stderr
    assert done.stderr.startswith("vkbloom: ")
    assert done.stderr.count("\n") == 1
    assert not (folder / "b.png").exists()


@pytest.mark.parametrize("line", ["VK presets | head -1", "VK presets --json | head -1"])
def test_a_reader_that_ends_early_is_no_error(folder: Path, line: str) -> None:
    assert bash(line).stderr == ""


@pytest.mark.parametrize(
    "line",
    [
        "VK apply a.png out.png",
        "VK compare a.png <(cat a.png) --diff out.png",
        f"VK render -o out.png --framebuffers final {SMALL}",
        "VK apply a.png >(cat > got.png); wait",
        "VK apply a.png /dev/stdout | cat > got.png",
        "VK apply - - --pipe-format png < a.png > got.png",
    ],
)
def test_streams_are_written(folder: Path, line: str) -> None:
    def read() -> None:
        with open("out.png", "rb") as stream, open("got.png", "wb") as file:
            shutil.copyfileobj(stream, file)

    reader = threading.Thread(target=read, daemon=True)
    if "out.png" in line:
        reader.start()
    done = bash(line)
    assert done.stderr == ""
    if reader.ident is not None:
        reader.join(MAX_SECONDS)
    assert vkbloom.read("got.png").ndim == 3
    # A pipe is not replaced by a file, and nothing is left beside it.
    assert (folder / "out.png").is_fifo()
    assert {path.name for path in folder.iterdir()} <= {
        *("a.png", "m.png", "a.exr", "in", "out.png", "got.png")
    }
