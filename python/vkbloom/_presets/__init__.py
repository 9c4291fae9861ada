"""Settings and stages of glare by their published names."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vkbloom._settings.registry import NAMED_SETTINGS, NAMED_STAGES

if TYPE_CHECKING:
    from collections.abc import Mapping

    from vkbloom._presets.named_glares import NamedGlare
    from vkbloom._presets.named_settings import Preset


def _settings() -> Mapping[str, Preset]:
    from vkbloom._presets.named_settings import PRESETS  # noqa: PLC0415  costs start-up time

    return PRESETS


def _stages() -> Mapping[str, NamedGlare]:
    from vkbloom._presets.named_glares import GLARES  # noqa: PLC0415  costs start-up time

    return GLARES


NAMED_SETTINGS.fill(_settings)
NAMED_STAGES.fill(_stages)
