"""The framebuffers of an image, and the function that takes cotangents back."""

from __future__ import annotations

import functools
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from vkbloom.core_access import HasCore, core_of
from vkbloom.device_arrays import Taken, on_cuda, place_of, placed, take
from vkbloom.frames import Frames
from vkbloom.gradients.passes import DeviceGradients, Passes, check_finite
from vkbloom.image import Image
from vkbloom.methods.separable import Separable
from vkbloom.reference import vjp as reference_vjp
from vkbloom.reference.derivatives import (
    Gradients,
    check_cotangents,
    check_shape,
    differentiable,
)
from vkbloom.requests import IMAGES_AHEAD
from vkbloom.sources import Inputs, checked_inputs, image_source, uploaded_inputs

if TYPE_CHECKING:
    from vkbloom.device_arrays import Device, Place
    from vkbloom.settings import Settings

__all__ = ["Pullback", "pull_each", "pullback_of", "vjp"]

#: From cotangents by framebuffer to derivatives by name.
Pullback = Callable[[Mapping[str, NDArray[Any]]], Gradients]
#: Cotangents as `Passes` has them.
Checked = Mapping[str, NDArray[Any] | Taken]


class _Renderer(HasCore, Protocol):
    @property
    def apply(self) -> Callable[..., Frames]: ...


def vjp(  # noqa: PLR0917
    renderer: _Renderer,
    image: object,
    settings: Settings,
    mask: object | None,
    emission: object | None,
    device: Device | None,
) -> tuple[Frames, Pullback]:
    """Return the framebuffers of `Renderer.apply` in buffers of floats, and their pullback.

    The arrays are copied, since they may change before the pullback is called.
    """
    if hasattr(settings, "twin"):
        raise ValueError(
            f"method: {settings.method!r} has no derivative, since its passes come from a file"
        )
    core = core_of(renderer)
    if isinstance(image, Image):
        image_source(image, mask, emission)
        # A pass without bloom copies the pixels.
        alone = Separable(bloom=False)
        inputs = uploaded_inputs(
            image,
            lambda: renderer.apply(image, alone, attachments="final", device="host")["final"],
        )
        uploaded = image
    else:
        inputs = checked_inputs(image, mask, emission, core).kept()
        source = inputs.source()
        shape, dtype = source.kind
        uploaded = Image(source, shape, np.dtype(dtype))
    floats = settings.replace(format="rgba32float")
    frames = renderer.apply(uploaded, floats, device=device)
    place = place_of(next(iter(frames.values())))
    pulled = pullback_of(renderer, inputs, settings, place)

    def pullback(cotangents: Mapping[str, NDArray[Any]]) -> Gradients:
        return pulled(_checked(cotangents, frames, core))

    return frames, pullback


def _checked(cotangents: Any, frames: Mapping[str, Any], core: Any) -> Checked:
    """Check cotangents, and copy those that are on the renderer's device.

    Whether these are finite is known when the passes have run.
    """
    if not isinstance(cotangents, Mapping):
        return check_cotangents(cotangents, frames)
    found: dict[str, NDArray[Any] | Taken] = {}
    for name, given in cotangents.items():
        part = take(given, f"cotangents[{name!r}]", core) if on_cuda(given) else given
        if isinstance(part, Taken) and part.dtype != "uint8":
            check_shape(name, part.shape, frames)
            found[name] = part
        else:
            # Levels of bytes would be read as shares of 255.
            part = part.numpy() if isinstance(part, Taken) else part
            found |= check_cotangents({name: part}, frames)
    return found


def pullback_of(
    renderer: HasCore, inputs: Inputs, settings: Settings, place: Place = "host"
) -> Callable[[Checked], Gradients]:
    """Return the pullback alone, of arrays that do not change, and checked cotangents.

    `place`: Where the derivatives by images go.
    """
    start = _starter(renderer, inputs, settings, place)
    return lambda cotangents: start(cotangents)()


def pull_each(
    renderer: HasCore,
    settings: Settings,
    sequence: Iterable[tuple[Inputs, Checked]],
    place: Place = "host",
) -> Iterator[Gradients]:
    """Yield the derivatives of each image. The device works on later ones meanwhile."""
    started: deque[Callable[[], Gradients]] = deque()
    for inputs, cotangents in sequence:
        started.append(_starter(renderer, inputs, settings, place)(cotangents))
        if len(started) == IMAGES_AHEAD:
            yield started.popleft()()
    while started:
        yield started.popleft()()


def _starter(
    renderer: HasCore, inputs: Inputs, settings: Settings, place: Place
) -> Callable[[Checked], Callable[[], Gradients]]:
    """Return a function that submits passes, and returns one that waits for the derivatives."""
    floats = settings.replace(format="rgba32float")
    recorded = functools.cache(lambda: _recorded(inputs, settings))
    names = (*inputs.named(), *differentiable(settings))
    if settings.bloom and callable(getattr(settings, "kernel", None)):
        names += ("kernel",)

    def by_reference(cotangents: Checked) -> Gradients:
        check_finite(cotangents)
        found = recorded()({name: _on_host(part) for name, part in cotangents.items()})
        return Gradients((name, part.astype(np.float32)) for name, part in found.items())

    def start(cotangents: Checked) -> Callable[[], Gradients]:
        passes = Passes(renderer, inputs, floats, cotangents, place)
        running = passes.submit()

        def end() -> Gradients:
            if running is None:
                return _placed(by_reference(cotangents), inputs, place, renderer)
            return DeviceGradients(
                running.images(), names, passes.fields, lambda: by_reference(cotangents)
            )

        return end

    return start


def _recorded(inputs: Inputs, settings: Settings) -> Any:
    """Return the pullback of the reference."""
    return reference_vjp(settings=settings, **inputs.on_host())[1]


def _on_host(part: NDArray[Any] | Taken) -> NDArray[Any]:
    return part.numpy() if isinstance(part, Taken) else part


def _placed(found: Gradients, inputs: Inputs, place: Place, renderer: HasCore) -> Gradients:
    """Move the derivatives by images to where those of the device would be."""
    core = core_of(renderer)
    if not core.closed:
        for name in inputs.named():
            found[name] = cast("NDArray[Any]", placed(found[name], place, core))
    return found
