"""Framebuffers on a screen: a renderer presents them, and nothing is read back."""

from __future__ import annotations

import ctypes
from collections import deque
from typing import TYPE_CHECKING, Any, Final, Literal, NoReturn, cast

from vkbloom import _core
from vkbloom.checks import check_attachments, check_size, import_extra
from vkbloom.settings import check_settings
from vkbloom.sources import image_source, is_image, scene_source

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import TracebackType

    from numpy.typing import NDArray

    from vkbloom.image import Image
    from vkbloom.renderer import Renderer
    from vkbloom.scene import Scene
    from vkbloom.settings import Settings, Shading

__all__ = ["Surface"]

_FRAMES_IN_FLIGHT: Final = 2


def _window_surface(renderer: Renderer, window: object) -> int:
    """Return the VkSurfaceKHR of a window of glfw."""
    glfw = import_extra("glfw", "window", "a window")
    if renderer.info.bundled:
        raise _core.Error(
            "the bundled driver does not support windows; use the system's with "
            "VKBLOOM_DRIVER=system"
        )
    handle = ctypes.c_uint64()
    result = glfw.create_window_surface(renderer._core.instance, window, None, ctypes.byref(handle))
    if result != 0:
        raise _core.Error(
            f"{renderer.info.name} cannot create a surface for this window (VkResult {result}); "
            "create the window with the hint CLIENT_API = NO_API"
        )
    return handle.value


def _is_the_scene(settings: Settings) -> bool:
    """Return whether a scene's `final` would be a copy of `scene`, for which a pass would run."""
    shown = settings.tonemap, settings.encoding, settings.exposure, settings.dither
    return not settings.bloom and shown == ("none", "none", 0.0, False)


