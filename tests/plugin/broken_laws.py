"""What the tests of laws expect of a law that is broken."""

from __future__ import annotations

from typing import Any

import pytest

from vkbloom import testing
from vkbloom.testing._probe import Bloom


def fails(bloom: Bloom, law: str, **options: Any) -> str:
    """Check the parts of a message (law, figure, position and reason), and return it."""
    with pytest.raises(AssertionError) as caught:
        testing.assert_laws(bloom, law, **options)
    message = str(caught.value)
    first, words = message.split("\n  law: ")
    assert first.startswith(f"{law}: ")
    assert "allowed" in first
    assert "\n  why: " in words
    return message
