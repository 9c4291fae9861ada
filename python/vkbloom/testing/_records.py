"""Records of checks for the summary and the report: plain values that processes can exchange."""

from __future__ import annotations

from typing import TypedDict

__all__ = ["Figures", "Record"]


class Figures(TypedDict):
    """Figures of one framebuffer; None if a figure could not be computed."""

    name: str
    outcome: str  # "equal", "within" or "failed"
    failed_at: str | None
    reasons: list[str]
    cause: str | None  # of the difference, in words
    shape: list[int] | None
    dtype: str | None
    atol: float
    rtol: float
    max_error: float | None
    max_error_at: list[int] | None  # x, y, channel
    expected_there: float | None
    actual_there: float | None
    mean_error: float | None
    percent_over: float | None
    ssim: float | None
    flip: float | None


class Record(TypedDict):
    """One check."""

    test: str
    name: str
    folder: str  # of the references
    has_files: bool  # not where a test gave what it expects
    outcome: str  # "passed", "failed", "missing" or "written"
    origin: str
    reference_origin: str | None
    first_failure: str | None
    message: str | None
    framebuffers: list[Figures]
    part: str | None  # file with the pictures, in the folder of parts
