"""HTML of settings, scenes and renderers for notebooks, without scripts.

Text inherits the page's colour, and lines and backgrounds are a translucent grey, so that they
suit light and dark themes. All texts are escaped. Styles are attributes of the elements, because
notebooks that are not trusted remove style sheets.
"""

from __future__ import annotations

import base64
import dataclasses
import html
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from vkbloom._views import pictures

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
    rest = (
        f'<details><summary style="cursor:pointer;opacity:.8">{len(unchanged)} fields at their '
        f"defaults</summary>{_table(unchanged)}</details>"
    )
    return _block(type(settings).__name__, (_table(changed) if changed else "") + rest)


def scene_html(rows: Iterable[tuple[str, str]], faces: NDArray[Any] | None) -> str:
    """Return a scene as a table, with the faces of its sky as a cross.

    `faces`: ndarray, shape (6, N, N, C), or None; Faces of the sky: +x, -x, +y, -y, +z, -z.
    """
    return _block("Scene", _table(rows) + ("" if faces is None else _cross(faces)))


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


def _block(title: str, body: str) -> str:
    return (
        '<div style="color:inherit;font-size:13px">'
        f'<div style="font-weight:bold;margin-bottom:2px">{html.escape(title)}</div>{body}</div>'
    )


def _table(rows: Iterable[tuple[str, str]]) -> str:
    cells = "".join(
        f'<tr style="background:none"><th style="{_CELL};font-weight:normal;opacity:.8">'
        f'{html.escape(name)}</th><td style="{_CELL};overflow-wrap:anywhere">'
        f"{html.escape(value)}</td></tr>"
        for name, value in rows
    )
    return (
        '<table style="color:inherit;font-size:inherit;border-collapse:collapse;margin:0;border:0">'
        f"<tbody>{cells}</tbody></table>"
    )


def _cross(faces: NDArray[Any]) -> str:
    step = max(1, faces.shape[1] // _FACE_SIDE)
    small = faces[:, ::step, ::step, :3]
    if small.dtype != np.uint8:
        with np.errstate(invalid="ignore"):
            small = np.rint(255 * np.clip(np.nan_to_num(small.astype(np.float32)), 0, 1))
    cells = []
    for name, place, face in zip(
        ("+x", "-x", "+y", "-y", "+z", "-z"), _CROSS, small.astype(np.uint8), strict=True
    ):
        data = base64.b64encode(pictures.png(np.ascontiguousarray(face))).decode("ascii")
        cells.append(
            f'<img src="data:image/png;base64,{data}" alt="sky {name}" title="{name}" '
            f'style="grid-area:{place};width:{_FACE_SIDE}px;height:{_FACE_SIDE}px;margin:0">'
        )
    return f'<div style="display:inline-grid;gap:1px;margin-top:6px">{"".join(cells)}</div>'
