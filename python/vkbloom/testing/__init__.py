"""Tests of bloom: laws that every blur or bloom should obey, and comparisons with references.

The laws need no reference picture. `report` and `assert_laws` test any callable that maps an image
to an image. What measures one raises AssertionError if a result is not finite, and TypeError or
ValueError if the callable returns something else or an argument is out of range.
`FrameRegression` is the type of the pytest fixture `frame_regression`.
"""

from __future__ import annotations

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
