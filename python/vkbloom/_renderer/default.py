"""The default renderer of the process, and a bloom in one call."""

from __future__ import annotations

import atexit
import contextlib
import os
import threading
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, Literal

from numpy.typing import NDArray

from vkbloom import _core
from vkbloom._argument_types import check_arguments
from vkbloom._public import public
from vkbloom._renderer.device_arrays import Device
from vkbloom._renderer.frames import Frames
from vkbloom._renderer.image import Image
from vkbloom._renderer.renderer import Renderer
from vkbloom._renderer.sources import SCENE_SIZE
from vkbloom._settings.antialiasing import Antialiasing
from vkbloom._settings.exposure import Exposure, check_exposure
from vkbloom._settings.settings import Settings, Shading, check_settings

if TYPE_CHECKING:
    from vkbloom._scene import Scene


class _Default:
    """The renderers of calls without one, by adapter.

    A forked child opens its own. One that was closed, or whose device was lost, is replaced.
    """

    def __init__(self) -> None:
        self.renderers: dict[str, Renderer] = {}
        self.lock = threading.Lock()

    def get(self, adapter: str) -> Renderer:
        with self.lock:
            renderer = self.renderers.get(adapter)
            if renderer is not None and renderer._core.lost:
                # The error was raised by the call that lost the device.
                with contextlib.suppress(_core.Error):
                    renderer.close()
            if renderer is None or renderer.closed:
                renderer = self.renderers[adapter] = Renderer(adapter)
            return renderer

    def close(self) -> None:
        with self.lock:
            for renderer in self.renderers.values():
                renderer._release()  # nobody reads states any more


_DEFAULT: Final = _Default()
atexit.register(_DEFAULT.close)
if hasattr(os, "register_at_fork"):
    # The parent's device is not usable in the child, and another thread may have held the lock.
    os.register_at_fork(after_in_child=_DEFAULT.__init__)  # type: ignore[misc]


def renderer_on(adapter: str) -> Renderer:
    """Return the default renderer of an adapter; "auto" is that of `default_renderer`."""
    return _DEFAULT.get(adapter)


@public("vkbloom")
def default_renderer() -> Renderer:
    """Return the renderer that functions use where no renderer is given.

    Returns
    -------
    Renderer
        ``Renderer()``, opened at the first use and closed at exit. A forked child opens its own. If
        it was closed, or its device was lost, the next call opens another one.

    Examples
    --------
    >>> vkbloom.default_renderer() is vkbloom.default_renderer()
    True
    """
    return renderer_on("auto")


