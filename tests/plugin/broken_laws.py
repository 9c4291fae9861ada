"""What the tests of laws expect of an assertion that fails."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest


def fails(assertion: Callable[..., None], *arguments: Any, **options: Any) -> str:
    """Check the parts of a message (figure, position and law), and return it."""
    with pytest.raises(AssertionError) as caught:
        assertion(*arguments, **options)
    message = str(caught.value)
    first, law = message.split("\n  law: ")
    assert "allowed" in first
    assert law
    return message
