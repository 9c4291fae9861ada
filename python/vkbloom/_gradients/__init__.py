"""Derivatives of what a renderer returns."""

from __future__ import annotations

from vkbloom._gradients.deglare import deglare
from vkbloom._gradients.passes import on_device
from vkbloom._gradients.pulling import Pullback, pull_each, pullback_of, vjp

__all__ = ["Pullback", "deglare", "on_device", "pull_each", "pullback_of", "vjp"]
