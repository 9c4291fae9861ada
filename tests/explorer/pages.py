"""What a page of the explorer asks: a viewer and its server, and what it shows of both.

Users have the page and the widget of a notebook, whose messages take a browser. Tests ask the
viewer itself where the page is not what they are about.
"""

from __future__ import annotations

import pytest

from vkbloom._explorer.controls import as_code, controls, describe, settings_from
from vkbloom._explorer.fast_pictures import picture_of
from vkbloom._explorer.playing import Chain, NotReached, open_clip
from vkbloom._explorer.stored import Pictures, StoredGrid, StoredSource, write_stored
from vkbloom._explorer.viewer import Viewer
from vkbloom._views.pictures import reduce

try:
    from vkbloom._explorer.server import Server
except ModuleNotFoundError as error:
    pytest.skip(f"the explorer: {error}; extra notebook", allow_module_level=True)

__all__ = [
    "Chain",
    "NotReached",
    "Pictures",
    "Server",
    "StoredGrid",
    "StoredSource",
    "Viewer",
    "as_code",
    "controls",
    "describe",
    "open_clip",
    "picture_of",
    "reduce",
    "settings_from",
    "write_stored",
]
