"""Files with some bytes changed."""

from __future__ import annotations

from hypothesis import HealthCheck, settings, strategies

#: Up to four changes: the place, modulo a number of bytes, and the new byte.
CHANGES = strategies.lists(
    strategies.tuples(strategies.integers(0), strategies.integers(0, 255)), min_size=1, max_size=4
)
#: Files are small, so there can be many examples.
many = settings(
    max_examples=1000,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
