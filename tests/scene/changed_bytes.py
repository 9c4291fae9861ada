"""Files with some bytes changed."""

from __future__ import annotations

from hypothesis import HealthCheck, settings, strategies

from tests.exhaustive import examples

#: Up to four changes: the place, modulo a number of bytes, and the new byte.
CHANGES = strategies.lists(
    strategies.tuples(strategies.integers(0), strategies.integers(0, 255)), min_size=1, max_size=4
)
#: Files are small, so there can be many examples.
many = settings(
    max_examples=examples(250),
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
