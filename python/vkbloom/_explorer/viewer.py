"""One viewer of a source: answers the messages of a page with pictures and values.

It is the same for notebooks and for the page of ``vkbloom explore``, and does not depend on how
messages are transported. Messages are values that JSON can represent:

======== ============================================= =========================================
kind     asked                                         answered
======== ============================================= =========================================
setup                                                  controls, both sides' settings, source
frame    sides: settings of "a", "b" or both;          of each side: a picture (a buffer), the
         framebuffer, size, time, stops; at; of a      framebuffer's facts, the plan's passes and
         scene shading, glow; of a photograph          the times of those that ran, settings as
         expand: what "a", "b" are expanded up         code, the expansion, the values under the
         to, or "auto"                                 pointer; or an error
probe    at: the pointer's place, 0..1 across, down    of each side: pixel and values
open     name; the content of a file as a buffer       source, and the settings to begin with
save     settings; expand of them; else as of frame    a picture of the source's own size, which
                                                       holds its settings as files of vkbloom do
methods                                                the custom methods whose files changed, as in
                                                       setup, and the errors of their files
======== ============================================= =========================================

``view`` and ``id`` are returned as they were sent. A page asks for its next frame when it has
received the one before. Of the changes in between, only the newest one is rendered.
"""

from __future__ import annotations

import dataclasses
import math
import os
import tempfile
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom import _core
from vkbloom._custom.method import CustomType, read_again, register
from vkbloom._explorer.controls import (
    as_fields,
    code_with_image,
    controls,
    describe,
    settings_from,
)
from vkbloom._explorer.fast_pictures import picture_levels, picture_of
from vkbloom._image_arguments import check_image
from vkbloom._io.expansion import check_expansion
from vkbloom._io.image_file import read_picture
from vkbloom._io.image_writing import levels_of
from vkbloom._io.picture import Highlights, Picture
from vkbloom._numbers import check_number, check_size
from vkbloom._presets.start import Start, start_of
from vkbloom._renderer.added_light import added_share, faint_note
from vkbloom._renderer.frame_files import settings_facts
from vkbloom._renderer.renderer import Renderer
from vkbloom._scene import Scene
from vkbloom._settings.fields import fields_of
from vkbloom._settings.registry import METHODS
from vkbloom._settings.settings import SHADINGS, check_settings, check_shading
from vkbloom._views.pictures import png, reduce

if TYPE_CHECKING:
    from vkbloom._renderer.frames import Frames
    from vkbloom._renderer.plans import Plan
    from vkbloom._scene import Scene
    from vkbloom._settings.settings import Settings, Shading


SIDES: Final = ("a", "b")
#: The glow's intensity in the default scene: bright enough to show the differences between the
#: presets' blooms.
GLOW: Final = 6.0

_MAX_SIDE: Final = 8192
# Views do not say when they are closed. The framebuffers of the oldest ones are dropped.
_VIEWS_KEPT: Final = 8
_FAILURES: Final = (_core.Error, OSError, TypeError, ValueError, MemoryError, RecursionError)
# An expansion that follows from the settings.
_AUTOMATIC: Final = "auto"
# Images that are kept: those of both sides, whole and reduced.
_IMAGES_KEPT: Final = 4
_MAX_GLOW: Final = 1e4
# A deferred scene has light above white, which needs a tone map.
_DEVELOPED: Final = {"tonemap": "aces", "encoding": "srgb"}

Answer = tuple[dict[str, Any], list[bytes]]


