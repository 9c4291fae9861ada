"""A page of stored pictures: the explorer's page without a server, which opens as a file.

A grid renders all combinations of a few values of each slider. The page has a table of what the
server would answer for each framebuffer of each point, and its pictures as files. `stored.js`
answers the page's messages from the table.
"""

from __future__ import annotations

import base64
import hashlib
import itertools
import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import resources
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vkbloom._explorer.controls import as_fields, controls
from vkbloom._explorer.fast_pictures import picture_levels
from vkbloom._explorer.saying import rows_of
from vkbloom._explorer.viewer import Viewer
from vkbloom._grid.grid import grid
from vkbloom._io import image_writing
from vkbloom._io.picture import Picture
from vkbloom._renderer.frames import Frames
from vkbloom._settings.settings import Settings
from vkbloom._version import installed_version
from vkbloom._views.pictures import scale_size

#: Quality of the WebP files, 1 to 100.
QUALITY: Final = 80
#: Smaller pictures are PNG: they are shown enlarged, and WebP blurs the colours of their pixels.
_MAX_PNG_PIXELS: Final = 2048
#: The sliders that the page of one picture has, if the call names none.
_SLIDERS: Final = 3

_FILES: Final = resources.files("vkbloom._explorer")
# Of a framebuffer that a point of a grid lacks.
_NO_ANSWER: Final = [-1, -1, -1]
_REASON: Final = "Not among the stored pictures; vkbloom explore changes it"
# Nothing is loaded but the pictures beside the page, or in it.
_POLICY: Final = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src 'self' file: data: blob:; base-uri 'none'; form-action 'none'"
)

Axes = Mapping[str, Sequence[Any]]


class StoredGrid(NamedTuple):
    """Settings, and the values of the fields that have a slider; `name` is that of the preset."""

    settings: Settings
    axes: Axes
    name: str = ""


class StoredSource(NamedTuple):
    """A picture or scene: its name on the page, its viewer, and its grids, one for each method."""

    name: str
    viewer: Viewer
    grids: Sequence[StoredGrid]


def write_stored(
    out: str | os.PathLike[str],
    sources: Sequence[StoredSource],
    *,
    size: tuple[int, int],
    quality: int = QUALITY,
    progress: bool | None = False,
) -> None:
    """Write a page of stored pictures.

    - `out`: A new folder, which gets ``index.html`` and ``pictures``; or a file ``NAME.html``,
      which holds the pictures, too. A file is replaced.
    - `size`: The width and height into which the frames fit; they are not enlarged.
    """
    target = Path(out)
    is_file = target.suffix.lower() in (".html", ".htm")
    if not is_file and target.exists() and (not target.is_dir() or any(target.iterdir())):
        raise FileExistsError(f"{target}: it exists; name a new folder, or a file NAME.html")
    with _temporary_folder(target) as folder:
        pictures = Pictures(folder / "pictures", quality)
        table = _Table(pictures, size, progress)
        described = [table.add(source) for source in sources]
        addresses = [
            _data_address(pictures.folder / name) if is_file else f"pictures/{name}"
            for name in pictures.names
        ]
        page = _page({**table.content(sources, described), "pictures": addresses})
        index = folder / "index.html"
        index.write_text(page, "utf-8")
        os.chmod(folder, 0o755)
        os.replace(index if is_file else folder, target)


@contextmanager
def _temporary_folder(target: Path) -> Iterator[Path]:
    """Yield a new folder beside a file; what is left of it at the end is removed."""
    target.parent.mkdir(parents=True, exist_ok=True)
    folder = Path(tempfile.mkdtemp(dir=target.parent, prefix=".vkbloom-"))
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _data_address(file: Path) -> str:
    return f"data:image/{file.suffix[1:]};base64,{base64.b64encode(file.read_bytes()).decode()}"


class Pictures:
    """Files of pictures, each once: those with the same pixels are one file."""

    def __init__(self, folder: Path, quality: int = QUALITY) -> None:
        self.folder, self._quality = folder, quality
        #: The files' names, in the order of their indices.
        self.names: list[str] = []
        self._indices: dict[str, int] = {}
        folder.mkdir()

    def add(self, levels: NDArray[np.uint8]) -> int:
        """Write a picture unless it is there, and return its index."""
        # WebP has no grey pictures.
        pixels = np.ascontiguousarray(np.broadcast_to(levels, (*levels.shape[:2], 3)))
        digest = hashlib.sha256(str(pixels.shape).encode() + pixels.tobytes())
        key = digest.hexdigest()[:16]
        if key not in self._indices:
            is_small = pixels.shape[0] * pixels.shape[1] <= _MAX_PNG_PIXELS
            name, quality = (f"{key}.png", None) if is_small else (f"{key}.webp", self._quality)
            image_writing.save(Picture.of_values(pixels), self.folder / name, quality=quality)
            self._indices[key] = len(self.names)
            self.names.append(name)
        return self._indices[key]


