"""Calls of the command line in this process."""

from __future__ import annotations

from typing import Any

from click import Context
from click.testing import CliRunner, Result

import vkbloom
from vkbloom._cli.program import program

__all__ = [
    "COMMANDS",
    "NATURAL",
    "apply",
    "apply_settings",
    "one_line",
    "program",
    "run",
    "succeed",
]

COMMANDS = program.list_commands(Context(program))
NATURAL = vkbloom.presets["bevy_natural"]


def run(*words: object, **options: Any) -> Result:
    return CliRunner().invoke(program, [str(word) for word in words], **options)


def succeed(*words: object) -> Result:
    """Run a command that must succeed without output on standard error."""
    result = run(*words)
    assert (result.exit_code, result.stderr) == (0, "")
    return result


def apply(*words: object) -> Result:
    """Apply NATURAL unless another is named, where files of integers start from the preset photo.

    See test_cli_photo.py.
    """
    is_named = {"--preset", "--method", "--help"} & {*map(str, words)}
    return run("apply", *words, *(() if is_named else ("--preset", "bevy_natural")))


def apply_settings(image: Any, settings: vkbloom.Settings = NATURAL, **given: Any) -> Any:
    """Return the picture that a renderer makes of an image."""
    with vkbloom.Renderer() as renderer:
        return renderer.apply(image, settings, framebuffers="final", **given)["final"]


def one_line(stderr: str) -> str:
    """Check that an error is one line, and return it without the program's name."""
    assert stderr.startswith("vkbloom: ")
    assert stderr.count("\n") == 1
    assert "Traceback" not in stderr
    return stderr.removeprefix("vkbloom: ")
