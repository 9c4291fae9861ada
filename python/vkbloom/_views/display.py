"""HTML of settings, scenes and renderers for notebooks, without scripts.

Text inherits the page's colour, so that it suits light and dark themes.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Final

from vkbloom._views import markup, pictures
from vkbloom._views.markup import Markup, element

if TYPE_CHECKING:
    from _typeshed import DataclassInstance
    from numpy.typing import NDArray

    from vkbloom._renderer.adapter import AdapterInfo

__all__ = ["fields_html", "renderer_html", "scene_html"]

_CELL: Final = "padding:1px 12px 1px 0;text-align:left;vertical-align:top"
_FACE_SIDE: Final = 72  # pixels
# Grid positions ("row / column") of the faces +x, -x, +y, -y, +z, -z in a cross of four columns.
# -y is up; see `vkbloom._scene.skybox`.
_CROSS: Final = ("2 / 3", "2 / 1", "3 / 2", "1 / 2", "2 / 2", "2 / 4")


def fields_html(settings: DataclassInstance) -> str:
    """Return settings as a table: changed fields, then the others in a collapsed section."""
    changed, unchanged = [], []
    for field in dataclasses.fields(settings):
        value = getattr(settings, field.name)
        if value == field.default:
            unchanged.append((field.name, repr(value)))
        else:
            changed.append((field.name, f"{value!r} (default {field.default!r})"))
    summary = f"{len(unchanged)} fields at their defaults"
    rest = element(
        "details",
        element("summary", summary, style="cursor:pointer;opacity:.8"),
        _table(unchanged),
    )
    return _block(type(settings).__name__, *([_table(changed)] if changed else []), rest)


def scene_html(rows: Iterable[tuple[str, str]], faces: NDArray[Any] | None) -> str:
    """Return a scene as a table, with the faces of its sky as a cross."""
    return _block("Scene", _table(rows), *([] if faces is None else [_cross(faces)]))


def renderer_html(info: AdapterInfo, *, closed: bool) -> str:
    """Return a renderer's adapter as a table."""
    driver = " ".join(part for part in (info.driver, info.driver_info) if part)
    rows = [
        ("adapter", info.name),
        ("type", info.type),
        ("driver", driver or "unnamed"),
        ("Vulkan", info.api_version),
        ("state", "closed" if closed else "open"),
    ]
    return _block("Renderer", _table(rows))


def _block(title: str, *body: Markup) -> str:
    heading = element("div", title, style="font-weight:bold;margin-bottom:2px")
    return str(element("div", heading, *body, style="color:inherit;font-size:13px"))


def _table(rows: Iterable[tuple[str, str]]) -> Markup:
    return markup.table(
        rows,
        name={"style": f"{_CELL};font-weight:normal;opacity:.8"},
        cell={"style": f"{_CELL};overflow-wrap:anywhere"},
        style="color:inherit;font-size:inherit;border-collapse:collapse;margin:0;border:0",
    )


def _cross(faces: NDArray[Any]) -> Markup:
    step = max(1, faces.shape[1] // _FACE_SIDE)
    names = ("+x", "-x", "+y", "-y", "+z", "-z")
    cells = [
        markup.image(
            pictures.png(pictures.picture(face[::step, ::step, :3], encoded=True)),
            f"sky {name}",
            title=name,
            style=f"grid-area:{area};width:{_FACE_SIDE}px;height:{_FACE_SIDE}px;margin:0",
        )
        for name, area, face in zip(names, _CROSS, faces, strict=True)
    ]
    return element("div", *cells, style="display:inline-grid;gap:1px;margin-top:6px")
