"""Check the images, masks, emissions, motions and depths that callers give.

Each function returns the array to use, or raises an error that names the argument, says what is
wrong, and how to convert it.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import DTypeLike, NDArray

from vkbloom._arrays import native_order, pil_mode, saturate, view_image
from vkbloom._formats import IMAGE_DTYPES, MAX_FLOAT

# Fast path for native byte order.
_DTYPES: Final = frozenset(map(np.dtype, IMAGE_DTYPES))

_DTYPE_HINTS: Final = {
    "uint16": "; convert it: (image / 65535).astype(np.float32)",
    "bool": "; convert it: image.astype(np.float32)",
    np.dtype(np.longdouble).name: "; convert it: image.astype(np.float32)",
}
#: Modes of PIL whose arrays are not red, green and blue, and the mode to convert them to.
_MODE_HINTS: Final = {
    **dict.fromkeys(("1", "L", "P", "CMYK", "YCbCr", "HSV", "RGBX"), "RGB"),
    **dict.fromkeys(("LA", "La", "PA", "RGBa"), "RGBA"),
}


def check_image(image: object, name: str = "image") -> NDArray[Any]:
    """Return the image, in this machine's byte order, if the core can take it.

    Errors start with `name`.

    Anything that NumPy can view is an image: arrays, ``__array__``, the buffer protocol, DLPack on
    the CPU, and an xarray.DataArray with the dimensions y, x and channel in any order. float64
    becomes float32, and finite values beyond it the largest one.
    """
    mode = pil_mode(image)
    if mode in _MODE_HINTS:
        raise ValueError(
            f"{name}: the mode {mode} is not RGB or RGBA; convert it: "
            f'{name}.convert("{_MODE_HINTS[mode]}")'
        )
    array = view_image(image, name)
    if array.dtype.name == "float64":  # in any byte order
        array = _single(array)
    if array.dtype not in _DTYPES:
        if array.dtype.name not in IMAGE_DTYPES:
            hint = _DTYPE_HINTS.get(array.dtype.name, "")
            raise TypeError(
                f"{name}: dtype {array.dtype} is not one of "
                f"{', '.join(IMAGE_DTYPES)}, float64{hint}"
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
        return saturate(array.astype(np.float32), np.isfinite(array))


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


def check_emission(emission: Any, image: Any) -> Any:
    """Return the emission, an image itself, if it has the image's shape and dtype."""
    for what in ("shape", "dtype"):
        given, needed = getattr(emission, what), getattr(image, what)
        if given != needed:
            raise ValueError(f"emission: {what} {given} is not the image's, {needed}")
    return emission


def check_mask(mask: object, size: tuple[int, int], dtype: Any = np.float32) -> NDArray[Any]:
    """Return the mask as floats of 0 to 1, (H, W), if it has that height and width."""
    if pil_mode(mask) == "P":
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


def check_motion(motion: object, size: tuple[int, int], dtype: Any = np.float32) -> NDArray[Any]:
    """Return the motion as floats, (H, W, 2), if it has that height and width and is finite."""
    values = _as_geometry("motion", motion, (*size, 2), dtype)
    # Not the other way round, so that NaN fails too.
    if not (values.min() >= -MAX_FLOAT and values.max() <= MAX_FLOAT):
        raise ValueError("motion: some values are not finite; set them to 0")
    return values


def check_depth(depth: object, size: tuple[int, int], dtype: Any = np.float32) -> NDArray[Any]:
    """Return the depth as floats, (H, W), if it has that height and width and has no NaN."""
    values = _as_geometry("depth", depth, size, dtype)
    if np.isnan(values.min()):
        raise ValueError("depth: some values are NaN; set them to that of the farthest surface")
    return values


def check_geometry(name: str, array: Any, shape: tuple[int, ...], dtypes: tuple[str, ...]) -> None:
    """Raise TypeError or ValueError for a motion or a depth of another dtype or shape."""
    if np.dtype(array.dtype).name not in dtypes:
        raise TypeError(f"{name}: dtype {array.dtype} is not one of {', '.join(dtypes)}")
    if array.shape != shape:
        hint = "; take one channel: depth[..., 0]" * (array.shape == (*shape, 1))
        raise ValueError(f"{name}: shape {array.shape} is not {shape}, as the image needs{hint}")


def _as_geometry(
    name: str, given: object, shape: tuple[int, ...], dtype: DTypeLike
) -> NDArray[Any]:
    array = view_image(given, name, ("y", "x", "channel")[: len(shape)])
    check_geometry(name, array, shape, ("float16", "float32", "float64"))
    with np.errstate(over="ignore"):
        return array.astype(dtype, copy=False)