class _Interned:
    """Values of JSON, each once, by index."""

    def __init__(self) -> None:
        self._indices: dict[str, int] = {}

    def add(self, value: object) -> int:
        return self._indices.setdefault(json.dumps(value, allow_nan=False), len(self._indices))

    def values(self) -> list[Any]:
        return [json.loads(text) for text in self._indices]


class _Table:
    """The answers of a page: facts, code and picture of each framebuffer of each point."""

    def __init__(self, pictures: Pictures, size: tuple[int, int], progress: bool | None) -> None:
        self._pictures, self._size, self._progress = pictures, size, progress
        self._facts, self._plans, self._codes = _Interned(), _Interned(), _Interned()

    def content(
        self, sources: Sequence[StoredSource], described: Sequence[Mapping[str, Any]]
    ) -> dict[str, Any]:
        note = (
            f"Pictures stored by vkbloom {installed_version()}: a slider moves between stored "
            "values, and what is grey needs vkbloom explore."
        )
        stored = {
            "reason": _REASON,
            "note": note,
            "sources": [source.name for source in sources],
        }
        known = controls()
        return {
            "setup": {
                **{name: known[name] for name in ("functions", "glare", "descriptions", "look")},
                "adapter": sources[0].viewer.renderer.info.summary,
                "has_files": False,
                "stored": stored,
            },
            "sources": list(described),
            "facts": self._facts.values(),
            "plans": self._plans.values(),
            "codes": self._codes.values(),
        }

    def add(self, source: StoredSource) -> dict[str, Any]:
        """Render a source, and return what the page knows of it."""
        methods: dict[str, Any] = {}
        grids: dict[str, Any] = {}
        known = controls()["methods"]
        for one in source.grids:
            method = one.settings.method
            if method in grids:
                raise ValueError(f"grids: there are two of the method {method!r}; give one")
            begun = _move_onto(one.settings, one.axes)
            fields = as_fields(begun)
            described = known[method]["fields"]
            methods[method] = {
                "defaults": fields,
                "fields": [_with_values(field, one.axes) for field in described],
            }
            grids[method] = {
                "defaults": fields,
                "axes": [[name, list(values)] for name, values in one.axes.items()],
                "on": self._render(source.viewer, one.settings.replace(bloom=True), one.axes),
                "off": self._render(source.viewer, one.settings, {"bloom": [False]}),
            }
        first = _move_onto(source.grids[0].settings, source.grids[0].axes)
        about = {
            **source.viewer.describe_source(),
            "name": source.name,
            "methods": methods,
            "presets": {
                one.name: grids[one.settings.method]["defaults"] for one in source.grids if one.name
            },
            "sides": {"a": as_fields(first), "b": as_fields(first.replace(bloom=False))},
        }
        return {"source": about, "grids": grids}

    def _render(self, viewer: Viewer, settings: Settings, axes: Axes) -> dict[str, Any]:
        """Render a grid; return the framebuffers, and facts, code and picture of each."""
        expand = viewer.expand["a"]
        source, how = viewer.source_at(_fit(viewer, self._size), settings, expand)
        points = [
            settings.replace(**dict(zip(axes, point, strict=True)))
            for point in itertools.product(*axes.values())
        ]
        plans = [list(viewer.renderer.plan(source, point, **how).framebuffers) for point in points]
        # Points may have framebuffers that others lack, such as those of more levels.
        longest = max(plans, key=len)
        names = list(dict.fromkeys(name for plan in (longest, *plans) for name in plan))

        def answer(frames: Frames, name: str) -> list[int]:
            if name not in frames:
                return _NO_ANSWER
            # Values of a field may differ in the variants of passes.
            plan = viewer.renderer.plan(source, frames.settings, **how, framebuffers=[name])
            return self._answer(viewer, frames, name, rows_of(plan))

        def answers(frames: Frames) -> list[list[int]]:
            return [answer(frames, name) for name in names]

        dataset = grid(
            source,
            settings,
            axes,
            framebuffers=(),
            reduce={"answers": answers},
            renderer=viewer.renderer,
            progress=self._progress,
            **how,
        )
        return {"names": names, "answers": dataset["answers"].values.ravel().tolist()}

    def _answer(
        self, viewer: Viewer, frames: Frames, name: str, plan: list[dict[str, Any]]
    ) -> list[int]:
        """Return the indices of a framebuffer's facts, code and picture."""
        facts = viewer.describe(frames, name, viewer.expand["a"], _fit(viewer, self._size))
        code = self._codes.add(facts.pop("code"))
        facts["plan"] = self._plans.add(plan)
        settings = frames.settings
        expand = viewer.compressed_from(settings, viewer.expand["a"])
        how: dict[str, Any] = {"encoding": settings.encoding, "stops": 0.0, "expand": expand}
        levels = picture_levels(frames[name], name, **how)
        return [self._facts.add(facts), code, self._pictures.add(levels)]


