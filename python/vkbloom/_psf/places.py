"""Places in a picture: field coordinates, and shares of the nodes of a grid."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vkbloom._psf.base import Array

Size = tuple[int, int]


def field_of(x: float, y: float, frame: Size) -> tuple[float, float]:
    """Return u and v of a pixel: from the centre, with a radius of 1 in the corners."""
    width, height = frame
    radius = math.hypot(width, height) / 2
    return (x - (width - 1) / 2) / radius, (y - (height - 1) / 2) / radius


def spread_places(side: int, count: int) -> Array:
    """Return places from the first pixel of a side to the last one; one place is in the middle.

    Of a side of one pixel they are half a pixel before it to half a pixel behind it: nodes differ.
    """
    middle, reach = (side - 1) / 2, max(side - 1, 1) / 2 if count > 1 else 0.0
    return np.linspace(middle - reach, middle + reach, count)


def places_before(nodes: Array, places: Any) -> tuple[NDArray[np.intp], Array]:
    """Return the index of the node before each place, and the share of the next node.

    Places outside of the nodes are at the nearest one.
    """
    at = np.asarray(places, np.float64)
    if len(nodes) == 1:
        return np.zeros(len(at), np.intp), np.zeros(len(at))
    inside = np.clip(at, nodes[0], nodes[-1])
    lower = np.clip(np.searchsorted(nodes, inside, side="right") - 1, 0, len(nodes) - 2)
    return lower, (inside - nodes[lower]) / (nodes[lower + 1] - nodes[lower])


def hat_weights(nodes: Array, places: Any) -> Array:
    """Return the shares of nodes at places, linear between them and constant outside."""
    lower, part = places_before(nodes, places)
    weights = np.zeros((len(lower), len(nodes)))
    lines = np.arange(len(lower))
    weights[lines, lower] = 1 - part
    weights[lines, np.minimum(lower + 1, len(nodes) - 1)] += part
    return weights


def pixel_places(frame: Size, buffers: Size) -> list[Array]:
    """Return the x of the columns and the y of the rows of buffers, in pixels of the frame."""
    return [
        (np.arange(own) + 0.5) * side / own - 0.5 for side, own in zip(frame, buffers, strict=True)
    ]
