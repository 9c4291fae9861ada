"""The command lines of the pages, as printed: bash splits them, in a folder that has their files.

What bash hands to `vkbloom` then runs in this process, where commands share their renderers.
"""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path
from typing import Any, Final

import click
import pytest
from benchmarks.__main__ import command as benchmarks
from click.testing import CliRunner
from packaging.requirements import Requirement

from tests.cli.calls import program
from tests.docs.pages import ROOT, TEXTS, blocks

#: Why a command is not run here, by how it begins; its arguments are parsed.
NOT_RUN: Final = {
    "make demo": ".ci/run does, on a fresh system",
    "make test": "it runs this test",
    "make bench": "installs the peers; tests/bench/test_bench.py runs the benchmarks",
    "make release-check": "takes an hour, as root; test_release.py runs a workflow",
    "pytest": "tests/plugin/test_guide.py does, on the files of that page",
    "python -m benchmarks -o": "takes minutes; tests/bench/test_bench.py runs the benchmarks",
    "python -m benchmarks --only": "the same",
    "python -m benchmarks --adapter": "the same",
    "python -m benchmarks --beside": "the same",
    "python -m benchmarks --quick": "the same",
    "python -m benchmarks --keep": "writes a page; tests/bench/test_page.py does",
    "python -m benchmarks --page": "the same",
    "vkbloom fit photo.jpg photo.jpg --preset all": "takes seconds; tests/fits/test_fit.py does",
    "vkbloom doctor": "takes seconds; tests/cli/test_doctor.py does",
    "vkbloom check --preset unity_urp --against": "needs an engine; test_check.py does",
    "vkbloom view": "does not end, and needs a screen; tests/cli/test_view.py does",
    "vkbloom grid photo.exr --store s3:": "needs a bucket; tests/grid/test_grid_stores.py has one",
    "vkbloom grid --axis time=0:1:24": "needs the scheduler of a cluster",
}
# Options for the same in less time, by command.
FASTER: Final = {
    "check": ["--measure-size", "64x64", "--size", "64x48"],
    "flare": ["--size", "72x48"],
    "fit": ["--max-calls", "3"],
}
PROGRAMS = ("vkbloom", "pip", "python", "pytest", "make", "apt", "source", "python3")
# Each program prints its arguments. Others are not found.
PRELUDE = "\n".join(f"{name}() {{ printf '%s\\0' {name} \"$@\"; }}" for name in PROGRAMS)


def lines() -> Iterator[Any]:
    """Yield the command lines of all pages, each once."""
    found = set()
    for page in TEXTS:
        for block in (*blocks(page, "sh"), *blocks(page, "console"), *blocks(page, "bash")):
            for line in block.replace("\\\n", " ").splitlines():
                if line.strip() and line not in found:
                    found.add(line)
                    name = str(page.relative_to(ROOT))
                    yield pytest.param(line, id=f"{name}: {line.split('#')[0].strip()}")


def words_of(line: str, folder: Path) -> list[str]:
    """Return a program and its arguments, as bash hands them over."""
    command = ["bash", "--norc", "-c", f"{PRELUDE}\n{line}"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, ""), done.stdout + done.stderr
    return done.stdout.split("\0")[:-1]


def parse(words: list[str]) -> None:
    """Parse the arguments of a command that is not run."""
    if words[0] == "make":
        target = rf"^([\w-]+ )*{words[1]}( [\w-]+)*:"
        assert re.search(target, (ROOT / "Makefile").read_text(), re.MULTILINE), words
        return
    given: tuple[click.Command | None, list[str]] = (benchmarks, words[3:])
    if words[0] == "vkbloom":
        given = program.get_command(None, words[1]), words[2:]  # type: ignore[arg-type]
    elif words[0] != "python":
        return
    command, arguments = given
    assert command is not None, words
    command.make_context(words[0], arguments, resilient_parsing=True)


def assert_builds(packages: list[str]) -> None:
    """Check that a line of apt installs what the build needs, and nothing else."""
    needed: set[str] = set()
    build = (ROOT / "tools" / "setup_system.sh").read_text().split("build)")[1].split(";;")[0]
    for row in re.findall(r'^ +need "[^"]*" ("[^"]*"|\S+)', build, re.MULTILINE):
        needed.update(row.strip('"').split())
    # Python comes with its headers, and the loader with its own.
    assert packages == ["make"] or {*packages} == needed - {"python3", "libvulkan1"}


@pytest.mark.parametrize("line", list(lines()))
def test_a_command_of_a_page(line: str, folder: Path, kept_renderers: None) -> None:
    words = words_of(line, folder)
    if any(" ".join(words).startswith(begin) for begin in NOT_RUN):
        parse(words)
    elif words[0] == "pip":
        # "." is the clone.
        (wanted,) = (
            Requirement(re.sub(r"^\.", "vkbloom", word)) for word in words[2:] if "[" in word
        )
        assert wanted.extras <= {*metadata.metadata("vkbloom").get_all("Provides-Extra", [])}
    elif words[0] == "apt":
        assert_builds(words[2:])
    elif words[0] in ("source", "python3"):  # `make demo` makes it, too
        assert words[1:] in ([".venv/bin/activate"], ["-m", "venv", ".venv"])
    else:
        of = {"vkbloom": (program, words[1:]), "python": (benchmarks, words[3:])}
        command, arguments = of[words[0]]
        more = FASTER.get(words[1], []) if words[0] == "vkbloom" else []
        result = CliRunner().invoke(command, [*arguments, *more])
        assert result.exit_code == 0, result.output
