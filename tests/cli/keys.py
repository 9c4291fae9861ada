"""``python -m tests.cli.keys KEY,... ARGUMENT...``: vkbloom view, to which keys are pressed."""

from __future__ import annotations

import functools
import sys
from typing import Any

import glfw as glfw_module

import vkbloom
from vkbloom._cli.program import program

callbacks: list[Any] = []
glfw: Any = glfw_module
keys = iter(sys.argv[1].split(","))
set_key_callback, poll_events = glfw.set_key_callback, glfw.poll_events


def remember(window: Any, callback: Any) -> None:
    callbacks.append(callback)
    set_key_callback(window, callback)


def press() -> None:
    poll_events()
    key = getattr(glfw, f"KEY_{next(keys)}")
    callbacks[0](None, key, 0, glfw.PRESS, 0)
    callbacks[0](None, key, 0, glfw.RELEASE, 0)


glfw.set_key_callback, glfw.poll_events = remember, press
vkbloom.Renderer = functools.partial(vkbloom.Renderer, validation=True)  # type: ignore
program(["view", *sys.argv[2:]])
