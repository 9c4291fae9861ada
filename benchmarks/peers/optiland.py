"""optiland's simulator of images: a mean kernel, and others with maps of weights."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers import ImageBloom


def field(kernels: NDArray[np.float64], weights: NDArray[np.float64]) -> dict[str, ImageBloom]:
    """Return the convolution of RGB images with kernels (K, h, w) of such weights (K, H, W).

    The weights have a sum of 1, so that the first kernel can be the mean one.
    """
    module = importlib.import_module("optiland.analysis.image_simulation.simulator")
    simulator = module.SpatiallyVariableSimulator()
    others = kernels[1:] - kernels[0]

    def bloom(picture: NDArray[Any]) -> NDArray[Any]:
        planes = picture.transpose(2, 0, 1).astype(np.float64)
        made = simulator.simulate(planes, others, weights[1:], kernels[0])
        return np.asarray(made, np.float32).transpose(1, 2, 0)

    return {"optiland": bloom}
