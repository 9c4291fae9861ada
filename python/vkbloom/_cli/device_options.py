"""The options that choose an adapter."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

#: ``--adapter``, the argument of `vkbloom.Renderer`.
adapter_option = click.option(
    "--adapter", default="auto", help="auto, software, hardware, or a part of an adapter's name."
)


def device_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--adapter`` and ``--validation``, the arguments of `vkbloom.Renderer`."""
    command = click.option(
        "--validation",
        is_flag=True,
        help="Run with the Khronos validation layer; its first error ends the command.",
    )(command)
    return adapter_option(command)
