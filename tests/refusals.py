"""Tables of calls that are refused, and of what their errors say.

A line of a table is ``call -> error``; of a long call, the error stands on the next line. The error
is the whole of it, such as ``ValueError: knee: 2 is out of range``; three dots stand for any text.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest


def rows(test: str, heading: str) -> list[Any]:
    """Return the parameters of a test: the calls under a heading of ``refused.txt`` beside it."""
    text = Path(test).with_name("refused.txt").read_text(encoding="utf-8")
    (table,) = re.findall(rf"^# {heading}\n(.*?)(?=^# |\Z)", text, re.MULTILINE | re.DOTALL)
    lines = re.sub(r"\n\s+->", " ->", table).splitlines()
    pairs = (line.partition(" -> ") for line in lines if line)
    return [pytest.param(call.strip(), error, id=call.strip()) for call, _, error in pairs]


def assert_refused(call: str, error: str, names: Mapping[str, Any]) -> str:
    """Check that a call raises an error with this type and text, and return the text."""
    with pytest.raises(Exception) as caught:  # noqa: PT011  the type is part of the text
        eval(call, {**names})
    raised = caught.value
    # The text of a KeyError is its message as a literal.
    text = raised.args[0] if isinstance(raised, KeyError) else raised
    assert_matches(f"{type(raised).__name__}: {text}", error)
    return str(text)


def assert_matches(found: str, error: str) -> None:
    """Check that a text is the one of a table."""
    pattern = ".*".join(map(re.escape, error.split("...")))
    assert re.fullmatch(pattern, found, re.DOTALL), found
