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
         to, or "auto"; of a clip number,              pointer; of a clip its curve, or "reached"
         exposure, taa, curve                          if it has to be asked again; or an error
curve    as of frame                                   of each side the curve, which has grown
probe    at: the pointer's place, 0..1 across, down    of each side: pixel and values
open     name; the content of a file as a buffer       source, and the settings to begin with
save     settings; expand of them; else as of frame    a picture of the source's own size, which
                                                       holds its settings as files of vkbloom do
methods                                                the custom methods whose files changed, as in
                                                       setup, and the errors of their files
======== ============================================= =========================================

A frame of a clip is reached when those before it are computed. A curve has the exposures of frames
that the page does not know: its message has of each side the chain of states that it knows, and how
many of its exposures.

``view`` and ``id`` are returned as they were sent. A page asks for its next frame when it has
received the one before. Of the changes in between, only the newest one is rendered.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vkbloom import _core
from vkbloom._explorer.controls import (
    as_code,
    as_fields,
    code_with_image,
    controls,
    describe,
    settings_from,
)
from vkbloom._explorer.custom_files import CustomFiles, current
from vkbloom._explorer.fast_pictures import picture_levels, picture_of
from vkbloom._explorer.images import Images
from vkbloom._explorer.playing import PATIENCE, STATES, Chain, Chains, Clip, NotReached, Stages
from vkbloom._explorer.saying import (
    describe_error,
    keep_finite,
    note_of,
    probe,
    read_opened,
    read_position,
    rows_of,
)
from vkbloom._image_arguments import check_image
from vkbloom._io.expansion import check_expansion
from vkbloom._io.image_writing import levels_of
from vkbloom._io.picture import Highlights, Picture
from vkbloom._numbers import check_number, check_size
from vkbloom._presets.start import Start, start_of
from vkbloom._renderer.added_light import added_share, faint_note
from vkbloom._renderer.frame_files import settings_facts
from vkbloom._renderer.renderer import Renderer
from vkbloom._scene import Scene
from vkbloom._settings.settings import (
    SHADINGS,
    check_settings,
    check_shading,
    expansion_of_final,
)
from vkbloom._views.pictures import png

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
_MAX_GLOW: Final = 1e4
# A deferred scene has light above white, which needs a tone map.
_DEVELOPED: Final = {"tonemap": "aces", "encoding": "srgb"}

Answer = tuple[dict[str, Any], list[bytes]]


class _Shot(NamedTuple):
    """What a frame of one side is made of.

    - `time`: Of a scene, in periods of its animation.
    - `number`: Of a frame of a clip. `stages`: those of a clip in time.
    """

    settings: Settings
    expand: float | None
    size: tuple[int, int]
    time: float
    number: int = 0
    stages: Stages = Stages()

    @property
    def start(self) -> Start:
        """Where an image starts."""
        return Start(self.settings, self.expand)


class _Drawn(NamedTuple):
    """A framebuffer, its picture, the names of all, the plan, and the states of a clip."""

    frames: Frames
    picture: bytes
    names: list[str]
    plan: Plan
    chain: Chain | None


def default_scene() -> Scene:
    """Return the scene that is shown if there is no other source."""
    return dataclasses.replace(Scene.ufo(), glow_intensity=GLOW)


