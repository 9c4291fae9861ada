"""Renderers with one set of variants."""

from __future__ import annotations

import pytest

from tests.conftest import SANITIZED
from vkbloom import Renderer

VARIANTS = ("fragment", "cpu", "gpu")


def open_variant(
    variant: str, adapter: str = "auto", *, validation: bool = not SANITIZED
) -> Renderer:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("VKBLOOM_VARIANT", variant)
        return Renderer(adapter, validation=validation)
