"""Settings under the names of where they were published."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING

from vkbloom.settings import Separable

if TYPE_CHECKING:
    from collections.abc import Mapping

    from vkbloom.settings import Settings

#: Name to settings.
#:
#: - ``"tutorial"``: the forward system, 256 x 256 bloom buffers, nine taps.
#: - ``"outline"``: the same passes with a loop that starts at the centre and a vertical step of
#:   one texel of the width.
presets: Mapping[str, Settings] = MappingProxyType(
    {
        "tutorial": Separable(),
        "outline": Separable(first_tap=0, texel="x"),
    }
)
