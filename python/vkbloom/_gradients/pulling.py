"""The framebuffers of an image, and the function that takes cotangents back."""

from __future__ import annotations

import functools
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from vkbloom._argument_types import check_arguments
from vkbloom._gradients.passes import (
    MIN_SHARE,
    WEIGHTS,
    DeviceGradients,
    Passes,
    Running,
    check_finite,
    in_floats,
)
from vkbloom._gradients.sums import device_fields
from vkbloom._public import public
from vkbloom._renderer.default import default_renderer
from vkbloom._renderer.device_arrays import (
    Device,
    ImportedArray,
    on_cuda,
    on_host,
    place,
    place_of,
    take,
)
from vkbloom._renderer.frames import Frames
from vkbloom._renderer.image import Image
from vkbloom._renderer.renderer import DerivativeKind, Renderer
from vkbloom._renderer.requests import IMAGES_AHEAD
from vkbloom._renderer.sources import Inputs, check_inputs, image_source, uploaded_inputs
from vkbloom._settings.settings import Settings, check_settings
from vkbloom.reference import vjp as reference_vjp
from vkbloom.reference._derivatives import Gradients, check_cotangents, check_shape, differentiable

if TYPE_CHECKING:
    from vkbloom._renderer.device_arrays import Destination

Derivatives = Mapping[str, NDArray[Any]]
#: From cotangents by framebuffer to derivatives by name.
Pullback = Callable[[Mapping[str, NDArray[Any]]], Derivatives]
#: Cotangents as `Passes` has them.
Checked = Mapping[str, NDArray[Any] | ImportedArray]


@public("vkbloom")
@check_arguments
def vjp(
    image: NDArray[Any] | Image,
    settings: Settings | str | None = None,
    *,
    mask: NDArray[Any] | None = None,
    emission: NDArray[Any] | None = None,
    device: Device | None = None,
    renderer: Renderer | None = None,
) -> tuple[Frames, Pullback]:
    """Add bloom to an image, and return a function for the derivatives of a sum over it.

    Parameters
    ----------
    image, settings, mask, emission
        As for `vkbloom.apply`. The bloom buffers are "rgba32float", whatever `format` says.
    device : {"host", "device"}, optional
        As for `apply`. The derivatives by image, mask and emission go where the framebuffers
        go.
    renderer : Renderer, optional
        Default: `default_renderer`.

    Returns
    -------
    frames : Frames
        As of `apply`.
    pullback : callable
        ``pullback(cotangents)`` takes arrays by framebuffer, of their shapes. They may be on
        the GPU, as an image. With S the sum over all of them of (framebuffer . cotangent), it
        returns the derivatives of S as float32: by "image", "mask" (H, W) and "emission" if
        they were given, by "kernel" (of `Convolution`), and by each real field under its name,
        such as "intensity", "glare.0.intensity" or "psf.weights". Those by fields and kernel
        are arrays of NumPy. Those of a uint8 image are by value / 255. At NaN and infinity of
        the image they are 0.

    Raises
    ------
    ValueError, TypeError
        As for `apply`; the image is an `Image`; or the method was loaded from a file of passes,
        which has no derivative. From `pullback`: there is no such framebuffer, or a cotangent
        has another shape or dtype, or is not finite. Its result raises ValueError for names
        that have no derivative, such as "levels".

    Examples
    --------
    >>> image = np.full((4, 4, 3), 0.5, np.float32)
    >>> frames, pullback = vkbloom.vjp(image, vkbloom.Pyramid(levels=1, intensity=0.5))
    >>> gradients = pullback({"final": np.ones_like(image)})
    >>> float(gradients["intensity"])  # the sum of the bloom
    24.0
    >>> float(gradients["image"].sum()) / image.size  # the image and half of the bloom
    1.5
    """
    settings = check_settings(settings, of_image=True)
    renderer = renderer or default_renderer()
    renderer._pending.wait()
    if hasattr(settings, "numpy_reference"):
        raise ValueError(
            f"method: {settings.method!r} has no derivative, since its passes come from a file"
        )
    core = renderer._core
    uploaded: Image
    if isinstance(image, Image):
        image_source(image, mask, emission)
        # A pass without bloom copies the pixels.
        alone = check_settings(None).replace(bloom=False)
        inputs = uploaded_inputs(
            image,
            lambda: renderer.apply(image, alone, framebuffers="final", device="host")["final"],
        )
        uploaded = image
    else:
        inputs = check_inputs(image, mask, emission, core).freeze()
        source = inputs.source()
        shape, dtype = source.kind
        uploaded = Image(source, shape, np.dtype(dtype))
    floats = in_floats(settings)
    frames = renderer.apply(uploaded, floats, device=device)
    shapes = {name: Shape(part.shape) for name, part in frames.items()}
    destination = place_of(next(iter(frames.values())))
    return frames, ImagePullback(inputs, settings, shapes, renderer, destination)


