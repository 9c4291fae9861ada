"""Calls of the command line in this process."""

from __future__ import annotations

from click.testing import CliRunner, Result

from vkbloom._cli.program import program


def run(*words: object) -> Result:
    return CliRunner().invoke(program, [str(word) for word in words])


def one_line(stderr: str) -> str:
    """Check that an error is one line, and return it without the program's name."""
    assert stderr.startswith("vkbloom: ")
    assert stderr.count("\n") == 1
    assert "Traceback" not in stderr
    return stderr.removeprefix("vkbloom: ")
