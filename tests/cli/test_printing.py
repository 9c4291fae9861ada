"""What commands print with --quiet, and completion in real shells."""

from __future__ import annotations

import os
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import vkbloom
from tests.cli.calls import run

pytestmark = pytest.mark.usefixtures("kept_renderers")


@pytest.fixture
def dark(tmp_path: Path) -> Path:
    """A picture about which there is a note: nothing in it glows."""
    return vkbloom.write(tmp_path / "dark.exr", np.full((12, 16, 3), 0.1, np.float32))


@pytest.mark.parametrize(("place", "option"), [(0, "--quiet"), (1, "-q")])
def test_quiet(tmp_path: Path, dark: Path, place: int, option: str) -> None:
    words: list[object] = ["apply", dark, tmp_path / "o.png", "--preset", "kino"]
    usual = run(*words)
    assert "the bloom is zero everywhere" in usual.stderr
    assert usual.stdout.splitlines()[-1] == f"wrote {tmp_path / 'o.png'}"
    (tmp_path / "o.png").unlink()
    result = run(*words[:place], option, *words[place:])
    assert (result.exit_code, result.output) == (0, "")
    assert (tmp_path / "o.png").exists()
    # It ends with the call.
    assert run(*words).output == usual.output
    # Errors and results stay.
    assert run("apply", "none.png", tmp_path / "o.png", option).stderr.endswith("directory\n")
    assert vkbloom.adapters()[0].name in run("adapters", option).stdout


@pytest.mark.parametrize(
    "words",
    [
        ("render", "-o", "{tmp}/o.png", "--size", "16x12"),
        ("grid", "{dark}", "-o", "{tmp}/grid", "--axis", "exposure=0,1", "--preset", "kino"),
        ("compare", "{dark}", "{dark}", "--diff", "{tmp}/d.png"),
    ],
    ids=lambda words: words[0],
)
def test_other_commands_are_quiet(tmp_path: Path, dark: Path, words: tuple[str, ...]) -> None:
    result = run(*(word.format(tmp=tmp_path, dark=dark) for word in words), "--quiet")
    assert (result.exit_code, result.stderr) == (0, "")
    assert "wrote" not in result.stdout
    assert len(list(tmp_path.iterdir())) > 1


# Completion

# The scripts that the documented lines load, called as the shell calls them at the Tab key.
_LOAD = 'eval "$(_VKBLOOM_COMPLETE={shell}_source vkbloom)"\n'
_BASH = """
COMP_WORDS=({words}) COMP_CWORD={last} COMPREPLY=()
_vkbloom_completion vkbloom
printf '%s\\n' "${{COMPREPLY[@]}}"
"""
# zsh's own functions print here what they would offer.
_ZSH_FUNCTIONS = """
compdef() { :; }
compadd() { print -l -- "${(@P)@[-1]}" }
_describe() { print -l -- "${(@P)3%%:*}" }
"""
_ZSH = """
words=({words}) CURRENT={last}
_vkbloom_completion
"""


@pytest.mark.parametrize("shell", ["bash", "zsh"])
def test_completion(tmp_path: Path, shell: str) -> None:
    found = shutil.which(shell)
    if found is None:
        pytest.skip(f"{shell} is not installed")
    program_file = tmp_path / "vkbloom"
    program_file.write_text(f"#!{sys.executable}\nfrom vkbloom._cli import main\n\nmain()\n")
    program_file.chmod(program_file.stat().st_mode | stat.S_IXUSR)
    environment = {**os.environ, "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"}
    script = (_ZSH_FUNCTIONS if shell == "zsh" else "") + _LOAD.format(shell=shell)
    for words in (
        ["vkbloom", "gl"],
        ["vkbloom", "apply", "--thresh"],
        ["vkbloom", "apply", "--preset", "unity"],
    ):
        quoted = " ".join(f"'{word}'" for word in words)
        # bash counts words from 0, zsh from 1.
        script += (
            _BASH.format(words=quoted, last=len(words) - 1)
            if shell == "bash"
            else _ZSH.format(words=quoted, last=len(words))
        )
        script += "echo ---\n"
    done = subprocess.run(
        [found, "-f" if shell == "zsh" else "--norc", "-c", script],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert [set(part.split()) for part in done.stdout.split("---\n")] == [
        {"glares"},
        {"--threshold", "--threshold-scale"},
        {"unity_urp", "unity_urp_kawase", "unity_urp_dual", "unity_hdrp", "unity_ppv2"},
        set(),
    ], done.stderr
