"""ducc0: Fourier transforms in 32-bit floats, which SciPy is about to use."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers import ImageBloom, round_to
from benchmarks.peers.scipy import glow_of


def convolution(
    kernel: NDArray[np.float32], padded: tuple[int, int], threshold: float, threads: int
) -> dict[str, ImageBloom]:
    """Return blooms of RGB images by Fourier transforms of so many `threads`.

    The kernel (3, h, w) has its centre at [0, 0], and the padded size. Buffers are kept.
    """
    fft = importlib.import_module("ducc0").fft
    spectrum = fft.r2c(kernel, axes=(1, 2), nthreads=threads)
    planes = np.zeros((3, *padded), np.float32)
    spectra = np.empty_like(spectrum)

    def bloom(picture: NDArray[Any]) -> NDArray[Any]:
        single, glow = glow_of(picture, threshold)
        height, width = picture.shape[:2]
        planes[...] = 0
        planes[:, :height, :width] = glow.transpose(2, 0, 1)
        fft.r2c(planes, axes=(1, 2), nthreads=threads, out=spectra)
        np.multiply(spectra, spectrum, out=spectra)
        fft.c2r(
            spectra,
            axes=(1, 2),
            lastsize=padded[1],
            forward=False,
            inorm=2,
            nthreads=threads,
            out=planes,
            allow_overwriting_input=True,
        )
        result = single + planes[:, :height, :width].transpose(1, 2, 0)
        return round_to(result, picture.dtype)

    return {"ducc0's transforms": bloom}
