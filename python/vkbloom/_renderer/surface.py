"""Framebuffers on a screen: a renderer presents them, and nothing is read back."""

from __future__ import annotations

import ctypes
from collections import deque
from typing import TYPE_CHECKING, Any, Final, Self, cast

from vkbloom import _core
from vkbloom._extras import import_extra
from vkbloom._numbers import check_size
from vkbloom._renderer.sources import image_source, is_image, scene_source
from vkbloom._settings.settings import check_settings

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from vkbloom._renderer.image import Image
    from vkbloom._renderer.renderer import Renderer
    from vkbloom._scene import Scene
    from vkbloom._settings.settings import Settings, Shading

_FRAMES_IN_FLIGHT: Final = 2


def _window_surface(renderer: Renderer, window: object) -> int:
    """Return the VkSurfaceKHR of a window of glfw, which is a pointer."""
    glfw = import_extra("glfw", "window", "a window")
    if not isinstance(window, ctypes._Pointer):
        raise TypeError(f"window: {window!r} is not a glfw window or None")
    if renderer.info.bundled:
        raise _core.Error(
            "the bundled driver has no windows; use the system's with VKBLOOM_DRIVER=system"
        )
    handle = ctypes.c_uint64()
    result = glfw.create_window_surface(renderer._core.instance, window, None, ctypes.byref(handle))
    if result != 0:
        raise _core.Error(
            f"{renderer.info.name} cannot create a surface for this window (VkResult {result}); "
            "create the window with the hint CLIENT_API = NO_API"
        )
    return handle.value


class Surface:
    """A window, or a display without one, on which a renderer presents framebuffers.

    A context manager. Close it before its window is destroyed; one that is not closed lives as
    long as its renderer. ``glfw.terminate`` is for the end of the process: Mesa's drivers keep the
    connection to the display that it closes.

    - `window`: A window of PyPI's ``glfw``, created with the hint CLIENT_API = NO_API; or None: a
      display without a window, by VK_EXT_headless_surface, which Mesa's lavapipe 25 has.
    - `size`: Width and height in pixels without a window. A window has its own.

    Each refresh of the screen shows the next image (FIFO).
    """

    def __init__(
        self,
        renderer: Renderer,
        window: Any = None,
        *,
        size: tuple[int, int] = (1280, 720),
    ) -> None:
        self._size = check_size("size", size)
        handle = 0 if window is None else _window_surface(renderer, window)
        self._renderer, self._window = renderer, window
        self._screen = renderer._core.open_screen(handle)
        self._pending: deque[_core.Submission] = deque()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels; (0, 0) while a window is minimized on some systems."""
        if self._window is None:
            return self._size
        glfw = import_extra("glfw", "window", "a window")
        size: tuple[int, int] = glfw.get_framebuffer_size(self._window)
        return size

    def present(
        self,
        source: Scene | NDArray[Any] | Image,
        settings: Settings | None = None,
        *,
        shading: Shading = "forward",
        time: float = 0.0,
        size: tuple[int, int] | None = None,
        framebuffer: str = "final",
    ) -> bool:
        """Render a scene, or give an image bloom, and show a framebuffer of it.

        The arguments are those of `Renderer.render` and `Renderer.apply`; a scene's `size` is by
        default the surface's. Levels of uint8 are shown as they are. Floats are light: they are cut
        off at 0 and 1 and encoded as sRGB; a ``final`` that the settings have encoded is only cut
        off. A frame of another size is scaled, bilinearly, with black bars where its proportions
        differ. False: nothing was shown, since the window is minimized or hidden, or its size
        changes faster than the frames.

        Two frames are in flight: this waits for the device only if it has not finished the frame
        before the last one. Ctrl-C ends this wait.
        """
        settings = check_settings(settings, of_image=is_image(source))
        width, height = self.size
        if min(width, height) < 1:
            return False
        if is_image(source):
            given = image_source(source)
        else:
            given = scene_source(cast("Scene", source), size or (width, height), shading, time)
        core = self._renderer._core
        plan = core.plan(given, settings, (framebuffer,))
        ((_, shape, dtype),) = plan.outputs
        if len(shape) != 3:
            raise ValueError(f"framebuffer: {framebuffer!r} has no colours to show")
        linear = dtype != "uint8" and not (framebuffer == "final" and settings.encoding != "none")
        if len(self._pending) == _FRAMES_IN_FLIGHT:
            self._pending.popleft().wait()
        shown = self._screen, width, height, linear
        submission = core.run(given, (plan,), ((None,),), False, shown)
        if submission:
            self._pending.append(submission)
        return submission is not None

    def close(self) -> None:
        """Wait for the device and give the surface back; may be called twice."""
        self._pending.clear()
        self._renderer._core.close_screen(self._screen)
        self._screen = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()
