"""The page in a notebook: a widget whose messages a viewer answers."""

from __future__ import annotations

from importlib import resources
from typing import TYPE_CHECKING, Any, Final

import anywidget

from vkbloom._explorer.controls import as_fields
from vkbloom._settings.settings import check_settings

if TYPE_CHECKING:
    from vkbloom._explorer.viewer import Viewer
    from vkbloom._renderer.frames import Frames
    from vkbloom._settings.settings import Settings

__all__ = ["Explorer"]

_FILES: Final = resources.files("vkbloom._explorer")


class Explorer(anywidget.AnyWidget):
    """The widget that `vkbloom.explore` returns. Code can read and set its settings.

    Parameters
    ----------
    viewer : Viewer

    Attributes
    ----------
    settings, against : Settings
        The settings of A and B on the page. Setting them changes the page.
    frames : Frames or None
        The framebuffer of A that was shown last.
    """

    _esm = (_FILES / "page.js").read_text("utf-8")
    _css = (_FILES / "page.css").read_text("utf-8")

    def __init__(self, viewer: Viewer) -> None:
        super().__init__()
        self._viewer = viewer
        self.on_msg(self._received)

    def _received(self, widget: object, message: object, buffers: list[Any]) -> None:
        header, pictures = self._viewer.answer(message, [bytes(buffer) for buffer in buffers])
        self.send(header, pictures)

    @property
    def settings(self) -> Settings:
        """The settings of A."""
        return self._viewer.settings["a"]

    @settings.setter
    def settings(self, settings: Settings) -> None:
        self._set("a", settings)

    @property
    def against(self) -> Settings:
        """The settings of B."""
        return self._viewer.settings["b"]

    @against.setter
    def against(self, settings: Settings) -> None:
        self._set("b", settings)

    def _set(self, side: str, settings: Settings) -> None:
        self._viewer.settings[side] = check_settings(settings)
        self.send({"kind": "settings", "sides": {side: as_fields(settings)}}, [])

    @property
    def frames(self) -> Frames | None:
        """The framebuffer of A that was shown last."""
        return self._viewer.frames.get("a")

    def close(self) -> None:
        """Remove the page from the notebook, and close the renderer unless the caller passed it."""
        super().close()
        self._viewer.close()
