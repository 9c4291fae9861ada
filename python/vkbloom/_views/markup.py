"""HTML of reports, pages and notebooks: elements, whose texts are escaped.

Styles are attributes of the elements, because notebooks that are not trusted remove style sheets.
"""

from __future__ import annotations

import base64
import html
from collections.abc import Iterable, Mapping, Sequence
from typing import Final

_NO_ATTRIBUTES: Final[Mapping[str, object]] = {}
# Of cells: some notebooks, such as marimo, have no padding of their own.
_CELL: Final = "padding:2px 8px"
# Of a page, which is no notebook. Only the last cell of a row may break within a word: where every
# cell may, a long text beside short ones makes their columns as narrow as a letter.
_STYLE: Final = (
    ":root{color-scheme:light dark;font:15px/1.4 sans-serif}body{max-width:80em;margin:2em auto;"
    "padding:0 1em;background:canvas}pre{white-space:pre-wrap}"
    "td,th,pre{text-align:left}th{overflow-wrap:break-word;max-width:40em}"
    "td:last-child{min-width:12em}td:last-child,pre{overflow-wrap:anywhere}"
    "td:not(:last-child){white-space:nowrap}"
    "figure{display:inline-block;margin:0 12px 12px 0}img{max-width:100%;image-rendering:pixelated}"
)


class Markup(str):
    """HTML, which is not escaped again. Notebooks get str(markup): some refuse other types."""

    __slots__ = ()


def join(parts: Iterable[object]) -> Markup:
    """Return HTML as it is, and other values as escaped text, one after the other."""
    return Markup(
        "".join(part if isinstance(part, Markup) else html.escape(str(part)) for part in parts)
    )


def element(name: str, *content: object, **attributes: object) -> Markup:
    """Return an element; in names of attributes, _ is written for - and after a word of Python.

    An attribute that is None is left out.
    """
    written = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{html.escape(str(value))}"'
        for key, value in attributes.items()
        if value is not None
    )
    end = "" if name in ("br", "hr", "img", "meta") else f"</{name}>"
    return Markup(f"<{name}{written}>{join(content)}{end}")


def image(png: bytes, alt: str, **attributes: object) -> Markup:
    """Return an image with its data."""
    data = base64.b64encode(png).decode("ascii")
    return element("img", src=f"data:image/png;base64,{data}", alt=alt, **attributes)


def figure(content: Markup, *caption: object, **attributes: object) -> Markup:
    """Return a picture with its caption."""
    return element("figure", content, element("figcaption", *caption), **attributes)


def table(
    rows: Iterable[Sequence[object]],
    head: Sequence[str] = (),
    *,
    caption: object = None,
    name: Mapping[str, object] = _NO_ATTRIBUTES,
    cell: Mapping[str, object] = _NO_ATTRIBUTES,
    **attributes: object,
) -> Markup:
    """Return rows whose first value is their name.

    `name`, `cell`: attributes of cells with the name of a row or column, and of all others.
    """
    name, cell = ({**given, "style": f"{_CELL};{given.get('style', '')}"} for given in (name, cell))
    body = [
        element(
            "tr",
            element("th", first, scope="row", **name),
            *(element("td", value, **cell) for value in rest),
        )
        for first, *rest in rows
    ]
    heads = [element("th", text, scope="col", **name) for text in head]
    return element(
        "table",
        *([] if caption is None else [element("caption", caption)]),
        *([element("thead", element("tr", *heads))] if heads else []),
        element("tbody", *body),
        **attributes,
    )


def share_bar(share: float) -> Markup:
    """Return a share of a whole, 0 to 1, as a bar and as text; a screen reader reads the text."""
    bar = element(
        "div",
        style=f"height:.7em;width:{100 * share:.1f}%;background:currentColor;opacity:.5",
    )
    return element(
        "div",
        element("div", bar, style="flex:none;width:12em", aria_hidden="true"),
        element("span", f"{100 * share:.0f} %", style="flex:none;width:3.5em;text-align:right"),
        style="display:flex;align-items:center",
    )


def page(title: str, *content: object) -> str:
    """Return a complete document."""
    head = join(
        (
            element("meta", charset="utf-8"),
            element("meta", name_="viewport", content="width=device-width"),
            element("title", title),
            element("style", Markup(_STYLE)),
        )
    )
    body = element("body", element("main", *content))
    return f'<!doctype html><html lang="en">{head}{body}</html>\n'
