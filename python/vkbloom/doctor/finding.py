"""The result of one check."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Status = Literal["ok", "note", "problem"]


@dataclass(frozen=True)
class Finding:
    """The result of one check.

    - `topic`: What was checked, in one or two words.
    - `status`: "ok": correct; "note": information, nothing is broken; "problem": must be repaired.
    - `found`: What was found, and what it means.
    - `advice`: What to do; "" if nothing has to be done.
    """

    topic: str
    status: Status
    found: str
    advice: str = ""