class Shape(NamedTuple):
    """The shape of a framebuffer."""

    shape: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class ImagePullback:
    """The pullback of `vjp`, which never changes.

    One that was pickled runs on the default renderer of its process.
    """

    inputs: Inputs
    settings: Settings
    frames: Mapping[str, Shape]
    renderer: Renderer | None = None
    destination: Destination = "host"

    def __call__(self, cotangents: Mapping[str, NDArray[Any]]) -> Derivatives:
        return self._pull(_check(cotangents, self.frames, self._renderer._core))

    @functools.cached_property
    def _renderer(self) -> Renderer:
        return self.renderer or default_renderer()

    @functools.cached_property
    def _pull(self) -> Callable[[Checked], Derivatives]:
        return pullback_of(self._renderer, self.inputs, self.settings, self.destination)

    def __reduce__(self) -> tuple[Any, ...]:
        return ImagePullback, (Inputs(**self.inputs.on_host()), self.settings, self.frames)

    def __copy__(self) -> ImagePullback:
        return self

    def __deepcopy__(self, memo: object) -> ImagePullback:
        return self


def _check(cotangents: Any, frames: Mapping[str, Any], core: Any) -> Checked:
    """Check cotangents, and copy those that are on the renderer's device.

    Whether these are finite is known when the passes have run.
    """
    if not isinstance(cotangents, Mapping):
        return check_cotangents(cotangents, frames)
    result: dict[str, NDArray[Any] | ImportedArray] = {}
    for name, given in cotangents.items():
        part = take(given, f"cotangents[{name!r}]", core) if on_cuda(given) else given
        if isinstance(part, ImportedArray) and part.dtype != "uint8":
            check_shape(name, part.shape, frames)
            result[name] = part
        else:
            # Levels of bytes would be read as shares of 255.
            result |= check_cotangents({name: on_host(part)}, frames)
    return result


def pullback_of(
    renderer: Renderer, inputs: Inputs, settings: Settings, destination: Destination = "host"
) -> Callable[[Checked], Derivatives]:
    """Return the pullback alone, of arrays that do not change, and checked cotangents."""
    adjoint = _Adjoint(renderer, inputs, settings, destination)

    def pull(cotangents: Checked) -> Derivatives:
        running = adjoint.passes(cotangents).submit()
        if running is None:
            check_finite(cotangents)
        else:
            running.check()
        return adjoint.derivatives(cotangents, running)

    return pull


