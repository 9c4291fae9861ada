"""Arrays of callers as plain ones: subclasses, byte orders, DLPack, xarray, images of PIL."""

from __future__ import annotations

from typing import Any, Final, cast

import numpy as np
from numpy.typing import NDArray

from ._array_api import ForeignArray

# The device type kDLCPU of DLPack.
_DLPACK_CPU: Final = 1


def check_dtype(name: str, value: Any) -> np.dtype[Any]:
    """Return what NumPy makes of a dtype, or raise TypeError, also for None."""
    try:
        # To NumPy, None is float64.
        return np.dtype("" if value is None else value)
    # (Some names of dtypes are deprecated, which is an error where warnings are.)
    except (TypeError, ValueError, DeprecationWarning):
        raise TypeError(f"{name}: {value!r} is not a dtype") from None


def plain_array(value: object, name: str) -> NDArray[Any]:
    """Return what NumPy makes of an object, as a plain ndarray: every array argument comes here.

    Subclasses have their own arithmetic: a masked array of float32, divided by 255, is one of
    float64. Values under a mask are not the caller's: they are a ValueError.
    """
    array = np.asanyarray(value)
    if type(array) is np.ndarray:
        return array
    if np.ma.is_masked(array):
        raise ValueError(f"{name}: some values are masked; fill them first, as .filled(0) does")
    return np.asarray(array)


def copy_to_host(value: Any) -> Any:
    """Return another library's array as NumPy's, from any device, without what it records.

    Anything else is returned as it is.
    """
    value = value.value if isinstance(value, ForeignArray) else value
    if isinstance(value, np.ndarray) or not hasattr(value, "__dlpack__"):
        return value
    value = value.detach() if hasattr(value, "detach") else value
    if device_kind(value) not in (0, _DLPACK_CPU):
        # Of PyTorch and of CuPy; JAX copies by itself.
        method = next((name for name in ("cpu", "get") if hasattr(value, name)), None)
        value = value if method is None else getattr(value, method)()
    return np.asarray(value) if hasattr(value, "__array__") else np.from_dlpack(value)


def view_image(
    image: object, name: str, dimensions: tuple[str, ...] = ("y", "x", "channel")
) -> NDArray[Any]:
    """Return the plain array of an image, also of another library's.

    An xarray.DataArray has these dimensions in any order. Raises TypeError or ValueError.
    """
    if isinstance(image, np.ndarray):
        return plain_array(image, name)
    if isinstance(image, ForeignArray):
        return cast("NDArray[Any]", image)
    dims = getattr(image, "dims", None)
    if isinstance(dims, tuple) and hasattr(image, "transpose"):
        # A grid's channels are named after their framebuffer, such as "final_channel".
        order = [_dimension(dims, dimension) for dimension in dimensions]
        if len(dims) != len(order) or None in order:
            others = [dim for dim, dimension in zip(dims, order, strict=False) if dim not in order]
            hint = (
                f"select one value of the others first, such as {name}.isel({others[0]}=0)"
                if len(dims) > len(order) and others
                else f"rename them: {name}.rename(...)"
            )
            raise ValueError(f"{name}: dimensions {dims} are not {', '.join(dimensions)}; {hint}")
        return plain_array(image.transpose(*order), name)
    is_viewed = hasattr(image, "__array__") or hasattr(image, "__array_interface__")
    try:
        if hasattr(image, "__dlpack__") and not is_viewed:
            return np.from_dlpack(image)
        array = np.asanyarray(image) if is_viewed else np.asarray(memoryview(image))  # type: ignore[arg-type]
    except (TypeError, ValueError, RuntimeError, BufferError) as error:
        if device_kind(image) not in (0, _DLPACK_CPU):
            raise TypeError(on_another_device(image, name)) from None
        raise TypeError(
            f"{name}: an array is needed, not {type(image).__name__}"
            + (f"; NumPy: {error}" if is_viewed else "")
        ) from None
    return plain_array(array, name)


def _dimension(dims: tuple[Any, ...], name: str) -> Any:
    """Return the dimension with this name, or the one that ends with an underscore and the name."""
    if name in dims:
        return name
    ending = [dim for dim in dims if str(dim).endswith(f"_{name}")]
    return ending[0] if len(ending) == 1 else None


def on_another_device(image: object, name: str) -> str:
    """Return the message for an array that the renderer cannot read."""
    return (
        f"{name}: {type(image).__name__} is on another device; copy it to the CPU: "
        f"{name}.cpu() for PyTorch, {name}.get() for CuPy"
    )


def device_kind(image: object) -> int:
    """Return DLPack's type of the device that an array is on; 0 if the object has none."""
    try:
        return int(image.__dlpack_device__()[0])  # type: ignore[attr-defined]
    except Exception:  # whatever a foreign object raises; a later use of it tells more
        return 0


def pil_mode(image: object) -> str:
    """Return the mode of an image of PIL; "" for other objects."""
    return str(getattr(image, "mode", "")) if type(image).__module__.startswith("PIL.") else ""


def saturate(made: NDArray[Any], was_finite: NDArray[np.bool_]) -> NDArray[Any]:
    """Replace infinite results of finite values by the largest number of their type, in place."""
    is_over = np.isinf(made) & was_finite
    if is_over.any():
        made[is_over] = np.copysign(np.finfo(made.dtype).max, made[is_over])
    return made


def native_order(array: NDArray[Any]) -> NDArray[Any]:
    """Return the values with a dtype that names no byte order, as a view where that is possible.

    Libraries that compare the format strings of the buffer protocol take "f", and not "<f".
    """
    native = array.dtype.newbyteorder("=")
    # `astype` alone keeps the dtype of an array whose order is this machine's.
    return array.astype(native, copy=False).view(native)
