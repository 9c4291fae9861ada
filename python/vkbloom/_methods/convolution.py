"""Bloom by convolution with a point-spread function."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Literal, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vkbloom._core_kernel import CoreKernel
from vkbloom._psf.base import PSF, in_grey
from vkbloom._psf.components import facts_of
from vkbloom._psf.core_fields import core_field
from vkbloom._psf.core_kernels import WithKernel, with_reach
from vkbloom._psf.eye import spencer
from vkbloom._psf.resampling import box_resample
from vkbloom._psf.sampled import samples
from vkbloom._psf.varying import Varying
from vkbloom._public import public
from vkbloom._settings.fields import choice_field, number_field
from vkbloom._settings.settings import Settings

Size = tuple[int, int]
Boundary = Literal["zero", "edge", "wrap", "wrap_x"]
#: The types of a kernel: a function, the result of its `to_dict`, or an array.
PSFLike = PSF | Mapping[str, Any] | ArrayLike


def read_psf(psf: Any) -> PSF:
    """Return a point-spread function, also of a stored one or an array."""
    if isinstance(psf, PSF):
        return psf
    if isinstance(psf, Mapping):
        return PSF.from_dict(psf)
    if isinstance(psf, str):
        raise TypeError(
            f"psf: {psf!r} is not a function or an array; call one of vkbloom.psf, such as "
            "vkbloom.psf.spencer()"
        )
    try:
        return samples(psf)
    except (TypeError, ValueError) as error:
        raise type(error)(str(error).replace("values:", "psf:", 1)) from None


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class Convolution(WithKernel, Settings):
    """A convolution with a point-spread function, by Fourier transforms.

    Parameters
    ----------
    psf : PSF, or array-like, shape (h, w) or (h, w, 3)
        The point-spread function; by default `vkbloom.psf.spencer`. An array is copied to float32
        and becomes a `vkbloom.psf.samples`. Its point is at [h // 2, w // 2]. A
        `vkbloom.psf.Varying` spreads each pixel by the kernel of its own place.
    normalize : bool
        Whether each channel of the kernel is divided by its sum. The kernels of a
        `vkbloom.psf.Varying` are taken as they are.
    boundary : {"zero", "edge", "wrap", "wrap_x"}
        The texels outside of the bloom buffers. "zero": black. "edge": the nearest texel. "wrap":
        the buffers are repeated. "wrap_x": repeated along x and "edge" along y, for panoramas.
    pixels_per_degree : float or None
        Scale of functions whose unit is "degree". None: the frame's longer side spans 50 degrees.
    kernel_size : (int, int) or None
        Width and height of the kernel in pixels of ``final``. None: the size of an array;
        otherwise (2 W - 1, 2 H - 1) for a frame of W x H, so that the light of every pixel reaches
        every other pixel.
    **settings
        The fields of `Settings`.

    Notes
    -----
    bloom[y, x] = sum over j, i of K[j, i] glow[y - (j - h // 2), x - (i - w // 2)]. The framebuffer
    ``kernel`` is K in pixels of the bloom buffers. If these have another size than the frame, K is
    resampled by area. The computation uses single floats for every format of the bloom buffers.
    Values are limited to -1e28..1e28.
    """

    method: ClassVar[str] = "convolution"
    # Its width is that of the function.
    _knobs: ClassVar[tuple[str, ...]] = ()
    _pass_sentences: ClassVar[Mapping[str, str]] = MappingProxyType(
        {"bloom": "multiplies by the kernel's frequencies and transforms back to pixels"}
    )
    shaping: ClassVar[tuple[str, ...]] = ("psf", "normalize", "pixels_per_degree", "kernel_size")

    psf: PSFLike = dataclasses.field(
        default=spencer(), kw_only=False, metadata={"kind": "psf", "read": read_psf}
    )
    normalize: bool = True
    boundary: Boundary = choice_field(("zero", "edge", "wrap", "wrap_x"))
    pixels_per_degree: float | None = number_field(
        default=None, range=(0, math.inf), differentiable=False
    )
    kernel_size: tuple[int, int] | None = None

    @property
    def prefilter(self) -> tuple[float, float, float]:
        """min, max and mult of the prefilter of `vkbloom.psf.unreal`.

        Before the convolution, a luminance L above min becomes min(mult (L - min) + min, max).
        There is no prefilter if min is above max.
        """
        return cast("tuple[float, float, float]", getattr(self.psf, "prefilter", super().prefilter))

    def kernel(
        self, frame: tuple[int, int], buffers: tuple[int, int] | None = None
    ) -> NDArray[np.float64]:
        """Return the kernel for a frame.

        Parameters
        ----------
        frame : (int, int)
            Width and height of ``final``.
        buffers : (int, int), optional
            Width and height of the bloom buffers. Default: the frame's.

        Returns
        -------
        ndarray of float64, shape (h, w, 3)
            The kernel in pixels of the bloom buffers. Of a `vkbloom.psf.Varying` the kernels of its
            grid, shape (gy, gx, h, w, 3).

        Raises
        ------
        ValueError
            The `vkbloom.psf.Varying` has a function or lateral colour: a kernel for each pixel.
        """
        if isinstance(self.psf, Varying):
            return self._grid_kernels(self.psf, frame, buffers or frame)
        return self._kernel(frame, buffers or frame)

    def _grid_kernels(self, psf: Varying, frame: Size, buffers: Size) -> NDArray[np.float64]:
        if not psf.has_grid:
            raise ValueError(
                "psf: with a function or lateral colour each pixel has a kernel of its own; use "
                "psf.at(x, y, frame)"
            )
        kernels = psf.grid_kernels(frame)
        grid = in_grey(kernels) if kernels.ndim == 4 else kernels
        return np.array([[_for_buffers(kernel, frame, buffers) for kernel in row] for row in grid])

    def _facts(self, frame: Size) -> dict[str, float]:
        if not isinstance(self.psf, Varying) or not self.bloom:
            return {}
        count, error = facts_of(self.psf, frame)
        return {"psf_kernels": count, "psf_error": error}

    @property
    def _is_transform(self) -> bool:
        return True

    def core_kernel_size(self, frame: tuple[int, int], buffers: tuple[int, int]) -> tuple[int, int]:
        """Return estimates of the kernel's width and height, without the kernel."""
        if isinstance(self.psf, Varying):
            sides = self.psf.kernel_size
        else:
            sides = self.kernel_size or cast("PSF", self.psf).default_size(frame)
        width, height = (
            max(side * to // of, 1) for side, to, of in zip(sides, buffers, frame, strict=True)
        )
        return width, height

    def _with_reach(self, kernel: CoreKernel) -> CoreKernel:
        # Those of a field are below each other.
        return kernel if isinstance(self.psf, Varying) else with_reach(kernel)

    def core_field(self, frame: Size, buffers: Size) -> tuple[Any, ...] | None:
        """Return the weights of a field of kernels as the core reads them; None: there is none."""
        return core_field(self.psf, frame, buffers) if isinstance(self.psf, Varying) else None

    def _component_kernels(self, frame: Size, buffers: Size) -> list[NDArray[np.float64]]:
        """Return the kernels (h, w, 3) of a field that have weights, for the bloom buffers."""
        kernels = cast("Varying", self.psf).components(frame).kernels
        each = in_grey(kernels) if kernels.ndim == 3 else kernels
        return [_for_buffers(kernel, frame, buffers) for kernel in each]

    def _kernel(self, frame: tuple[int, int], buffers: tuple[int, int]) -> NDArray[np.float64]:
        psf = cast("PSF", self.psf)
        if isinstance(psf, Varying):
            # Below each other, as the core reads them.
            return np.concatenate(self._component_kernels(frame, buffers))
        kernel = psf.kernel(frame, self.kernel_size, self.pixels_per_degree)
        kernel = _for_buffers(kernel, frame, buffers)
        if self.normalize:
            sums = kernel.sum(axis=(0, 1))
            for name, total in zip(("red", "green", "blue"), sums, strict=True):
                if not total > 0:
                    raise ValueError(
                        f"psf: the sum of its {name} is {total:g}, not above 0; use normalize=False"
                    )
            kernel = kernel / sums
        return kernel


def _for_buffers(kernel: NDArray[np.float64], frame: Size, buffers: Size) -> NDArray[np.float64]:
    """Return a kernel (h, w, 3) of the frame's pixels for those of the bloom buffers."""
    if buffers == frame:
        return kernel
    scale = buffers[1] / frame[1], buffers[0] / frame[0]
    return box_resample(kernel, (kernel.shape[0] // 2, kernel.shape[1] // 2), scale)