def pull_each(
    renderer: Renderer,
    settings: Settings,
    sequence: Iterable[tuple[Inputs, Checked]],
    fields: Collection[str],
    destination: Destination = "host",
    *,
    images: bool = True,
    sums_destination: Destination = "host",
) -> Iterator[Derivatives]:
    """Yield the derivatives of each image. The device works on later ones meanwhile.

    Without `images`, those by images are not computed unless they are read.

    The host waits for those on a GPU only where it reads one by `fields`. So cotangents may be NaN
    and infinite, and so are the derivatives then. A sum by a field has the accuracy of single
    floats relative to the root of the sum of its squares: near the end of a training most of it
    cancels, and the reference would take 20 to 100 times as long for a step.
    """
    has_sums = not device_fields(settings).isdisjoint(fields)
    kind: DerivativeKind = "all" if has_sums else "images"
    if not images:
        kind = "sums" if has_sums else "weights"
    started: deque[Callable[[], Derivatives]] = deque()
    for inputs, cotangents in sequence:
        adjoint = _Adjoint(renderer, inputs, settings, destination, sums_destination, 0.0)
        running = adjoint.passes(cotangents).submit(kind, fields if has_sums else None)
        started.append(functools.partial(adjoint.derivatives, cotangents, running))
        if len(started) == IMAGES_AHEAD:
            yield started.popleft()()
    while started:
        yield started.popleft()()


@dataclass(frozen=True, eq=False)
class _Adjoint:
    """The adjoint of an image's bloom. Its arrays do not change."""

    renderer: Renderer
    inputs: Inputs
    settings: Settings
    destination: Destination
    sums_destination: Destination = "host"
    min_share: float = MIN_SHARE

    def passes(self, cotangents: Checked) -> Passes:
        """Return the passes that take cotangents back."""
        floats = in_floats(self.settings)
        places = self.destination, self.sums_destination
        return Passes(self.renderer, self.inputs, floats, cotangents, *places)

    def derivatives(self, cotangents: Checked, running: Running | None) -> Derivatives:
        """Return the derivatives of passes; None: those of the reference."""
        if running is None:
            made = self._by_reference(cotangents)
            return _place(made, self.inputs, self.destination, self.renderer)
        names = (*self.inputs.by_name(), *_names(self.settings))
        return DeviceGradients(
            running.images(),
            names,
            ({WEIGHTS}, running.weights),
            (device_fields(self.settings), functools.partial(running.sums, self.min_share)),
            (names, functools.partial(self._by_reference, cotangents)),
            sums_for=running.sums_for if self.sums_destination == "cuda" else None,
        )

    @functools.cached_property
    def _recorded(self) -> Callable[[Mapping[str, NDArray[Any]]], Gradients]:
        return reference_vjp(settings=self.settings, **self.inputs.on_host())[1]

    def _by_reference(self, cotangents: Checked) -> Gradients:
        arrays = {name: on_host(part) for name, part in cotangents.items()}
        if not all(np.isfinite(part).all() for part in arrays.values()):
            return undefined(self.inputs.by_name(), self.settings)
        derivatives = self._recorded(arrays)
        # A value beyond single floats becomes infinite, as on the device.
        with np.errstate(over="ignore"):
            return Gradients((name, part.astype(np.float32)) for name, part in derivatives.items())


def undefined(images: Mapping[str, Any], settings: Settings) -> Gradients:
    """Return the derivatives of cotangents that are not finite: NaN."""
    shapes = {name: part.shape for name, part in images.items()}
    shapes |= {name: np.shape(value) for name, value in differentiable(settings).items()}
    return Gradients((name, np.full(shape, np.nan, np.float32)) for name, shape in shapes.items())


@functools.lru_cache(16)
def _names(settings: Settings) -> tuple[str, ...]:
    """Return the names of the derivatives that are not by images."""
    # A field that is no grid has a kernel for each pixel.
    is_one = getattr(getattr(settings, "psf", None), "has_grid", True)
    has_kernel = settings.bloom and callable(getattr(settings, "kernel", None)) and is_one
    return (*differentiable(settings), *(("kernel",) if has_kernel else ()))


def _place(
    derivatives: Gradients, inputs: Inputs, destination: Destination, renderer: Renderer
) -> Gradients:
    """Move the derivatives by images to where those of the device would be."""
    core = renderer._core
    if not core.closed:
        for name in inputs.by_name():
            derivatives[name] = cast("NDArray[Any]", place(derivatives[name], destination, core))
    return derivatives
