"""The navigation beside the pages: those of a folder share one, in which each marks its own place.

Sphinx and Furo make it anew for each page. With hundreds of pages, of which each has an entry, that
took half of the time of a build.
"""

from __future__ import annotations

import re
from typing import Any

# By folder: as Sphinx makes it for a page that has no entry.
_trees: dict[str, str] = {}


def share(_app: Any, page: str, _template: str, context: dict[str, Any], _document: Any) -> None:
    """Give a page the tree of its folder. Furo knows those that it has changed."""
    make = context["toctree"]
    folder, _, file = page.rpartition("/")

    def toctree(**options: Any) -> str:
        if folder not in _trees:
            tree = make(**options).replace('href="#"', f'href="{file}.html"')
            tree = tree.replace('href="#', f'href="{file}.html#').replace(' class="current"', "")
            _trees[folder] = tree.replace('"current ', '"').replace(' current"', '"')
        return _trees[folder]

    context["toctree"] = toctree


def mark(tree: str, page: str) -> str:
    """Return Furo's tree of a folder with a page's own entry marked, and those above it open."""
    file = f"{page.rpartition('/')[2]}.html"
    own = f'class="reference internal" href="{file}"'
    place = tree.find(own)
    if place < 0:
        return tree
    above: list[re.Match[str]] = []
    for tag in re.finditer(r"<(/?)(?:li|ul)[^>]*>", tree[:place]):
        if tag[1]:
            above.pop()
        else:
            above.append(tag)
    tree = tree.replace(own, 'class="current reference internal" href="#"')
    # Sections of this page.
    tree = tree.replace(f'href="{file}#', 'href="#')
    for tag in reversed(above):
        start, rest = tag[0], tree[tag.end() :]
        if start == "<ul>":
            start = '<ul class="current">'
        else:
            start = re.sub(r"toctree-l\d+", r"\g<0> current", start)
            if "has-children" in start:
                box = 'class="toctree-checkbox"'
                rest = rest.replace(box, f'checked="" {box}', 1)
            if tag is above[-1]:
                start = start.replace('">', ' current-page">')
        tree = tree[: tag.start()] + start + rest
    return tree
