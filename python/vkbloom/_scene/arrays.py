"""Arrays of scenes: checked, and read-only."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar, Final

from numpy.typing import NDArray

from vkbloom._checks import plain_array

#: The longest side, far above the 4096 that every Vulkan device supports. It rejects the sizes of
#: damaged images. The device's own limit is checked at upload.
MAX_SIDE: Final = 16384


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """Return `array` as a C-contiguous array that cannot be changed.

    An array that is read-only, C-contiguous and owns its memory is returned itself. Any other is
    copied, because the base of a read-only view can still be changed.
    """
    array = plain_array(array, "array")
    flags = array.flags
    if flags.writeable or not flags.c_contiguous or not flags.owndata:
        array = array.copy(order="C")
        array.flags.writeable = False
    return array


class Constructed:
    """A dataclass that is pickled through its constructor, without what only this process has.

    NumPy pickles do not keep arrays read-only.
    """

    __dataclass_fields__: ClassVar[dict[str, Any]]

    def __reduce__(self) -> tuple[Any, ...]:
        given = (field.name for field in dataclasses.fields(self) if field.init)
        return type(self), tuple(getattr(self, name) for name in given)
