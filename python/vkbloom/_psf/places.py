"""Places in a picture: field coordinates, and shares of the nodes of a grid."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from vkbloom._psf.base import Array

Size = tuple[int, int]


def field_of(x: float, y: float, frame: Size) -> tuple[float, float]:
    """Return u and v of a pixel: from the centre, with a radius of 1 in the corners."""
    width, height = frame
    radius = math.hypot(width, height) / 2
    return (x - (width - 1) / 2) / radius, (y - (height - 1) / 2) / radius


def hat_weights(nodes: Array, places: Any) -> Array:
    """Return the shares of nodes at places, linear between them and constant outside."""
    at = np.asarray(places, np.float64)
    weights = np.zeros((len(at), len(nodes)))
    if len(nodes) == 1:
        weights[:] = 1
        return weights
    inside = np.clip(at, nodes[0], nodes[-1])
    lower = np.clip(np.searchsorted(nodes, inside, side="right") - 1, 0, len(nodes) - 2)
    part = (inside - nodes[lower]) / (nodes[lower + 1] - nodes[lower])
    lines = np.arange(len(at))
    weights[lines, lower] = 1 - part
    weights[lines, lower + 1] = part
    return weights


def pixel_places(frame: Size, buffers: Size) -> list[Array]:
    """Return the x of the columns and the y of the rows of buffers, in pixels of the frame."""
    return [
        (np.arange(own) + 0.5) * side / own - 0.5 for side, own in zip(frame, buffers, strict=True)
    ]
