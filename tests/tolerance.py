"""The allowed differences of a renderer's framebuffers from those of `vkbloom.reference`.

The limits are those of ``vkbloom doctor --self-test``.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vkbloom import Frames, Settings, _core
from vkbloom._doctor.deviations import Limit, deviation, deviations, real, tolerance

__all__ = ["assert_close", "assert_matches_reference", "colours", "real", "tolerance"]


def colours(array: NDArray[Any]) -> NDArray[np.float64]:
    """Return the colours of a framebuffer in real units, without alpha."""
    return real(array[..., :3])


def assert_close(
    name: str, array: NDArray[Any], expected: NDArray[np.float64], limit: Limit
) -> None:
    """Compare in real units; NaN and infinity must be the same in the same places."""
    wrong = deviation(name, array, expected, limit).wrong
    assert not wrong, wrong


def assert_matches_reference(
    frames: Frames,
    image: NDArray[Any],
    settings: Settings,
    *,
    mask: NDArray[Any] | None = None,
    emission: NDArray[Any] | None = None,
) -> None:
    """Compare all framebuffers: names in their order, shapes, dtypes, alpha, values, memory.

    Under sanitizers, of the core, the memory alone: the reference is Python, and would take a
    seventh of the time of test_matrix.py.
    """
    given = {"mask": mask, "emission": emission}
    sanitized = "VKBLOOM_SANITIZED" in os.environ
    for found in () if sanitized else deviations(frames, image, settings, **given):
        assert not found.wrong, found.wrong
    for name, array in frames.items():
        assert array.flags.c_contiguous, f"{name}: not contiguous"
        is_own = array.flags.owndata or isinstance(array.base, _core.Pages)
        assert is_own, f"{name}: does not own its memory"
