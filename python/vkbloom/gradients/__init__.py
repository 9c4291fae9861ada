"""Derivatives of what a renderer returns."""

from __future__ import annotations

from vkbloom.gradients.passes import on_device
from vkbloom.gradients.pulling import Pullback, checked_inputs, pullback_of, vjp

__all__ = ["Pullback", "checked_inputs", "on_device", "pullback_of", "vjp"]