class Surface:
    """A window, or a display without one, on which a renderer presents framebuffers.

    Parameters
    ----------
    renderer : Renderer
    window : window of glfw, callable or None
        A window of PyPI's ``glfw``, created with the hint CLIENT_API = NO_API; a function that
        makes a VkSurfaceKHR for a VkInstance, both as integers; or None: a display without a
        window, by VK_EXT_headless_surface, which Mesa's lavapipe 25 has.
    size : (int, int), optional
        Width and height in pixels without a window of glfw, by default (1280, 720). A surface
        that has a size of its own keeps that.
    mode : {"fifo", "mailbox"}
        When an image replaces the one before: at the next refresh of the screen, in order; at the
        next refresh, the newest only. Every surface has "fifo".

    Attributes
    ----------
    size : (int, int)
        Width and height in pixels; (0, 0) while a window is minimized.
    timings : dict of str to float
        Seconds of the passes that ran for the frame before the last two, as of `Frames.timings`.

    Raises
    ------
    ValueError
        The surface lacks the mode, or the renderer is closed.
    TypeError
        An argument has the wrong type.
    Error
        The adapter's driver cannot present on this surface.
    ModuleNotFoundError
        glfw is missing.

    See Also
    --------
    Renderer.render, Renderer.apply : Return the framebuffers as arrays.

    Notes
    -----
    A context manager. Close it before its window is destroyed; one that is not closed lives as
    long as its renderer.

    ``glfw.terminate`` is for the end of the process: Mesa's drivers keep the connection to the
    display that it closes.

    Two frames are in flight: `present` waits for the device only if it has not finished the frame
    before the last one. Ctrl-C ends this wait.

    Examples
    --------
    The scene in a window of glfw, until that is closed:

    >>> def show(scene):
    ...     import glfw
    ...
    ...     glfw.init()
    ...     glfw.window_hint(glfw.CLIENT_API, glfw.NO_API)
    ...     window = glfw.create_window(1280, 720, "bloom", None, None)
    ...     with vkbloom.Renderer() as renderer, vkbloom.Surface(renderer, window) as surface:
    ...         while not glfw.window_should_close(window):
    ...             surface.present(scene, time=glfw.get_time() / 8)
    ...             glfw.poll_events()
    ...     glfw.terminate()
    """

    def __init__(
        self,
        renderer: Renderer,
        window: object = None,
        *,
        size: tuple[int, int] | None = None,
        mode: Literal["fifo", "mailbox"] = "fifo",
    ) -> None:
        if renderer.closed:
            raise ValueError("renderer: it is closed")
        if mode not in ("fifo", "mailbox"):
            raise ValueError(f'mode: {mode!r} is not "fifo" or "mailbox"')
        self._renderer = renderer
        self._pending: deque[_core.Submission] = deque()
        self._size = check_size("size", (1280, 720) if size is None else size)
        # A window of glfw is a pointer.
        self._window = window if isinstance(window, ctypes._Pointer) else None
        handle = 0
        if self._window is not None:
            if size is not None:
                raise ValueError("size: a window determines its size; leave the argument out")
            handle = _window_surface(renderer, window)
        elif callable(window):
            handle = int(cast("Callable[[int], int]", window)(renderer._core.instance))
        elif window is not None:
            raise TypeError(f"window: {window!r} is not a glfw window, a function or None")
        self._core = renderer._core.screen(handle, mode == "mailbox")
        self.timings: dict[str, float] = {}

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels; may be set where it is no window of glfw."""
        if self._window is None:
            return self._size
        import glfw  # noqa: PLC0415  an extra

        width, height = glfw.get_framebuffer_size(self._window)
        return width, height

    @size.setter
    def size(self, size: tuple[int, int]) -> None:
        if self._window is not None:
            raise ValueError("size: a window determines its size; resize the window")
        self._size = check_size("size", size)

    def present(
        self,
        source: Scene | NDArray[Any] | Image,
        settings: Settings | None = None,
        *,
        shading: Shading = "forward",
        time: float = 0.0,
        size: tuple[int, int] | None = None,
        attachment: str = "final",
    ) -> bool:
        """Render a scene, or give an image bloom, and show a framebuffer of it.

        Parameters
        ----------
        source : Scene or an image
            As for `Renderer.render` and `Renderer.apply`. An image for many frames is best
            uploaded once (`Renderer.upload`).
        settings : Settings, optional
            By default ``Separable()``.
        shading, time
            Of a scene, as for `Renderer.render`.
        size : (int, int), optional
            Of a scene's frame, by default the surface's.
        attachment : str
            The framebuffer to show; depth is no colour, and cannot be.

        Returns
        -------
        bool
            False: nothing was shown, since the window is minimized or hidden, or its size
            changes faster than the frames.

        Raises
        ------
        ValueError
            An argument is out of range, or the surface or its renderer is closed.
        TypeError
            An argument has the wrong type.
        OutOfMemoryError, DeviceLostError, ValidationError, Error
            The device failed, or the window is gone.

        See Also
        --------
        Renderer.render, Renderer.apply : Return the framebuffers as arrays.

        Notes
        -----
        Levels of uint8 are shown as they are. Floats are light: they are cut off at 0 and 1 and
        encoded as sRGB; a ``final`` that the settings have encoded already is only cut off. A
        frame of another size than the surface's is scaled, bilinearly, and gets black bars where
        its proportions differ. Framebuffers of other sizes are shown where ``final`` would be.

        Examples
        --------
        >>> def play(surface, scene, settings):
        ...     return [surface.present(scene, settings, time=step / 90) for step in range(90)]
        """
        settings = check_settings(settings)
        names = check_attachments(attachment)
        if names is None or len(names) != 1:
            raise ValueError(f"attachment: {attachment!r} is not the name of one framebuffer")
        width, height = self.size
        if min(width, height) < 1:
            return False
        if is_image(source):
            given = image_source(source)
        else:
            frame = (width, height) if size is None else size
            if attachment == "final" and _is_the_scene(settings):
                names = ("scene",)
            given = scene_source(cast("Scene", source), frame, shading, time)
        core = self._renderer._core
        plan = core.plan(given, settings, names)
        ((_, _, dtype),) = plan.outputs
        linear = dtype != "uint8" and not (attachment == "final" and settings.encoding != "none")
        if len(self._pending) == _FRAMES_IN_FLIGHT:
            ((self.timings,), _) = self._pending.popleft().wait()
        submission, shown = core.show(given, plan, self._core, width, height, linear)
        self._pending.append(submission)
        return shown

    def close(self) -> None:
        """Wait for the device and give the surface back; may be called twice.

        Raises
        ------
        ValidationError
            With validation on: something was left behind.

        See Also
        --------
        Renderer.close : Closes the renderer.

        Examples
        --------
        >>> def show(surface, scene, settings):
        ...     surface.present(scene, settings)
        ...     surface.close()
        """
        self._pending.clear()
        self._core.close()

    def __reduce__(self) -> NoReturn:
        raise TypeError("a Surface cannot be copied or pickled; create another one")

    def __enter__(self) -> Surface:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()
