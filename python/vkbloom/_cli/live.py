"""The state of a window with live controls, and how keys change it."""

from __future__ import annotations

import dataclasses
from typing import Any, Final

import vkbloom
from vkbloom._settings.settings import Settings, Shading

HELP: Final = """\
B              bloom on, off
1 ... 9        the framebuffer that is shown
P              the next preset
Space          pauses the animation
Q, Escape      close\
"""

_TURN_SECONDS: Final = 8.0


@dataclasses.dataclass
class Live:
    """The state of a window.

    - `shading`: Of a scene.
    - `framebuffer`: Name of the framebuffer that is shown.
    - `time`: Time of the animation, in periods.
    """

    settings: Settings
    source: Any
    shading: Shading = "forward"
    framebuffer: str = "final"
    time: float = 0.0
    paused: bool = False
    closed: bool = False

    def press(self, key: str, names: list[str]) -> None:
        """Do what a key stands for; `names` are the framebuffers that there are."""
        if key in "bp":
            # The next settings may lack the framebuffer.
            self.framebuffer = "final"
        if key == "b":
            self.settings = self.settings.replace(bloom=not self.settings.bloom)
        elif key in "123456789" and int(key) <= len(names):
            self.framebuffer = names[int(key) - 1]
        elif key == "p":
            known = list(vkbloom.presets.values())
            shown = known.index(self.settings) if self.settings in known else -1
            self.settings = known[(shown + 1) % len(known)]
        elif key == "space":
            self.paused = not self.paused
        elif key in ("q", "escape"):
            self.closed = True

    def advance(self, seconds: float) -> None:
        """Let time pass."""
        if not self.paused:
            self.time = (self.time + seconds / _TURN_SECONDS) % 1.0

    def title(self, seconds: float) -> str:
        """Return the text of the title; `seconds` is the time of a frame."""
        parts = [
            f"{self.framebuffer}: {self.settings.method}",
            *([] if self.settings.bloom else ["no bloom"]),
            *(["paused"] if self.paused else []),
            f"{seconds * 1e3:.1f} ms, {1 / seconds:.0f} frames/s",
        ]
        return " | ".join(parts)
