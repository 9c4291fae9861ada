"""The classes of methods and of stages of glare that users have, by name, and their fields."""

from __future__ import annotations

from typing import Any, Final

import vkbloom
from vkbloom import Glare, Settings
from vkbloom._settings.fields import fields_of

__all__ = ["METHODS", "STAGES", "fields_of"]


def _public(base: type[Any]) -> list[type[Any]]:
    every = (getattr(vkbloom, name) for name in vkbloom.__all__)
    return [kind for kind in every if isinstance(kind, type) and issubclass(kind, base)]


METHODS: Final[dict[str, type[Settings]]] = {
    kind.method: kind for kind in _public(Settings) if kind is not Settings
}
STAGES: Final[dict[str, type[Glare]]] = {
    kind.stage: kind for kind in _public(Glare) if kind is not Glare
}
