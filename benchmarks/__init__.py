"""Benchmarks of vkbloom beside other libraries (its peers): what ``make bench`` runs.

The installed package does not contain this code. No peer is required: a peer that is not installed
is listed as missing.
"""

from __future__ import annotations

from benchmarks.catalogue import BENCHMARKS, run
from benchmarks.plan import Plan
from benchmarks.results import Report
from benchmarks.writing import write

__all__ = ["BENCHMARKS", "Plan", "Report", "run", "write"]
