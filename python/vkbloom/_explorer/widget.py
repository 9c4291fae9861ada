"""The page in a notebook: a widget whose messages a viewer answers."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from importlib import resources
from typing import TYPE_CHECKING, Any, Final

import anywidget
import traitlets

from vkbloom._explorer.controls import as_fields, settings_from
from vkbloom._settings.settings import check_settings

if TYPE_CHECKING:
    from vkbloom._explorer.viewer import Viewer
    from vkbloom._renderer.frames import Frames
    from vkbloom._settings.settings import Settings


_FILES: Final = resources.files("vkbloom._explorer")
# Traits of the sides' settings.
_TRAITS: Final = {"settings": "a", "against": "b"}
# Of the picture that stands in a notebook until the page is there.
_STILL: Final = (640, 640)


def _settings_trait(side: str) -> Any:
    """Return a trait for settings; what a page sends and is no settings leaves them as they are."""

    def read(fields: object, widget: Explorer) -> Settings:
        try:
            return settings_from(fields)
        except (TypeError, ValueError):
            return widget._viewer.settings[side]

    return traitlets.Any().tag(sync=True, to_json=lambda item, _: as_fields(item), from_json=read)


class Explorer(anywidget.AnyWidget):
    """The widget that `vkbloom.explore` returns. Code can read and set its settings.

    Parameters
    ----------
    viewer : Viewer

    Attributes
    ----------
    settings, against : Settings
        The settings of A and B on the page, as traits. Setting them changes the page.
    frames : Frames or None
        The framebuffer of A that was shown last.
    """

    _esm = (_FILES / "page.js").read_text("utf-8")
    _css = (_FILES / "page.css").read_text("utf-8")
    settings: Any = _settings_trait("a")
    against: Any = _settings_trait("b")

    def __init__(self, viewer: Viewer) -> None:
        self._viewer = viewer
        self._still: Any = None
        super().__init__(settings=viewer.settings["a"], against=viewer.settings["b"])
        self.on_msg(self._receive)
        self.observe(self._set, list(_TRAITS))

    def _receive(self, widget: object, message: Any, buffers: list[Any]) -> None:
        self._remove_still()
        # Where binary buffers do not arrive, files are text.
        is_text = isinstance(message, Mapping) and bool(message.get("text"))
        files = [bytes(buffer) for buffer in buffers]
        if is_text:
            files = [base64.b64decode(item) for item in message.get("files", ())]
        header, pictures = self._viewer.answer(message, files)
        if is_text:
            header["pictures"] = [base64.b64encode(picture).decode() for picture in pictures]
            pictures = []
        header["count"] = len(pictures)
        for name, side in _TRAITS.items():
            setattr(self, name, self._viewer.settings[side])
        self.send(header, pictures)

    @traitlets.validate("settings", "against")
    def _check(self, proposal: Any) -> Settings:
        return check_settings(proposal["value"])

    def _set(self, change: Any) -> None:
        side = _TRAITS[change["name"]]
        if self._viewer.settings[side] != change["new"]:
            self._viewer.settings[side] = change["new"]
            self.send({"kind": "settings", "sides": {side: as_fields(change["new"])}}, [])

    @property
    def frames(self) -> Frames | None:
        """The framebuffer of A that was shown last."""
        return self._viewer.frames.get("a")

    def _ipython_display_(self) -> None:
        """Show the page, and below it the first picture until the page asks for one.

        A notebook that is executed without a browser keeps the picture.
        """
        from IPython.display import Image, display  # noqa: PLC0415  of notebooks alone

        bundle = self._repr_mimebundle_()
        data, metadata = bundle if isinstance(bundle, tuple) else (bundle, {})
        display(data, metadata=metadata, raw=True)  # type: ignore[no-untyped-call]
        asked = {"kind": "frame", "sides": {"a": as_fields(self.settings)}, "size": _STILL}
        _, pictures = self._viewer.answer({**asked, "framebuffer": "final"})
        if pictures:
            still = Image(pictures[0])  # type: ignore[no-untyped-call]
            self._still = display(still, display_id=True)  # type: ignore[no-untyped-call]

    def _remove_still(self) -> None:
        if self._still is not None:
            self._still.update({"text/plain": ""}, raw=True)
            self._still = None

    def close(self) -> None:
        """Remove the page from the notebook, and close the renderer unless the caller passed it."""
        super().close()
        self._viewer.close()