class Viewer:
    """A source and the settings of both sides.

    Arguments are those of `vkbloom.explore`; of an image file the source is its decoded picture,
    and there are the file and what its highlights are expanded up to (None: as the settings say).

    - `name`: That of the image file.
    - `settings`, `expand`, `frames`: The latest ones of the sides "a" and "b".
    """

    def __init__(
        self,
        source: Scene | NDArray[Any] | Picture | None = None,
        settings: Settings | str | None = None,
        *,
        against: Settings | str | None = None,
        size: tuple[int, int] = (1280, 720),
        shading: Shading = "deferred",
        renderer: Renderer | None = None,
        file: str = "",
        expand: float | None = None,
    ) -> None:
        if source is None:
            source = dataclasses.replace(Scene.ufo(), glow_intensity=GLOW)
        self._shading: Shading = check_shading(shading)
        self._file, self.name = file, PurePath(file).name
        self._picture = source if isinstance(source, Picture) else None
        self._scene = source if isinstance(source, Scene) else None
        self.settings: dict[str, Settings] = {}
        self.expand: dict[str, float | None] = {}
        self._files = CustomFiles()
        self._images: dict[object, NDArray[Any]] = {}
        self._begin(settings, expand)
        if against is not None:
            self.settings["b"] = check_settings(against)
        if isinstance(source, Scene):
            self._source_size = check_size("size", size)
        elif isinstance(source, Picture):
            self._show_image(self._start_of("a").develop(source).pixels)
        else:
            self._show_image(source)
        if renderer is not None and renderer.closed:
            raise ValueError("renderer: it is closed")
        self.renderer = Renderer() if renderer is None else renderer
        self._owned = renderer is None
        self.frames: dict[str, Frames] = {}
        self._shown: dict[object, dict[str, NDArray[Any]]] = {}

    def close(self) -> None:
        """Close the renderer, unless the caller passed it. May be called twice."""
        if self._owned:
            self.renderer.close()

    @property
    def _highlights(self) -> Highlights | None:
        """What the source has of light above white; None: it is a scene."""
        if self._scene is not None:
            return None
        return Highlights.STORED if self._picture is None else self._picture.highlights

    def _start_of(self, side: str) -> Start:
        return Start(self.settings[side], self.expand[side])

    def _begin(self, settings: Settings | str | None, expand: float | None = None) -> None:
        """Set A to the settings or to the source's default, and B to the same without bloom."""
        is_default = settings is None
        begun, expand = start_of(self._highlights, settings, expand=expand)
        if is_default and self._scene is not None and self._shading == "deferred":
            begun = begun.replace(**_DEVELOPED)
        self._default = begun if is_default else None
        self.settings = {"a": begun, "b": begun.replace(bloom=False)}
        self.expand = dict.fromkeys(SIDES, expand)

    def _show_image(self, source: NDArray[Any]) -> None:
        # A copy, since the caller may change the array while the page is open.
        image = np.array(check_image(source), order="C")
        self._scene = None
        self._source_size = (image.shape[1], image.shape[0])
        self._images = {self._key_of(self.settings["a"], self.expand["a"]): image}

    def answer(self, message: object, files: Sequence[bytes] = ()) -> Answer:
        """Return the answer to a message.

        It has pictures, too; it is ``{"kind": "error", "error": ...}`` if the message is invalid.

        - `message`: A mapping; see the table above.
        - `files`: Contents of the files that belong to the message.
        """
        kinds = {
            "setup": self._setup,
            "frame": self._frame,
            "probe": self._probe,
            "open": lambda message: self._open(message, files),
            "save": self._save,
            "methods": self._methods,
        }
        kind = message.get("kind") if isinstance(message, Mapping) else None
        if not isinstance(message, Mapping) or not isinstance(kind, str) or kind not in kinds:
            return {"kind": "error", "error": f"message: {message!r:.80} is not understood"}, []
        asked = {name: message.get(name) for name in ("view", "id")}
        for name, value in asked.items():
            if not isinstance(value, str | int | None):
                return {"kind": "error", "error": f"{name}: it is not text or an integer"}, []
        try:
            body, buffers = kinds[kind](message)
        except _FAILURES as error:
            kind, body, buffers = "error", {"error": _describe(error)}, []
        return {"kind": kind, **asked, **body}, buffers

    def _setup(self, message: Mapping[str, Any]) -> Answer:
        self._files = CustomFiles()
        return {
            **controls(),
            **self.describe_source(),
            "adapter": self.renderer.info.summary,
            "has_files": bool(self._files),
        }, []

    def _methods(self, message: Mapping[str, Any]) -> Answer:
        new, errors = self._files.changes()
        return {
            "methods": {name: describe(kind) for name, kind in new.items()},
            "errors": errors,
        }, []

    def describe_source(self) -> dict[str, Any]:
        """Return a description of the source, and the initial settings."""
        scene = self._scene
        expand = self.expand["a"]
        can_expand = self._highlights is Highlights.CLIPPED
        return {
            "sides": {side: as_fields(current(item)) for side, item in self.settings.items()},
            "expand": self.expand if can_expand else None,
            "name": self.name,
            "note": f"highlights expanded up to {expand:g}" if can_expand and expand else "",
            "animated": scene is not None,
            "source_size": self._source_size,
            "shadings": [] if scene is None else list(SHADINGS),
            "shading": self._shading,
            "glow": None if scene is None or scene.glow is None else scene.glow_intensity,
        }

    def _open(self, message: Mapping[str, Any], files: Sequence[bytes]) -> Answer:
        """Replace the source by an image file."""
        name = PurePath(str(message.get("name", ""))).name
        picture = _read(name, files)
        check_image(picture.pixels)
        was_scene, self._scene = self._scene is not None, None
        self._picture, self._file, self.name = picture, name, name
        self._shown.clear()
        # With a scene's settings a photograph would be white.
        if was_scene or self.settings["a"] == self._default:
            self._begin(None)
        else:
            expand = start_of(picture.highlights, self.settings["a"]).expand
            self.expand = dict.fromkeys(SIDES, expand)
        self._show_image(self._start_of("a").develop(picture).pixels)
        return self.describe_source(), []

    def _save(self, message: Mapping[str, Any]) -> Answer:
        settings = settings_from(message.get("settings"))
        expand = _expansion(message.get("expand", self.expand["a"]))
        frames, *_ = self._render(settings, expand, self._source_size, message)
        (shown,) = frames
        stops = self._read_view(message)[-1]
        if self._scene is None and shown == "final" and stops == 0:
            # With the levels of the file that vkbloom apply writes.
            pixels = levels_of(frames[shown], settings.encoding)[:, :, :3]
        else:
            pixels = picture_levels(frames[shown], shown, encoding=settings.encoding, stops=stops)
        is_expanded = self._highlights is Highlights.CLIPPED
        facts = settings_facts(settings, (expand or 1.0) if is_expanded else None)
        return {"framebuffer": shown}, [png(np.ascontiguousarray(pixels), texts=facts)]

    def _frame(self, message: Mapping[str, Any]) -> Answer:
        asked = message.get("sides")
        if not isinstance(asked, Mapping) or not set(asked) <= set(SIDES):
            raise ValueError(f"sides: {asked!r:.80} are not settings of a or b")
        size = message.get("size")
        size = self._source_size if size is None else check_size("size", size)
        size = (min(size[0], _MAX_SIDE), min(size[1], _MAX_SIDE))
        self._read_view(message)
        at = None if message.get("at") is None else _position(message["at"])
        arrays = self._arrays_of(message.get("view"))
        sides: dict[str, Any] = {}
        buffers: list[bytes] = []
        for side in SIDES:
            if side not in asked:
                continue
            try:
                settings = settings_from(asked[side])
                expand = self._expansion_of(side, settings, message)
                frames, picture, names, plan = self._render(settings, expand, size, message)
            except _FAILURES as error:
                # The other side is still shown.
                sides[side] = {"error": _describe(error)}
                continue
            self.settings[side], self.frames[side] = settings, frames
            self.expand[side] = expand
            (shown,) = frames
            arrays[side] = frames[shown]
            sides[side] = {
                **self.describe(frames, shown, expand, size),
                "names": names,
                "plan": rows_of(plan),
                "passes": _finite(frames.timings),
                "picture": len(buffers),
            }
            if at is not None:
                sides[side]["probe"] = _probe(frames[shown], at)
            buffers.append(picture)
        return {"sides": sides}, buffers

    def describe(
        self, frames: Frames, shown: str, expand: float | None, size: tuple[int, int]
    ) -> dict[str, Any]:
        """Return what a page says of a framebuffer, besides its plan and times."""
        settings = frames.settings
        return {
            "framebuffer": shown,
            "size": [frames[shown].shape[1], frames[shown].shape[0]],
            "dtype": str(frames[shown].dtype),
            "note": _note_of(settings, shown),
            "expand": expand,
            "faint": self._faint_note(frames, expand, size) if shown == "final" else "",
            "code": code_with_image(settings, self._file, expand),
        }

    def source_at(
        self, size: tuple[int, int], settings: Settings, expand: float | None
    ) -> tuple[Any, dict[str, Any]]:
        """Return the scene, or the image at a size, and the arguments of a scene's frame."""
        if self._scene is None:
            return self._image_of(size, settings, expand), {}
        return self._scene, {"size": size, "shading": self._shading}

    def _probe(self, message: Mapping[str, Any]) -> Answer:
        at = _position(message.get("at"))
        arrays = self._arrays_of(message.get("view"))
        return {"sides": {side: {"probe": _probe(arrays[side], at)} for side in arrays}}, []

    def _read_view(self, message: Mapping[str, Any]) -> tuple[float, Shading, float, float]:
        """Return time, shading, glow and stops of a message; missing ones stay as they are."""
        usual = 1.0 if self._scene is None else self._scene.glow_intensity
        time = check_number("time", message.get("time", 0.0), -1e9, 1e9)
        shading, glow = message.get("shading"), message.get("glow")
        return (
            time,
            self._shading if shading is None else check_shading(shading),
            usual if glow is None else check_number("glow", glow, 0, _MAX_GLOW),
            check_number("stops", message.get("stops", 0.0), -32, 32),
        )

    def _expansion_of(
        self, side: str, settings: Settings, message: Mapping[str, Any]
    ) -> float | None:
        """Return what a side is expanded up to; what a message leaves out stays."""
        asked = message.get("expand")
        if asked is None or (isinstance(asked, Mapping) and side not in asked):
            return self.expand[side]
        if not isinstance(asked, Mapping):
            raise TypeError(f"expand: {asked!r:.80} is not a mapping of a and b to numbers")
        if asked[side] == _AUTOMATIC:
            return start_of(self._highlights, settings).expand
        return _expansion(asked[side])

    def _faint_note(self, frames: Frames, expand: float | None, size: tuple[int, int]) -> str:
        """Return what a page says of a bloom that adds hardly any light to an image; else ""."""
        settings = frames.settings
        if self._scene is not None or "final" not in frames or not settings.bloom:
            return ""
        image = self._image_of(size, settings, expand)
        share = added_share(image, frames)
        return faint_note(share, settings, highlights=self._highlights, expand=expand)

    def _render(
        self,
        settings: Settings,
        expand: float | None,
        size: tuple[int, int],
        message: Mapping[str, Any],
    ) -> tuple[Frames, bytes, list[str], Plan]:
        """Return the named framebuffer, or `final`; its picture; all names; its plan."""
        name = message.get("framebuffer", "final")
        time, self._shading, glow, stops = self._read_view(message)
        draw: Any = self.renderer.apply
        if self._scene is not None:
            if glow != self._scene.glow_intensity:
                self._scene = dataclasses.replace(self._scene, glow_intensity=glow)
            draw = partial(self.renderer.render, time=time)
        source, how = self.source_at(size, settings, expand)
        names = list(self.renderer.plan(source, settings, **how).framebuffers)
        shown = str(name) if name in names else "final"
        how["framebuffers"] = [shown]
        plan = self.renderer.plan(source, settings, **how)
        frames = draw(source, settings, **how)
        picture = picture_of(frames[shown], shown, encoding=settings.encoding, stops=stops)
        return frames, picture, names, plan

    def _key_of(self, settings: Settings, expand: float | None) -> object:
        """Return what the pixels of the image depend on."""
        return None if self._picture is None else (expand or 1.0, settings.alpha != "keep")

    def _image_of(
        self, size: tuple[int, int], settings: Settings, expand: float | None
    ) -> NDArray[Any]:
        """Return the image at the size at which it is shown, as it starts with the settings."""
        key = self._key_of(settings, expand)

        def whole() -> NDArray[Any]:
            assert self._picture is not None  # An array is always kept.
            return Start(settings, expand).develop(self._picture).pixels

        return self._remember((size, key), lambda: reduce(self._remember(key, whole), size))

    def _remember(self, key: object, make: Callable[[], NDArray[Any]]) -> NDArray[Any]:
        """Return an image that was made before, or make it and drop the one not used longest."""
        image = self._images.pop(key) if key in self._images else make()
        self._images[key] = image
        while len(self._images) > _IMAGES_KEPT:
            del self._images[next(iter(self._images))]
        return image

    def _arrays_of(self, view: object) -> dict[str, NDArray[Any]]:
        """Return the dict of the framebuffers that a view shows, by side."""
        arrays = self._shown.pop(str(view), {})
        self._shown[str(view)] = arrays
        while len(self._shown) > _VIEWS_KEPT:
            del self._shown[next(iter(self._shown))]
        return arrays


