"""Unreal Engine's standard bloom: the convolution with a sum of Gaussians."""

from ._convolution import gain, passes

__all__ = ["gain", "passes"]