def _move_onto(settings: Settings, axes: Axes) -> Settings:
    """Return the point of a grid that is nearest to settings, with which a page begins."""

    def nearest(value: Any, values: Sequence[Any]) -> Any:
        if value in values or isinstance(value, str) or value is None:
            return value if value in values else values[0]
        return min(values, key=lambda one: abs(value - one))

    return settings.replace(
        **{name: nearest(getattr(settings, name), values) for name, values in axes.items()}
    )


def _with_values(field: dict[str, Any], axes: Axes) -> dict[str, Any]:
    """Return the control of a field with the values for which there are stored pictures."""
    name = field["name"]
    if name == "bloom":
        return {**field, "stored": True}
    if name not in axes:
        return field
    return {**field, "stored": True, "first": True, "values": list(axes[name])}


def _page(table: Mapping[str, Any]) -> str:
    """Return the page, with its style, its scripts and the table of answers."""
    page = (_FILES / "page.html").read_text("utf-8")
    style, script, answering = (
        (_FILES / name).read_text("utf-8") for name in ("page.css", "page.js", "stored.js")
    )
    # A text of the table cannot end its element.
    text = json.dumps(table, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    parts = {
        '<link rel="stylesheet" href="page.css">': f"<style>\n{style}</style>",
        '<script type="module" src="start.js"></script>': (
            f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">'
        ),
        '<main id="explorer"></main>': (
            '<main id="explorer"></main>\n'
            f'    <script type="application/json" id="stored">{text}</script>\n'
            f'    <script type="module">\n{script}\n{answering}</script>'
        ),
    }
    for old, new in parts.items():
        page = page.replace(old, new)
    return page


def choose_axes(settings: Settings) -> dict[str, list[Any]]:
    """Return values of up to three fields: that of the settings, and less and more.

    These are the method's everyday sliders.
    """
    axes: dict[str, list[Any]] = {}
    for field in controls()["methods"][settings.method]["fields"]:
        name, value = field["name"], getattr(settings, field["name"])
        if field["kind"] != "number" or not field["first"] or name == "exposure" or value is None:
            continue
        values = [one for one in _values_around(value, field) if _can_be(settings, name, one)]
        if len(values) > 1 and len(axes) < _SLIDERS:
            axes[name] = values
    return axes or {"intensity": [settings.intensity]}


def _fit(viewer: Viewer, size: tuple[int, int]) -> tuple[int, int]:
    """Return the size of the source's frame where it fits into a size, at most its own."""
    own: tuple[int, int] = viewer.describe_source()["source_size"]
    factor = min(1.0, *(side / length for side, length in zip(size, own, strict=True)))
    return scale_size(*own, factor)


def _values_around(value: float, field: Mapping[str, Any]) -> list[Any]:
    low, high = field["from"], field["to"]
    # An intensity is a factor: half and double; others are halfway to the ends of their slider.
    around = (
        (value / 2, 2 * value)
        if field["name"] == "intensity"
        else ((low + value) / 2, (value + high) / 2)
    )
    number: Callable[[float], Any] = (
        round if field["integer"] else (lambda one: float(f"{one:.3g}"))
    )
    return sorted({value, *map(number, around)})


def _can_be(settings: Settings, name: str, value: Any) -> bool:
    try:
        settings.replace(**{name: value})
    except ValueError:
        return False
    return True
