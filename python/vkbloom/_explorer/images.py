"""The images that a page shows: developed for settings, at the sizes at which they are shown."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

from numpy.typing import NDArray

from vkbloom._image_arguments import check_image
from vkbloom._io.picture import Picture
from vkbloom._views.pictures import reduce

if TYPE_CHECKING:
    from vkbloom._explorer.playing import Clip
    from vkbloom._presets.start import Start

# Images of a still that are kept: those of both sides, whole and reduced.
_KEPT: Final = 4


class Images:
    """Those of a still, or of a clip's frames.

    - `picture`: The decoded still or first frame of files; None: there are arrays.
    """

    def __init__(self, picture: Picture | None, clip: Clip | None) -> None:
        self.picture, self._clip = picture, clip
        self._made: dict[object, NDArray[Any]] = {}

    def key(self, start: Start) -> object:
        """Return what the pixels depend on, besides the frame."""
        return (
            None if self.picture is None else (start.expand or 1.0, start.settings.alpha != "keep")
        )

    def keep(self, start: Start, image: NDArray[Any]) -> None:
        """Keep a still that is developed."""
        self._made = {self.key(start): image}

    def at(self, start: Start, size: tuple[int, int], number: int) -> NDArray[Any]:
        """Return the image as it starts, averaged until it fits into a size.

        - `number`: Of a clip's frame.
        """
        key, clip = self.key(start), self._clip

        def whole() -> NDArray[Any]:
            picture = self.picture if clip is None else clip.decoded(number)
            if not isinstance(picture, Picture):
                # (Of a still, an array is always kept.)
                return check_image(picture)
            return start.develop(picture).pixels

        if clip is not None:
            return clip.image((number, size, key), lambda: reduce(whole(), size))
        return self._remember((size, key), lambda: reduce(self._remember(key, whole), size))

    def _remember(self, key: object, make: Callable[[], NDArray[Any]]) -> NDArray[Any]:
        """Return an image that was made before, or make it and drop the one not used longest."""
        image = self._made.pop(key) if key in self._made else make()
        self._made[key] = image
        while len(self._made) > _KEPT:
            del self._made[next(iter(self._made))]
        return image
