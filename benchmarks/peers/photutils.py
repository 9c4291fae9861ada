"""photutils: a gridded model of a point spread, which each pixel is a source of."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers import ImageBloom


def field(
    kernels: NDArray[np.float64], xs: NDArray[np.float64], ys: NDArray[np.float64]
) -> dict[str, ImageBloom]:
    """Return the spread of RGB images by kernels (gy, gx, h, w) at these pixels."""
    psf, datasets, nddata, table = (
        importlib.import_module(name)
        for name in ("photutils.psf", "photutils.datasets", "astropy.nddata", "astropy.table")
    )
    rows, columns, *shape = kernels.shape
    data = nddata.NDData(
        kernels.reshape(rows * columns, *shape),
        meta={"grid_xypos": [(x, y) for y in ys for x in xs], "oversampling": 1},
    )
    model = psf.GriddedPSFModel(data)

    def bloom(picture: NDArray[Any]) -> NDArray[Any]:
        height, width = picture.shape[:2]
        y, x = np.mgrid[:height, :width]
        made = [
            datasets.make_model_image(
                (height, width),
                model,
                table.Table({"x_0": x.ravel(), "y_0": y.ravel(), "flux": plane.ravel()}),
                model_shape=tuple(shape),
            )
            for plane in picture.astype(np.float64).transpose(2, 0, 1)
        ]
        return np.stack(made, axis=-1).astype(np.float32)

    return {"photutils": bloom}
