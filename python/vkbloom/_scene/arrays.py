"""Arrays of scenes: checked, and read-only."""

from __future__ import annotations

from typing import Any, Final

from numpy.typing import NDArray

#: The longest side, far above the 4096 that every Vulkan device supports. It rejects the sizes of
#: damaged images. The device's own limit is checked at upload.
MAX_SIDE: Final = 16384


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """Return `array` as a C-contiguous array that cannot be changed.

    An array that is read-only, C-contiguous and owns its memory is returned itself. Any other is
    copied, because the base of a read-only view can still be changed.
    """
    flags = array.flags
    if flags.writeable or not flags.c_contiguous or not flags.owndata:
        array = array.copy(order="C")
        array.flags.writeable = False
    return array
