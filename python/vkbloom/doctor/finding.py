"""What the doctor says about one thing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Status = Literal["ok", "note", "problem"]


@dataclass(frozen=True)
class Finding:
    """What the doctor says about one thing.

    Attributes
    ----------
    topic : str
        What was looked at, in a word or two.
    status : {"ok", "note", "problem"}
        "ok": as it should be; "note": worth knowing, nothing is broken; "problem": to be repaired.
    found : str
        What is there, and what it means.
    advice : str
        What to do about it; "" where there is nothing to do.
    """

    topic: str
    status: Status
    found: str
    advice: str = ""
