"""Derivatives of what a renderer returns."""

from __future__ import annotations

from vkbloom.gradients.pulling import Pullback, vjp

__all__ = ["Pullback", "vjp"]
