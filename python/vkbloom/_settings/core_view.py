"""Settings as the core reads them, where an engine's parameters have other units or names."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vkbloom._settings.settings import Settings

__all__ = ["core_view", "linear"]


def core_view(settings: Settings, **values: Any) -> SimpleNamespace:
    """Return the fields of settings, some of them replaced."""
    fields = {name: getattr(settings, name) for name in type(settings).__dataclass_fields__}
    return SimpleNamespace(**(fields | {"method": settings.method} | values))


def linear(value: float) -> float:
    """Return the light of a value in sRGB; above 1 it is a power of 2.2, as Unity converts it."""
    if value > 1:
        return float(value**2.2)
    return value / 12.92 if value <= 0.04045 else float(((value + 0.055) / 1.055) ** 2.4)