def _read(name: str, files: Sequence[bytes]) -> Picture:
    """Return the picture of a file."""
    if len(files) != 1:
        raise ValueError("open: the message does not have the content of one file")
    with tempfile.TemporaryDirectory() as folder:
        # The file name may be anything. Only its extension is used, for the format.
        path = Path(folder, f"image{PurePath(name).suffix[:8]}")
        path.write_bytes(files[0])
        try:
            return read_picture(path)
        except (OSError, ValueError) as error:
            text = str(error).replace(str(path), name)
            raise ValueError(text if name in text else f"{name}: {text}") from error


def _expansion(asked: Any) -> float | None:
    """Return what a page asks to expand highlights up to."""
    return None if asked is None else check_expansion(asked)


def _note_of(settings: Settings, shown: str) -> str:
    """Return what a page says of a framebuffer that is not what its name or its colours tell."""
    if shown == "glow":
        return settings.glow_note and f"glow is {settings.glow_note}"
    if shown == "kernel" and not METHODS.is_added(settings.method):
        return "kernel is the point-spread function, which no pass writes: it is computed once"
    if shown != "final" or settings.encoding not in ("pq", "hlg"):
        return ""
    return f"this page shows SDR: final's {settings.encoding} signal is shown as sRGB"


def rows_of(plan: Plan) -> list[dict[str, Any]]:
    """Return what a page says of the passes of a plan."""
    return [{**one._asdict(), "sentence": plan.sentences[one.name]} for one in plan.passes]


