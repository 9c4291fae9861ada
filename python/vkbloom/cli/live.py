"""The state of a window with live controls, and how keys and the mouse change it."""

from __future__ import annotations

import dataclasses
from typing import Any, Final

import vkbloom
from vkbloom.fields import field_range
from vkbloom.settings import Settings, methods

__all__ = ["HELP", "Live"]

HELP: Final = """\
B              bloom on, off
Up, Down       scale of the blur, 0.1 to 2
Left, Right    strength
1 ... 9        the framebuffer that is shown
M              the next method
P              the next preset
Space          pauses the animation
drag, wheel    turn the scene, zoom
S              writes all framebuffers to files
Q, Escape      close\
"""

# A key changes the first of these fields that the settings have.
_SCALES: Final = ("blur_scale", "radius", "filter_radius", "offset", "scatter", "size")
_STRENGTHS: Final = ("blur_strength", "intensity")
_SCALE_RANGE: Final = (0.1, 2.0)
_STEP: Final = 0.1
_TURN_SECONDS: Final = 8.0
_DEGREES: Final = 0.4  # rotation per pixel of mouse movement
_ZOOM: Final = 0.9  # factor of the distance per step of the wheel


@dataclasses.dataclass
class Live:
    """The state of a window.

    Attributes
    ----------
    settings : Settings
    scene : Scene or None
        None: an image.
    framebuffer : str
        Name of the framebuffer that is shown.
    time : float
        Time of the animation, in periods.
    paused, closed : bool
    screenshot : bool
        Whether to write a screenshot after the next frame.
    """

    settings: Settings
    scene: vkbloom.Scene | None
    framebuffer: str = "final"
    time: float = 0.0
    paused: bool = False
    closed: bool = False
    screenshot: bool = False

    def press(self, key: str, names: list[str]) -> None:
        """Do what a key stands for; `names` are the framebuffers that there are."""
        if key in "bmp":
            # The next settings may lack the framebuffer.
            self.framebuffer = "final"
        if key == "b":
            self.settings = self.settings.replace(bloom=not self.settings.bloom)
        elif key in ("up", "down"):
            self._step(_SCALES, _STEP if key == "up" else -_STEP, _SCALE_RANGE)
        elif key in ("right", "left"):
            self._step(_STRENGTHS, _STEP if key == "right" else -_STEP)
        elif key in "123456789" and int(key) <= len(names):
            self.framebuffer = names[int(key) - 1]
        elif key == "m":
            classes = list(methods().values())
            at = classes.index(type(self.settings))
            shown = {name: getattr(self.settings, name) for name in ("tonemap", "encoding")}
            self.settings = classes[(at + 1) % len(classes)](**shown)
        elif key == "p":
            presets = list(vkbloom.presets.values())
            at = presets.index(self.settings) if self.settings in presets else -1
            self.settings = presets[(at + 1) % len(presets)]
        elif key == "space":
            self.paused = not self.paused
        elif key == "s":
            self.screenshot = True
        elif key in ("q", "escape"):
            self.closed = True

    def _step(
        self, fields: tuple[str, ...], step: float, limits: tuple[float, float] | None = None
    ) -> None:
        for name in [name for name in fields if hasattr(self.settings, name)][:1]:
            (field,) = (one for one in dataclasses.fields(self.settings) if one.name == name)
            low, high = field_range(field)
            if limits:
                low, high = max(low, limits[0]), min(high, limits[1])
            value = round(getattr(self.settings, name) + step, 4)
            self.settings = self.settings.replace(**{name: min(max(value, low), high)})

    def drag(self, x: float, y: float) -> None:
        """Turn the scene by pixels of the mouse."""
        if self.scene is not None:
            about_x, about_y, about_z = self.scene.camera.rotation
            self._see(rotation=(about_x - y * _DEGREES, about_y + x * _DEGREES, about_z))

    def scroll(self, steps: float) -> None:
        """Move the camera towards the scene, or away from it."""
        if self.scene is not None:
            x, y, z = self.scene.camera.position
            self._see(position=(x, y, z * _ZOOM**steps))

    def _see(self, **changes: Any) -> None:
        assert self.scene is not None
        camera = dataclasses.replace(self.scene.camera, **changes)
        self.scene = dataclasses.replace(self.scene, camera=camera)

    def advance(self, seconds: float) -> None:
        """Let time pass."""
        if not self.paused:
            self.time = (self.time + seconds / _TURN_SECONDS) % 1.0

    def title(self, seconds: float) -> str:
        """Return the text of the title; `seconds` is the time of a frame."""
        settings = self.settings
        values = [
            f"{name} {getattr(settings, name):g}"
            for names in (_SCALES, _STRENGTHS)
            for name in [one for one in names if hasattr(settings, one)][:1]
        ]
        parts = [
            f"{self.framebuffer}: {settings.method}",
            *(values if settings.bloom else ["no bloom"]),
            *(["paused"] if self.paused else []),
            *([f"{seconds * 1e3:.1f} ms, {1 / seconds:.0f} frames/s"] if seconds else []),
        ]
        return " | ".join(parts)