@public("vkbloom")
@check_arguments
def apply(
    image: NDArray[Any] | Image | str | os.PathLike[str],
    settings: Settings | str | None = None,
    *,
    mask: NDArray[Any] | None = None,
    emission: NDArray[Any] | None = None,
    framebuffers: Literal["all"] | str | Sequence[str] = "all",
    out: Mapping[str, Any] | None = None,
    device: Device | None = None,
    exposure: Exposure | str | float | None = None,
    taa: Antialiasing | str | None = None,
    dt: float | None = None,
    motion: NDArray[Any] | None = None,
    depth: NDArray[Any] | None = None,
    state: Mapping[str, Any] | None = None,
    renderer: Renderer | None = None,
    **fields: Any,
) -> Frames:
    """Add bloom to an image or to the image of a file.

    Parameters
    ----------
    image : ndarray, Image, str or path-like
        As for `Renderer.apply`; or the path of an image file, which is read as by the command
        ``vkbloom apply``: colours that a file (OpenEXR) has multiplied by alpha stay multiplied,
        and those of other files are multiplied if the settings' `alpha` is not "keep".
    settings : Settings or str, optional
        Settings, or the name of a preset. Default: ``presets["bevy_natural"]``. For a photograph,
        which is a file of integers for SDR, ``presets["photo"]``, for which its highlights are
        expanded to 4. With other settings they are not; ``vkbloom.read(path, expand=4)`` does it.
    mask, emission, framebuffers, out, device, taa, dt, motion, depth, state
        As for `Renderer.apply`.
    exposure : Exposure, str or float, optional
        As for `Renderer.apply`. A number is the field `exposure` of the settings, in stops.
    renderer : Renderer, optional
        Default: `default_renderer`.
    **fields
        Fields of the settings that are changed, as by `Settings.replace`.

    Returns
    -------
    Frames
        As of `Renderer.apply`. Of a photograph that was expanded, ``.info["expand"]`` says up to
        what.

    Examples
    --------
    >>> image = np.zeros((16, 16, 3), np.float32)
    >>> image[8, 8] = 100
    >>> vkbloom.apply(image, "kino", threshold=1)["bloom"].shape
    (16, 16, 4)
    """
    given: dict[str, Any] = {"mask": mask, "emission": emission, "framebuffers": framebuffers}
    given |= {"out": out, "device": device, "taa": taa, "dt": dt, "motion": motion}
    given |= {"depth": depth, "state": state}
    given["exposure"] = take_exposure(exposure, fields)
    if not isinstance(image, str | os.PathLike):
        chosen = _change(settings, fields, of_image=True)
        return (renderer or default_renderer()).apply(image, chosen, **given)
    from vkbloom._presets.start import start_file  # noqa: PLC0415  costs start-up time

    picture, start = start_file(image, settings, fields)
    pixels = start.develop(picture).pixels
    frames = (renderer or default_renderer()).apply(pixels, start.settings, **given)
    if start.expand is not None:
        frames._info["expand"] = start.expand
    return frames


def take_exposure(
    exposure: Exposure | str | float | None, fields: dict[str, Any]
) -> Exposure | None:
    """Return the exposure of a call; a number is a field of its settings."""
    if exposure is None or isinstance(exposure, Exposure | str):
        return None if exposure is None else check_exposure(exposure)
    fields["exposure"] = exposure
    return None


def _change(
    settings: Settings | str | None, fields: dict[str, Any], *, of_image: bool = False
) -> Settings:
    chosen = check_settings(settings, of_image=of_image)
    return chosen.replace(**fields) if fields else chosen


@public("vkbloom")
@check_arguments
def render(
    scene: Scene,
    settings: Settings | str | None = None,
    size: tuple[int, int] = SCENE_SIZE,
    *,
    shading: Shading = "forward",
    time: float = 0.0,
    framebuffers: Literal["all"] | str | Sequence[str] = "all",
    out: Mapping[str, Any] | None = None,
    device: Device | None = None,
    exposure: Exposure | str | float | None = None,
    taa: Antialiasing | str | None = None,
    dt: float | None = None,
    state: Mapping[str, Any] | None = None,
    renderer: Renderer | None = None,
    **fields: Any,
) -> Frames:
    """Render a scene with its bloom.

    Parameters
    ----------
    scene, size, shading, time, framebuffers, out, device, taa, dt, state
        As for `Renderer.render`.
    exposure : Exposure, str or float, optional
        As for `apply`.
    settings : Settings or str, optional
        Settings, or the name of a preset. Default: ``presets["tutorial"]``.
    renderer : Renderer, optional
        Default: `default_renderer`.
    **fields
        Fields of the settings that are changed, as by `Settings.replace`.

    Returns
    -------
    Frames
        As of `Renderer.render`.

    Examples
    --------
    >>> frames = vkbloom.render(vkbloom.Scene.ufo(), size=(64, 48), bloom_size=(32, 32))
    >>> frames["final"].shape
    (48, 64, 4)
    """
    chosen_exposure = take_exposure(exposure, fields)
    return (renderer or default_renderer()).render(
        scene,
        _change(settings, fields),
        size,
        shading=shading,
        time=time,
        framebuffers=framebuffers,
        out=out,
        device=device,
        exposure=chosen_exposure,
        taa=taa,
        dt=dt,
        state=state,
    )
