"""The result of one check."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Status = Literal["ok", "note", "problem"]


@dataclass(frozen=True)
class Finding:
    """The result of one check.

    Attributes
    ----------
    topic : str
        What was checked, in one or two words.
    status : {"ok", "note", "problem"}
        "ok": correct; "note": information, nothing is broken; "problem": must be repaired.
    found : str
        What was found, and what it means.
    advice : str
        What to do; "" if nothing has to be done.
    """

    topic: str
    status: Status
    found: str
    advice: str = ""
