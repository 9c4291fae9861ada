"""Check arguments: numbers, sizes, times, images, and the optional packages they need.

Each function returns the value to use, or raises an error that names the argument, its value and
the accepted values.
"""

from __future__ import annotations

import importlib
import math
import operator
import signal
import threading
from collections.abc import Iterable, Mapping, Sequence, Set
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: The largest 32-bit float; the device computes in 32-bit floats.
FLT_MAX = (2 - 2**-23) * 2.0**127

# What has items, but no first one.
_UNORDERED = (Mapping, Set)

# Fast path for native byte order.
_DTYPES = frozenset(map(np.dtype, (np.uint8, np.float16, np.float32)))

_DTYPE_HINTS = {
    "uint16": "; convert it: (image / 65535).astype(np.float32)",
    "bool": "; convert it: image.astype(np.float32)",
    np.dtype(np.longdouble).name: "; convert it: image.astype(np.float32)",
}
# The device type kDLCPU of DLPack.
_DLPACK_CPU = 1
#: Modes of PIL whose arrays are not red, green and blue, and the mode to convert them to.
_MODE_HINTS = {
    **dict.fromkeys(("1", "L", "P", "CMYK", "YCbCr", "HSV", "RGBX"), "RGB"),
    **dict.fromkeys(("LA", "La", "PA", "RGBa"), "RGBA"),
}


def import_extra(package: str, extra: str, purpose: str) -> ModuleType:
    """Import a package that one of vkbloom's extras installs."""
    # Not the module of sys.modules as it is: another thread may just import it.
    try:
        return _imported(package)
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"{purpose} needs {package}: pip install vkbloom[{extra}]", name=error.name
        ) from error


def _imported(package: str) -> ModuleType:
    """Import a package; Ctrl-C raises after it.

    The modules of nanobind, OpenImageIO's among them, call Python while they are imported, and
    abort the process if that raises (OpenImageIO 3.2.2).
    """
    handler = signal.getsignal(signal.SIGINT)
    # Python runs signal handlers in the main thread alone.
    if not callable(handler) or threading.current_thread() is not threading.main_thread():
        return importlib.import_module(package)
    interrupts: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _: interrupts.append(number))
    try:
        return importlib.import_module(package)
    finally:
        signal.signal(signal.SIGINT, handler)
        if interrupts:
            signal.raise_signal(signal.SIGINT)


def as_float(name: str, value: Any) -> float:
    """Convert a real number to float, or raise TypeError. Too large a number becomes infinity."""
    try:
        # float() would accept these types, with a warning for arrays and complex numbers.
        is_other = isinstance(value, str | bytes | np.complexfloating)
        if is_other or getattr(value, "ndim", 0) != 0:
            raise TypeError
        return float(value)
    except (TypeError, ValueError):
        raise TypeError(f"{name}: {value!r} is not a number") from None
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def check_number(name: str, value: float, low: float, high: float) -> float:
    """Return the value as a float if ``low <= value <= high``.

    Otherwise raise ValueError, naming the field and its range, or TypeError if it is not a number.
    """
    number = as_float(name, value)
    if not low <= number <= high:
        raise ValueError(f"{name}: {value!r} is out of range, {low:g} to {high:g}")
    return number


def check_floats(name: str, values: Iterable[float]) -> tuple[float, ...]:
    """Return the values as floats within the 32-bit range, or raise TypeError or ValueError."""
    try:
        if isinstance(values, (*_UNORDERED, str, bytes)):
            raise TypeError
        numbers = tuple(as_float(name, value) for value in values)
    except TypeError:
        raise TypeError(f"{name}: {values!r} is not a sequence of numbers") from None
    for number in numbers:
        # Negated, so that NaN fails too.
        if not abs(number) <= FLT_MAX:
            raise ValueError(f"{name}: {number!r} is out of range, {-FLT_MAX:g} to {FLT_MAX:g}")
    return numbers


def check_integer(name: str, value: Any, low: float, high: float) -> int:
    """Return a number that is an integer as an int, or raise TypeError or ValueError."""
    integer = int(check_number(name, value, low, high))
    if integer != value:
        raise ValueError(f"{name}: {value!r} is not an integer")
    return integer


def check_above(name: str, value: Any, low: float = 0.0) -> float:
    """Return a finite number above `low` as a float, or raise TypeError or ValueError."""
    number = as_float(name, value)
    if not low < number < math.inf:
        raise ValueError(f"{name}: {value!r} is out of range, above {low:g}")
    return number


def check_size(name: str, size: Any) -> tuple[int, int]:
    """Return (width, height) as two ints of at least 1, or raise TypeError or ValueError."""
    try:
        if isinstance(size, _UNORDERED):
            raise TypeError
        width, height = size
        integers = (int(width), int(height))
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"{name}: {size!r} is not a pair (width, height)") from None
    if integers != (width, height) or min(integers) < 1 or max(integers) >= 2**31:
        raise ValueError(f"{name}: {size!r} is out of range, integers of at least 1")
    return integers


def check_time(time: Any) -> float:
    """Return the time of a scene as a float, or raise TypeError or ValueError."""
    turns = as_float("time", time)
    if not math.isfinite(turns):
        raise ValueError(f"time: {time!r} is out of range, finite numbers")
    return turns


def check_index(field: str, value: int, low: int, high: int) -> int:
    """Return an integer, or raise TypeError or ValueError that names the field."""
    try:
        index = operator.index(value)
    except TypeError:
        raise TypeError(f"{field}: {value!r} is not an integer") from None
    if not low <= index <= high:
        raise ValueError(f"{field}: {index} is outside {low} to {high}")
    return index


