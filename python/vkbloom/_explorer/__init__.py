"""The explorer: controls for all settings and a live picture, in a notebook or on a web page."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from vkbloom._extras import import_extra
from vkbloom._public import public

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from vkbloom._explorer.widget import Explorer
    from vkbloom._renderer.renderer import Renderer
    from vkbloom._scene import Scene
    from vkbloom._settings.antialiasing import Antialiasing
    from vkbloom._settings.exposure import Exposure
    from vkbloom._settings.settings import Settings, Shading


@public("vkbloom")
def explore(
    source: Scene | NDArray[Any] | Sequence[Any] | str | os.PathLike[str] | None = None,
    settings: Settings | str | None = None,
    *,
    against: Settings | str | None = None,
    size: tuple[int, int] = (1280, 720),
    shading: Shading = "deferred",
    fps: float | None = None,
    exposure: Exposure | str | None = None,
    taa: Antialiasing | str | None = None,
    renderer: Renderer | None = None,
) -> Explorer:
    """Explore a bloom in a notebook, with controls for all settings.

    Every change renders a new picture at the size at which it is shown. While a picture is being
    rendered, only the newest change is kept. A wipe compares the settings with other settings, B.
    The values under the pointer are those of the framebuffer, not of the picture.

    Parameters
    ----------
    source : Scene, ndarray, str, path-like or a sequence, optional
        The scene, an image as `Renderer.apply` takes it, or the path of an image file, which is
        read as by `vkbloom.apply`. An image that is larger than it is shown is reduced first by
        averaging, unless the page selects its own size. Frames in time, which the page plays: a
        list of images, an array (N, H, W, C), a pattern of files or a video, as for `sequence`.
        Default: ``Scene.ufo()`` with lights 6 times as bright as white.
    settings : Settings or str, optional
        The initial settings, or the name of a preset. Default: for an image those of
        `vkbloom.apply`, for a scene ``presets["tutorial"]``, with ``tonemap="aces"`` and
        ``encoding="srgb"`` if the shading is deferred.
    against : Settings or str, optional
        The initial settings of B. Default: `settings` without bloom.
    size : (int, int)
        Width and height of a scene's frame. They give the aspect ratio, and the size if the page
        selects the source's own size. Not used for an image.
    shading : {"deferred", "forward"}
        Initial shading of a scene. The page has a control for it.
    fps : float, optional
        Frames per second of frames in time. Default: 24; a video has its own times.
    exposure, taa
        As for `sequence`, with which the page begins. With one of them, or `fps`, a scene is played
        as frames of its animation, whose deferred shading has light to meter.
    renderer : Renderer, optional
        Default: a new renderer, which `Explorer.close` closes.

    Returns
    -------
    Explorer
        A widget, which the notebook shows. ``.settings``, ``.against`` and ``.frames`` are those
        of the page; the first two can be set.

    Raises
    ------
    ValueError
        An argument is out of range, the renderer is closed, or a still has `fps`, `exposure` or
        `taa`.

    Notes
    -----
    ``vkbloom explore`` shows the same page without a notebook. A bloom whose width is given in
    texels looks wider in a reduced frame.

    Examples
    --------
    In a cell of a notebook:

    >>> vkbloom.explore("photo.jpg", "mist", against="soft")  # doctest: +SKIP
    """
    import_extra("anywidget", "notebook", "explore")
    from vkbloom._explorer.playing import open_clip  # noqa: PLC0415  see vkbloom.reference
    from vkbloom._explorer.viewer import Viewer, default_scene  # noqa: PLC0415
    from vkbloom._explorer.widget import Explorer  # noqa: PLC0415  needs anywidget

    how: dict[str, Any] = {"against": against, "size": size, "shading": shading}
    looked_at: Any = default_scene() if source is None else source
    clip = open_clip(looked_at, fps=fps, exposure=exposure, taa=taa)
    if isinstance(source, str | os.PathLike):
        from vkbloom._io.image_file import read_picture  # noqa: PLC0415  costs start-up time

        looked_at = read_picture(source) if clip is None else clip.decoded(0)
        how["file"] = os.fspath(source)
    elif clip is not None and not clip.is_scene:
        looked_at = clip.decoded(0)
    return Explorer(Viewer(looked_at, settings, clip=clip, renderer=renderer, **how))
