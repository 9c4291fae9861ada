"""Benchmarks of vkbloom beside its peers: what ``vkbloom bench`` and ``make bench`` run.

Nothing here is needed to make bloom, and nothing of the peers is needed to run it: a peer that is
not installed is listed as missing.
"""

from __future__ import annotations

from vkbloom.bench.catalogue import BENCHMARKS, run
from vkbloom.bench.plan import Plan
from vkbloom.bench.results import Report
from vkbloom.bench.writing import write

__all__ = ["BENCHMARKS", "Plan", "Report", "run", "write"]
