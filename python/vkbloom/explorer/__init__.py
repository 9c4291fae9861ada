"""Bloom looked at while its settings change: in a notebook, or on a page of its own.

==================== ====================================================================
`controls`           what can be set, for the page to make controls of; settings as code
`viewer`             one viewer: messages of the page in, pictures and values out
`shown`              framebuffers as PNG, quickly
`widget`             the page in a notebook (anywidget)
`server`             the page on 127.0.0.1 (tornado), for ``vkbloom explore``
``page.js``, ``.css`` the page itself, the same for both
==================== ====================================================================
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from vkbloom.checks import import_extra

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from vkbloom.explorer.widget import Explorer
    from vkbloom.renderer import Renderer
    from vkbloom.scene import Scene
    from vkbloom.settings import Settings, Shading

__all__ = ["explore"]


def explore(
    source: Scene | NDArray[Any],
    settings: Settings | None = None,
    *,
    against: Settings | None = None,
    size: tuple[int, int] = (1280, 720),
    shading: Shading = "forward",
    renderer: Renderer | None = None,
) -> Explorer:
    """Look at a bloom in a notebook while its settings change.

    Every change gives a new picture, rendered at the size that it is shown at; while one is on
    its way, only the newest change is kept. A second settings, B, can be compared by a wipe.
    Under the pointer the framebuffer's own values are shown, not those of the picture.

    Parameters
    ----------
    source : Scene or ndarray
        What blooms. An image is as `Renderer.apply` takes it; where it is larger than it is shown,
        its pixels are averaged first, unless its own size is chosen on the page.
    settings : Settings, optional
        To begin with; by default ``Separable()``.
    against : Settings, optional
        What B begins with; by default `settings` without bloom.
    size : (int, int)
        Width and height of a scene's frame: its aspect, and its size where that is chosen on the
        page. Without meaning for an image.
    shading : {"forward", "deferred"}
        Of a scene.
    renderer : Renderer, optional
        By default one of its own, which `Explorer.close` closes.

    Returns
    -------
    Explorer
        A widget, which the notebook shows. ``.settings``, ``.against`` and ``.frames`` are what
        the page shows now; the first two can be set.

    Raises
    ------
    TypeError
        An argument has another type.
    ValueError
        An argument is out of range, or the renderer is closed.
    ModuleNotFoundError
        anywidget is not installed: ``pip install vkbloom[notebook]``.

    See Also
    --------
    Renderer.grid : Many settings at once.

    Notes
    -----
    ``vkbloom explore`` shows the same page without a notebook. A bloom whose reach is given in
    texels looks wider in a reduced frame than in a larger one.

    Examples
    --------
    >>> image = np.full((32, 32, 4), 0.5, np.float32)
    >>> with vkbloom.Renderer("software") as renderer:
    ...     explorer = vkbloom.explore(image, vkbloom.Pyramid(levels=3), renderer=renderer)
    ...     explorer.settings = explorer.settings.replace(radius=2.0)
    ...     print(explorer.settings.radius)
    ...     explorer.close()
    2.0
    """
    import_extra("anywidget", "notebook", "explore")
    from vkbloom.explorer.viewer import Viewer  # noqa: PLC0415  needs the renderer's module
    from vkbloom.explorer.widget import Explorer  # noqa: PLC0415  needs anywidget

    return Explorer(
        Viewer(source, settings, against=against, size=size, shading=shading, renderer=renderer)
    )
