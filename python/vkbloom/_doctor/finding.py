"""The result of one check, and of all."""

from __future__ import annotations

from typing import NamedTuple


class Finding(NamedTuple):
    """The result of one check.

    - `topic`: What was checked, in one or two words.
    - `status`: "ok": correct; "note": information, nothing is broken; "problem": must be repaired.
    - `found`: What was found, and what it means.
    - `advice`: What to do; "" if nothing has to be done.
    """

    topic: str
    status: str
    found: str
    advice: str = ""


class Report(NamedTuple):
    """The findings of one examination; at least one adapter rendered correctly if `can_render`."""

    findings: tuple[Finding, ...]
    can_render: bool
