"""Benchmarks of vkbloom beside its peers: what ``make bench`` runs.

Nothing here is needed to make bloom, and nothing of the peers is needed to run it: a peer that is
not installed is listed as missing.
"""

from __future__ import annotations

from benchmarks.catalogue import BENCHMARKS, run
from benchmarks.plan import Plan
from benchmarks.results import Report
from benchmarks.writing import write

__all__ = ["BENCHMARKS", "Plan", "Report", "run", "write"]