class Viewer:
    """A source and the settings of both sides.

    Arguments are those of `vkbloom.explore`; of an image file the source is its decoded picture,
    and there are the file and what its highlights are expanded up to (None: as the settings say).
    Of a clip, which no other viewer reads, the source is the first frame, or the scene.

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
        clip: Clip | None = None,
    ) -> None:
        if source is None:
            source = default_scene()
        self._shading: Shading = check_shading(shading)
        self._file, self.name = file, PurePath(file).name
        self._clip, self._chains = clip, Chains()
        self._images = Images(source if isinstance(source, Picture) else None, clip)
        self._scene = source if isinstance(source, Scene) else None
        self.settings: dict[str, Settings] = {}
        self.expand: dict[str, float | None] = {}
        self._files = CustomFiles()
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
        """Close the renderer, unless the caller passed it, and a video. May be called twice."""
        if self._clip is not None:
            self._clip.close()
        if self._owned:
            self.renderer.close()

    @property
    def _highlights(self) -> Highlights | None:
        """What the source has of light above white; None: it is a scene."""
        if self._scene is not None:
            return None
        picture = self._images.picture
        return Highlights.STORED if picture is None else picture.highlights

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
        self._images.keep(self._start_of("a"), image)

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
            "curve": self._extend_curve,
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
            kind, body, buffers = "error", {"error": describe_error(error)}, []
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
            "animated": scene is not None and self._clip is None,
            "clip": None if self._clip is None else self._clip.describe(),
            "source_size": self._source_size,
            "shadings": [] if scene is None else list(SHADINGS),
            "shading": self._shading,
            "glow": None if scene is None or scene.glow is None else scene.glow_intensity,
        }

    def _open(self, message: Mapping[str, Any], files: Sequence[bytes]) -> Answer:
        """Replace the source by an image file."""
        name = PurePath(str(message.get("name", ""))).name
        picture = read_opened(name, files)
        check_image(picture.pixels)
        was_scene, self._scene, self._clip = self._scene is not None, None, None
        self._images, self._file, self.name = Images(picture, None), name, name
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
        try:
            shot = self._shot_of(settings, expand, self._source_size, message)
            drawn = self._render(shot, message)
        except NotReached as not_yet:
            return {"reached": not_yet.number}, []
        frames = drawn.frames
        (shown,) = frames
        stops = self._read_view(message)[-1]
        if self._scene is None and shown == "final" and stops == 0:
            # With the levels of the file that vkbloom apply writes.
            compressed = self.compressed_from(settings, expand)
            pixels = levels_of(frames[shown], settings.encoding, compressed)[:, :, :3]
        else:
            pixels = picture_levels(frames[shown], shown, encoding=settings.encoding, stops=stops)
        is_expanded = self._highlights is Highlights.CLIPPED
        facts = settings_facts(settings, (expand or 1.0) if is_expanded else None, frames)
        return {"framebuffer": shown}, [png(np.ascontiguousarray(pixels), texts=facts)]

    def _frame(self, message: Mapping[str, Any]) -> Answer:
        asked, size = self._asked(message)
        at = None if message.get("at") is None else read_position(message["at"])
        arrays = self._arrays_of(message.get("view"))
        sides: dict[str, Any] = {}
        buffers: list[bytes] = []
        for side in SIDES:
            if side not in asked:
                continue
            try:
                settings = settings_from(asked[side])
                expand = self._expansion_of(side, settings, message)
                shot = self._shot_of(settings, expand, size, message)
                drawn = self._render(shot, message)
            except NotReached as not_yet:
                curve = self._curve_of(not_yet.chain, side, message)
                sides[side] = {"reached": not_yet.number, **curve}
                continue
            except _FAILURES as error:
                # The other side is still shown.
                sides[side] = {"error": describe_error(error)}
                continue
            frames = drawn.frames
            self.settings[side], self.frames[side] = settings, frames
            self.expand[side] = expand
            (shown,) = frames
            arrays[side] = frames[shown]
            sides[side] = {
                **self.describe(frames, shown, expand, size),
                "names": drawn.names,
                "plan": rows_of(drawn.plan),
                "passes": keep_finite(frames.timings),
                "picture": len(buffers),
                **self._curve_of(drawn.chain, side, message),
            }
            if self._clip is not None:
                code = self._clip.code(self._file, shot.stages, self._shading)
                sides[side]["code"] = f"settings = {as_code(settings)}\n{code}"
            if at is not None:
                sides[side]["probe"] = probe(frames[shown], at)
            buffers.append(drawn.picture)
        return {"sides": sides}, buffers

    def _asked(self, message: Mapping[str, Any]) -> tuple[Mapping[str, Any], tuple[int, int]]:
        """Return the settings by side, and the size, that a message asks for."""
        asked = message.get("sides")
        if not isinstance(asked, Mapping) or not set(asked) <= set(SIDES):
            raise ValueError(f"sides: {asked!r:.80} are not settings of a or b")
        size = message.get("size")
        size = self._source_size if size is None else check_size("size", size)
        self._read_view(message)
        return asked, (min(size[0], _MAX_SIDE), min(size[1], _MAX_SIDE))

    def _extend_curve(self, message: Mapping[str, Any]) -> Answer:
        asked, size = self._asked(message)
        sides = {}
        for side in asked:
            settings = settings_from(asked[side])
            expand = self._expansion_of(side, settings, message)
            chain = self._chain_of(self._shot_of(settings, expand, size, message))
            if chain is not None:
                chain.extend(PATIENCE / len(asked))
                sides[side] = self._curve_of(chain, side, message)
        return {"sides": sides}, []

    def _curve_of(
        self, chain: Chain | None, side: str, message: Mapping[str, Any]
    ) -> dict[str, Any]:
        """Return the part of a clip's exposure that a page does not know."""
        known = message.get("curve")
        if chain is None or not chain.has_exposure:
            return {}
        return {"curve": chain.curve(known.get(side) if isinstance(known, Mapping) else None)}

    def describe(
        self, frames: Frames, shown: str, expand: float | None, size: tuple[int, int]
    ) -> dict[str, Any]:
        """Return what a page says of a framebuffer, besides its plan and times."""
        settings = frames.settings
        return {
            "framebuffer": shown,
            "size": [frames[shown].shape[1], frames[shown].shape[0]],
            "dtype": str(frames[shown].dtype),
            "note": note_of(settings, shown),
            "expand": expand,
            "faint": self._faint_note(frames, expand, size) if shown == "final" else "",
            "code": code_with_image(settings, self._file, expand),
        }

    def source_at(
        self, size: tuple[int, int], settings: Settings, expand: float | None
    ) -> tuple[Any, dict[str, Any]]:
        """Return the scene, or the image at a size, and the arguments of a scene's frame."""
        return self._source_of(_Shot(settings, expand, size, 0.0))

    def _source_of(self, shot: _Shot) -> tuple[Any, dict[str, Any]]:
        if self._scene is None:
            return self._images.at(shot.start, shot.size, shot.number), {}
        return self._scene, {"size": shot.size, "shading": self._shading}

    def _probe(self, message: Mapping[str, Any]) -> Answer:
        at = read_position(message.get("at"))
        arrays = self._arrays_of(message.get("view"))
        return {"sides": {side: {"probe": probe(arrays[side], at)} for side in arrays}}, []

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

    def compressed_from(self, settings: Settings, expand: float | None) -> float:
        """Return what a picture of `final` is compressed from, as in a file of `vkbloom apply`."""
        is_expanded = self._highlights is Highlights.CLIPPED
        return expansion_of_final(settings, expand) if is_expanded else 1.0

    def _faint_note(self, frames: Frames, expand: float | None, size: tuple[int, int]) -> str:
        """Return what a page says of a bloom that adds hardly any light to an image; else ""."""
        settings = frames.settings
        # (An exposure changes the picture's light as well.)
        is_other = self._scene is not None or self._clip is not None
        if is_other or "final" not in frames or not settings.bloom:
            return ""
        image = self._images.at(Start(settings, expand), size, 0)
        share = added_share(image, frames)
        return faint_note(share, settings, highlights=self._highlights, expand=expand)

    def _shot_of(
        self,
        settings: Settings,
        expand: float | None,
        size: tuple[int, int],
        message: Mapping[str, Any],
    ) -> _Shot:
        """Return what a message asks for; a scene gets its shading and glow."""
        time, self._shading, glow, _ = self._read_view(message)
        if self._scene is not None and glow != self._scene.glow_intensity:
            self._scene = dataclasses.replace(self._scene, glow_intensity=glow)
        shot = _Shot(settings, expand, size, time)
        if self._clip is None:
            return shot
        return shot._replace(number=self._clip.number(message), stages=self._clip.stages(message))

    def _render(self, shot: _Shot, message: Mapping[str, Any]) -> _Drawn:
        """Return the named framebuffer, or `final`; raise NotReached for a frame of a clip."""
        name, settings = message.get("framebuffer", "final"), shot.settings
        stops = self._read_view(message)[-1]
        chain = self._chain_of(shot)
        state = None if chain is None else chain.state(shot.number, PATIENCE)
        source, how = self._source_of(shot)
        how |= shot.stages.keywords()
        names = list(self.renderer.plan(source, settings, **how).framebuffers)
        shown = str(name) if name in names else "final"
        plan = self.renderer.plan(source, settings, **how, framebuffers=[shown])
        frames = self._draw(shot, [shown], state)
        if chain is not None and shown == "final":
            # What it leaves to the next frame is complete.
            chain.advance(shot.number, frames)
        how_shown = {"stops": stops, "expand": self.compressed_from(settings, shot.expand)}
        picture = picture_of(frames[shown], shown, encoding=settings.encoding, **how_shown)
        return _Drawn(frames, picture, names, plan, chain)

    def _draw(
        self, shot: _Shot, names: Sequence[str], state: Mapping[str, Any] | None = None
    ) -> Frames:
        """Return framebuffers; of a clip, as a sequence computes this frame."""
        source, how = self._source_of(shot)
        settings, time = shot.settings, shot.time
        if self._clip is not None:
            settings = settings._in_sequence(shot.number, {})
            time = self._clip.turns(shot.number)
            how |= {"dt": self._clip.step(shot.number), "state": state}
        how |= {**shot.stages.keywords(), "framebuffers": names}
        if self._scene is None:
            return self.renderer.apply(source, settings, **how)
        return self.renderer.render(source, settings, time=time, **how)

    def _chain_of(self, shot: _Shot) -> Chain | None:
        """Return the states of a clip's frames; None: a frame does not depend on those before."""
        clip, settings, stages = self._clip, shot.settings, shot.stages
        if clip is None or not stages.continues(settings):
            return None
        if getattr(settings, "_has_state", False):
            raise ValueError(
                f"method: {settings.method} has a storage, which cannot be kept for each frame; "
                "vkbloom.sequence computes its frames one after the other"
            )
        needed = settings if stages.needs_bloom(settings) else None
        glow = None if self._scene is None else self._scene.glow_intensity
        key = self._images.key(shot.start), shot.size, stages, needed, self._shading, glow

        names = ["final"] if settings._continues else []

        def compute(number: int, state: Mapping[str, Any]) -> Frames:
            frame = shot._replace(number=number)
            if not names:
                source, how = self._source_of(frame)
                how |= stages.keywords()
                known = self.renderer.plan(source, settings, **how).framebuffers
                names.extend(name for name in STATES if name in known)
            return self._draw(frame, names, state)

        has_exposure = stages.exposure is not None
        return self._chains.find(key, lambda: Chain(compute, clip.count, has_exposure=has_exposure))

    def _arrays_of(self, view: object) -> dict[str, NDArray[Any]]:
        """Return the dict of the framebuffers that a view shows, by side."""
        arrays = self._shown.pop(str(view), {})
        self._shown[str(view)] = arrays
        while len(self._shown) > _VIEWS_KEPT:
            del self._shown[next(iter(self._shown))]
        return arrays


def _expansion(asked: Any) -> float | None:
    """Return what a page asks to expand highlights up to."""
    return None if asked is None else check_expansion(asked)