def check_image(image: object, name: str = "image") -> NDArray[Any]:
    """Return the image, in this machine's byte order, if the core can take it.

    Errors start with `name`.

    Anything that NumPy can view is an image: arrays, ``__array__``, the buffer protocol, DLPack on
    the CPU, and an xarray.DataArray with the dimensions y, x and channel in any order. float64
    becomes float32, and finite values beyond it the largest one.
    """
    mode = _pil_mode(image)
    if mode in _MODE_HINTS:
        raise ValueError(
            f"{name}: the mode {mode} is not RGB or RGBA; convert it: "
            f'{name}.convert("{_MODE_HINTS[mode]}")'
        )
    array = view_image(image, name)
    if array.dtype.name == "float64":  # in any byte order
        array = _single(array)
    if array.dtype not in _DTYPES:
        if array.dtype.name not in ("uint8", "float16", "float32"):
            hint = _DTYPE_HINTS.get(array.dtype.name, "")
            raise TypeError(
                f"{name}: dtype {array.dtype} is not one of uint8, float16, float32, float64{hint}"
            )
        array = native_order(array)
    if array.ndim != 3 or array.shape[2] not in (3, 4) or 0 in array.shape:
        raise ValueError(
            f"{name}: shape {array.shape} is not (H, W, 3) or (H, W, 4) with sides of at least 1"
            + _shape_hint(array.shape)
        )
    return array


def _single(array: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return float32; finite values beyond its range saturate, since infinity does not glow."""
    with np.errstate(over="ignore"):
        made = array.astype(np.float32)
    is_over = np.isinf(made) & np.isfinite(array)
    if is_over.any():
        made[is_over] = np.copysign(np.finfo(np.float32).max, made[is_over])
    return made


def native_order(array: NDArray[Any]) -> NDArray[Any]:
    """Return the values with a dtype that names no byte order, as a view where that is possible.

    Libraries that compare the format strings of the buffer protocol take "f", and not "<f".
    """
    native = array.dtype.newbyteorder("=")
    # `astype` alone keeps the dtype of an array whose order is this machine's.
    return array.astype(native, copy=False).view(native)


def check_emission(emission: Any, image: Any) -> Any:
    """Return the emission, an image itself, if it has the image's shape and dtype."""
    for what in ("shape", "dtype"):
        given, needed = getattr(emission, what), getattr(image, what)
        if given != needed:
            raise ValueError(f"emission: {what} {given} is not the image's, {needed}")
    return emission


def check_mask(mask: object, size: tuple[int, int], dtype: Any = np.float32) -> NDArray[Any]:
    """Return the mask as floats of 0 to 1, (H, W), if it has that height and width."""
    if _pil_mode(mask) == "P":
        raise ValueError('mask: the mode P is a palette; convert it: mask.convert("L")')
    array = view_image(mask, "mask", ("y", "x"))
    if array.dtype.name not in ("uint8", "bool", "float16", "float32", "float64"):
        hint = "; convert it: (mask / 65535).astype(np.float32)" * (array.dtype.name == "uint16")
        raise TypeError(
            f"mask: dtype {array.dtype} is not one of uint8, bool, float16, float32, float64{hint}"
        )
    if array.shape != size:
        hint = "; take one channel: mask[..., 0]" * (array.ndim == 3 and array.shape[:2] == size)
        raise ValueError(f"mask: shape {array.shape} is not the image's, {size}{hint}")
    values = array.astype(dtype, copy=False)
    if array.dtype.name == "uint8":
        values = values / 255
    # Not the other way round, so that NaN fails too.
    elif array.dtype.kind == "f" and not (array.min() >= 0 and array.max() <= 1):
        wrong = float(array[~((array >= 0) & (array <= 1))][0])
        raise ValueError(f"mask: {wrong} is out of range, 0 to 1; clip it: mask.clip(0, 1)")
    return values


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


def view_image(
    image: object, name: str, dimensions: tuple[str, ...] = ("y", "x", "channel")
) -> NDArray[Any]:
    """Return the plain array of an image, also of another library's.

    An xarray.DataArray has these dimensions in any order. Raises TypeError or ValueError.
    """
    if isinstance(image, np.ndarray):
        return plain_array(image, name)
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


def _pil_mode(image: object) -> str:
    """Return the mode of an image of PIL; "" for other objects."""
    return str(getattr(image, "mode", "")) if type(image).__module__.startswith("PIL.") else ""


def _dimension(dims: tuple[Any, ...], name: str) -> Any:
    """Return the dimension with this name, or the one that ends with an underscore and the name."""
    if name in dims:
        return name
    ending = [dim for dim in dims if str(dim).endswith(f"_{name}")]
    return ending[0] if len(ending) == 1 else None


def _shape_hint(shape: tuple[int, ...]) -> str:
    """Return a hint how to convert an array of this shape to an image; "" if there is none."""
    if len(shape) == 2:
        return "; convert grey to RGB: np.repeat(image[..., None], 3, axis=2)"
    if len(shape) == 3 and shape[2] == 1:
        return "; convert grey to RGB: np.repeat(image, 3, axis=2)"
    if len(shape) == 3 and shape[0] in (3, 4) and shape[2] not in (0, 3, 4):
        return "; move the channels last: np.moveaxis(image, 0, -1)"
    if len(shape) == 4 and shape[1] in (3, 4) and shape[3] not in (0, 3, 4):
        return "; move the channels last: np.moveaxis(images, 1, -1)"
    return ""


def check_framebuffers(framebuffers: str | Sequence[str]) -> tuple[str, ...] | None:
    """Return the names of the requested framebuffers; None for all."""
    if isinstance(framebuffers, str):
        return None if framebuffers == "all" else (framebuffers,)
    return tuple(framebuffers)