def _finite(timings: Mapping[str, float]) -> dict[str, float]:
    """Return the times that are finite, which JSON requires."""
    return {name: seconds for name, seconds in timings.items() if math.isfinite(seconds)}


def _describe(error: BaseException) -> str:
    return str(error) or type(error).__name__


def _position(at: object) -> tuple[float, float]:
    if not (isinstance(at, list | tuple) and len(at) == 2):
        raise TypeError(f"at: {at!r:.80} is not (x, y)")
    for part in at:
        check_number("at", part, 0, 1)
    return float(at[0]), float(at[1])


def _probe(array: NDArray[Any], at: tuple[float, float]) -> dict[str, Any]:
    height, width = array.shape[:2]
    # A position of 1 is the far edge of the last pixel.
    x, y = min(int(at[0] * width), width - 1), min(int(at[1] * height), height - 1)
    number = int if array.dtype.kind == "u" else float
    # NumPy's text of a value has the digits that tell it apart from others of its dtype.
    values = [str(number(str(value))) for value in np.atleast_1d(array[y, x])]
    return {"x": x, "y": y, "values": values}


class CustomFiles:
    """The custom methods that a page knows, and the errors of their files."""

    def __init__(self) -> None:
        self._known = {name: METHODS[name] for name in METHODS if METHODS.is_added(name)}
        self._read: dict[str, tuple[tuple[int, int], ...]] = {}
        self._errors: dict[str, str] = {}

    def __bool__(self) -> bool:
        return bool(self._known)

    def changes(self) -> tuple[dict[str, type[Settings]], dict[str, str]]:
        """Load changed files again.

        Returns: the classes that are new since the last call, and the errors of all files that do
        not load, by the names of the methods. A method whose file does not load stays as it was.
        """
        new: dict[str, type[Settings]] = {}
        for name in self._known:
            self._load(name)
            if name in METHODS and METHODS[name] is not self._known[name]:
                new[name] = self._known[name] = METHODS[name]
        return new, self._errors

    def _load(self, name: str) -> None:
        """Load a method's file again if it is another than before."""
        kind = METHODS.get(name)
        if not isinstance(kind, CustomType) or not kind.file.source.files:
            return
        try:
            results = [os.stat(file) for file in kind.file.source.files]
            stamp = tuple((result.st_mtime_ns, result.st_size) for result in results)
            if self._read.get(name) == stamp:
                return
            self._read[name] = stamp
            source = read_again(kind.file.source)
            if source != kind.file.source:
                register(name, source, kind.numpy_reference)
            self._errors.pop(name, None)
        except (_core.Error, OSError, ValueError) as error:
            self._errors[name] = str(error)


def current(settings: Settings) -> Settings:
    """Return settings of a custom method as those of the class that is loaded now.

    Fields that the class does not have, or whose values it does not accept, are its defaults.
    """
    kind = METHODS.get(settings.method)
    if kind is None or isinstance(settings, kind):
        return settings
    begun: Settings = kind()
    for name in fields_of(kind):
        if hasattr(settings, name):
            try:
                begun = begun.replace(**{name: getattr(settings, name)})
            except (TypeError, ValueError):
                continue
    return begun
