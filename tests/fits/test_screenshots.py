"""Fits of two 8-bit screenshots: the settings of a bloom, or that there is none.

The pairs are those of ``tools/tables/screenshots.py``, whose table is in ``docs/fits.md``.
"""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import pytest

from tests.exhaustive import some
from vkbloom import Renderer

pytest.importorskip("skimage.data")
pytest.importorskip("PIL.Image")
_FILE = Path(__file__).parents[2] / "tools" / "tables" / "screenshots.py"
_SPEC = importlib.util.spec_from_file_location("screenshots", _FILE)
assert _SPEC is not None
assert _SPEC.loader is not None
pairs: Any = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(pairs)


@pytest.mark.parametrize("bloom", some(pairs.BLOOMS, 2), ids=lambda one: "-".join(one[:2]))
def test_settings_are_found_or_the_verdict_is_poor(renderer: Renderer, bloom: Any) -> None:
    image, target = pairs.with_bloom(renderer, bloom)
    assert (target == 255).any(axis=2).mean() <= 0.05
    found = pairs.fitted(renderer, (image, target), bloom.preset)
    values = {name: getattr(found.settings, name) for name in ("threshold", "intensity")}
    known = {"threshold": bloom.threshold, "intensity": bloom.intensity}
    assert found.verdict == "poor" or values == pytest.approx(known, rel=0.1), found


@pytest.mark.parametrize("preset", some(["unity_urp", "bevy_natural"], 1))
@pytest.mark.parametrize("other", some(pairs.OTHERS, 3), ids="-".join)
def test_no_bloom_is_found(renderer: Renderer, other: tuple[str, str], preset: str) -> None:
    found = pairs.fitted(renderer, pairs.without_bloom(*other), preset, max_calls=100)
    assert found.verdict == "poor"
    assert found.cause.startswith("no bloom was found"), found.cause
