"""Arrays on the device: images of other libraries on a GPU, and framebuffers that stay there."""

from __future__ import annotations

import functools
import math
import sys
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple, NoReturn

import numpy as np

from vkbloom import _core
from vkbloom._arrays import device_kind, on_another_device
from vkbloom._formats import IMAGE_DTYPES
from vkbloom._public import public

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

#: Where framebuffers are wanted.
Device = Literal["host", "device"]
#: Where framebuffers go: arrays of NumPy; the same as a `DeviceArray`; memory that CUDA shares.
Destination = Literal["host", "viewed", "cuda"]

# DLPack's types of devices and elements.
_CPU, _CUDA, _CUDA_HOST, _CUDA_MANAGED = 1, 2, 3, 13
_UINT, _FLOAT, _BFLOAT, _COMPLEX, _BOOL = 1, 2, 4, 5, 6
_DTYPES = {(_UINT, 8): "uint8", (_FLOAT, 16): "float16", (_FLOAT, 32): "float32"}
_READABLE: Final = f"{', '.join(IMAGE_DTYPES)} on the device"
_CODES = {"u": _UINT, "f": _FLOAT}
# CUDA's handle of the default stream; 0 is not one of DLPack.
LEGACY_STREAM: Final = 1


@public("vkbloom")
class DeviceArray:
    """A framebuffer that stays on the renderer's device.

    Other libraries take it without a copy: `torch.from_dlpack`, ``cupy.from_dlpack(array)`` and
    ``jax.dlpack.from_dlpack(array)``. It stays valid after the renderer is closed. Its memory is
    used again when this object and all arrays that were made of it are gone, and when the GPU has
    done all work that it had been given until then. The framebuffers of a batch lie in the same
    memory.

    On a CPU adapter the device's memory is the host's: NumPy and the libraries above view it there.

    Attributes
    ----------
    shape : tuple of int
        (H, W, C), or (H, W) for depth.
    dtype : numpy.dtype

    Examples
    --------
    >>> image = np.ones((16, 24, 3), np.float32)
    >>> final = vkbloom.apply(image, "kino", device="device")["final"]
    >>> final.shape, final.numpy().shape
    ((16, 24, 3), (16, 24, 3))
    """

    def __init__(
        self,
        memory: _core.Exported | NDArray[Any],
        shape: tuple[int, ...],
        dtype: str,
        offset: int = 0,
    ) -> None:
        self._memory = memory
        self._offset = offset  # in the memory of a batch
        self.shape = tuple(shape)
        self.dtype = np.dtype(dtype)

    @property
    def ndim(self) -> int:
        """The number of dimensions."""
        return len(self.shape)

    @property
    def size(self) -> int:
        """The number of elements."""
        return math.prod(self.shape)

    @property
    def nbytes(self) -> int:
        """The bytes of all elements."""
        return self.size * self.dtype.itemsize

    def __len__(self) -> int:
        return self.shape[0]

    def __repr__(self) -> str:
        owner = "the host" if isinstance(self._memory, np.ndarray) else "CUDA"
        return f"<vkbloom.DeviceArray {self.shape} {self.dtype} on {owner}>"

    def __reduce__(self) -> NoReturn:
        raise TypeError("a DeviceArray cannot be pickled; pickle its numpy()")

    def numpy(self) -> NDArray[Any]:
        """Return a copy in the host's memory."""
        if isinstance(self._memory, np.ndarray):
            return self._memory.copy()
        array = np.empty(self.shape, self.dtype)
        start = self._memory.address + self._offset
        self._memory.copy_bytes(array.ctypes.data, start, array.nbytes)
        return array

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        """Return a copy in the host's memory; ``copy=False`` is a ValueError."""
        if copy is False:
            raise ValueError("DeviceArray: NumPy cannot view it; use copy=None")
        array = self.numpy()
        return array if dtype is None else array.astype(dtype, copy=False)

    def __dlpack_device__(self) -> tuple[int, int]:
        """Return DLPack's type and number of the device."""
        if isinstance(self._memory, np.ndarray):
            return _CPU, 0
        return _CUDA, self._memory.ordinal

    def __dlpack__(
        self,
        *,
        stream: int | None = None,
        max_version: tuple[int, int] | None = None,
        dl_device: tuple[int, int] | None = None,
        copy: bool | None = None,
    ) -> Any:
        """Return a capsule of DLPack.

        `stream`: The consumer's, which waits for the framebuffer; None: CUDA's default stream. -1,
        no stream: this call waits.
        `max_version`: At least (1, 0) gives a capsule of DLPack 1, otherwise one of 0.
        `dl_device`: This device, or (1, 0) for a copy on the host.
        `copy`: True gives a copy.
        """
        here = self.__dlpack_device__()
        wanted = here if dl_device is None else (int(dl_device[0]), int(dl_device[1]))
        if wanted not in (here, (_CPU, 0)):
            raise BufferError(f"dl_device: {wanted} is neither the array's, {here}, nor the host")
        if here[0] == _CPU or wanted[0] == _CPU:
            if here[0] != _CPU and copy is False:
                raise BufferError("copy: False is not possible from the device to the host")
            # NumPy's own argument `copy` came later than its capsules.
            array = self.numpy() if copy or here[0] != _CPU else np.asarray(self._memory)
            options: dict[str, Any] = {} if max_version is None else {"max_version": max_version}
            return array.__dlpack__(**options)
        if stream is not None and not isinstance(stream, int):
            raise TypeError(f"stream: {stream!r} is not a number")
        if stream == 0:
            raise ValueError("stream: 0 is ambiguous; 1 is CUDA's default stream, 2 a thread's")
        memory, offset = self._memory, self._offset
        assert not isinstance(memory, np.ndarray)
        if copy:
            memory, offset = memory.clone(self.nbytes, offset), 0
        if stream == -1:
            memory.complete()
        versioned_capsule = max_version is not None and max_version[0] >= 1
        return memory.capsule(
            self.shape,
            _CODES[self.dtype.kind],
            8 * self.dtype.itemsize,
            versioned_capsule,
            offset,
            LEGACY_STREAM if stream is None else max(stream, 0),
        )

    @property
    def __cuda_array_interface__(self) -> dict[str, Any]:
        """The array for Numba and others, version 3."""
        if isinstance(self._memory, np.ndarray):
            raise AttributeError("__cuda_array_interface__: the array is on the host")
        # Not every consumer looks at the stream, so none is left to wait for.
        self._memory.complete()
        return {
            "shape": self.shape,
            "typestr": self.dtype.str,
            "data": (self._memory.address + self._offset, False),
            "strides": None,
            "stream": None,
            "version": 3,
        }


def merge(images: Iterable[DeviceArray]) -> list[DeviceArray]:
    """Return images as batches: those that follow one another in the same memory are one."""
    batches: list[tuple[DeviceArray, int]] = []
    for image in images:
        if batches:
            first, count = batches[-1]
            same = first._memory is image._memory and first.shape == image.shape
            after = first._offset + count * first.nbytes
            if same and first.dtype == image.dtype and after == image._offset:
                batches[-1] = first, count + 1
                continue
        batches.append((image, 1))
    return [
        DeviceArray(first._memory, (count, *first.shape), first.dtype.name, first._offset)
        for first, count in batches
    ]


def on_host(array: Any) -> NDArray[Any]:
    """Return an array of NumPy, copied if it is on the device."""
    return array.numpy() if isinstance(array, DeviceArray | ImportedArray) else array


def place_of(array: object) -> Destination:
    """Return where a framebuffer is."""
    if not isinstance(array, DeviceArray):
        return "host"
    return "viewed" if isinstance(array._memory, np.ndarray) else "cuda"


def _require_no_capture() -> None:
    """Raise Error if PyTorch captures a CUDA graph in this thread, before that becomes invalid.

    Memory of arrays is used again when all streams have done their work, which CUDA tells of no
    context that captures. It does not tell of captures either.
    """
    # Another thread may just import it: then parts of it are not there, and nothing is captured.
    cuda = getattr(sys.modules.get("torch"), "cuda", None)
    is_initialized = getattr(cuda, "is_initialized", None)
    if cuda is None or is_initialized is None or not is_initialized():
        return
    if cuda.is_current_stream_capturing():
        raise _core.Error(
            "CUDA graph: PyTorch's stream is being captured, and the renderer's work cannot be "
            "recorded; make the call before or after torch.cuda.graph"
        )


def memory_for(core: _core.Renderer, size: int) -> _core.Exported:
    """Return memory of the device that CUDA shares, of so many bytes."""
    _require_no_capture()
    return core.export(size)


def place(
    array: NDArray[Any], destination: Destination, core: _core.Renderer
) -> NDArray[Any] | DeviceArray:
    """Return an array of the host as if it were a framebuffer at that place."""
    if destination == "host":
        return array
    memory: _core.Exported | NDArray[Any] = array
    if destination == "cuda":
        memory = memory_for(core, array.nbytes)
        dense = np.ascontiguousarray(array)
        memory.copy_bytes(memory.address, dense.ctypes.data, dense.nbytes)
    return DeviceArray(memory, array.shape, array.dtype.name)


def on_cuda(image: object) -> bool:
    """Return whether an object is an array in the memory of a GPU with CUDA."""
    return not isinstance(image, np.ndarray) and device_kind(image) in (_CUDA, _CUDA_MANAGED)


def likeness(image: Any) -> NDArray[Any]:
    """Return an array of the host with an array's shape and dtype, of undefined content."""
    dtype = str(image.dtype).rsplit(".", 1)[-1]
    if dtype not in IMAGE_DTYPES:
        raise TypeError(f"image: dtype {dtype} is not one of {_READABLE}")
    return np.empty(tuple(image.shape), dtype)


class CudaArray(NamedTuple):
    """An array of CUDA, strides in bytes, and the stream that gets its producer's work.

    The renderer's stream, 0, waits for it.
    """

    owner: object
    address: int
    shape: tuple[int, ...]
    strides: tuple[int, ...]
    dtype: str
    stream: int = 0

    def copy(self, core: _core.Renderer, *, later: bool = False) -> ImportedArray:
        """Copy it to memory that Vulkan shares, ordered after its producer's work.

        `later`: When a submission first reads the copy, or somebody else does. The array must not
        change until then.
        """
        low, high = _span(self.shape, self.strides, self.dtype)
        memory = core.snapshot(self.address + low, high - low, self.stream, later)
        return ImportedArray(memory, -low, self.shape, self.strides, self.dtype)


class ImportedArray(NamedTuple):
    """A copy of what an array spans, in memory that Vulkan shares."""

    memory: _core.Exported
    offset: int
    shape: tuple[int, ...]
    strides: tuple[int, ...]
    dtype: str

    def at(self, index: int) -> ImportedArray:
        """Return one image of a batch."""
        offset = self.offset + index * self.strides[0]
        return self._replace(offset=offset, shape=self.shape[1:], strides=self.strides[1:])

    def plane(self, channel: int = 0) -> ImportedArray:
        """Return one channel of (H, W, C), or all of (H, W), as an image of one channel."""
        step = np.dtype(self.dtype).itemsize
        offset = self.offset + channel * (self.strides[2] if len(self.strides) == 3 else step)
        shape, strides = (*self.shape[:2], 1), (*self.strides[:2], step)
        return self._replace(offset=offset, shape=shape, strides=strides)

    def image(self) -> Any:
        """Return it as the core reads it."""
        return self.memory, self.offset, self.shape, self.strides, np.dtype(self.dtype).itemsize

    def layers(self, first: int, count: int) -> Any:
        """Return images of a batch from `first` on, as the core reads them together."""
        return *self.at(first).image(), count, self.strides[0]

    def numpy(self) -> NDArray[Any]:
        """Return the array in the host's memory."""
        low, high = _span(self.shape, self.strides, self.dtype)
        span = np.empty(high - low, np.uint8)
        start = self.memory.address + self.offset + low
        self.memory.copy_bytes(span.ctypes.data, start, span.nbytes)
        return np.ndarray(
            self.shape, self.dtype, buffer=span.data, offset=-low, strides=self.strides
        ).copy()


def _span(shape: tuple[int, ...], strides: tuple[int, ...], dtype: str) -> tuple[int, int]:
    """Return the bytes that an array touches, from its first element on."""
    reaches = [(side - 1) * stride for side, stride in zip(shape, strides, strict=True)]
    low = sum(min(reach, 0) for reach in reaches)
    return low, sum(max(reach, 0) for reach in reaches) + np.dtype(dtype).itemsize


def _check_dtype(name: str, code: int, bits: int, lanes: int) -> str:
    if lanes == 1 and (dtype := _DTYPES.get((code, bits))):
        return dtype
    if (name, code, bits, lanes) == ("mask", _BOOL, 8, 1):
        return "bool"
    kind = {_BFLOAT: "bfloat", _COMPLEX: "complex", _UINT: "uint", _FLOAT: "float"}.get(code, "int")
    hint = f"convert it: {name}.to(torch.float32) in PyTorch, {name}.astype('float32') elsewhere"
    if code == _COMPLEX:
        hint = f"take its real part or its absolute value: abs({name})"
    raise TypeError(f"{name}: dtype {kind}{bits} is not one of {_READABLE}; {hint}")


def _contiguous(shape: tuple[int, ...]) -> tuple[int, ...]:
    strides = [1]
    for side in reversed(shape[1:]):
        strides.insert(0, strides[0] * side)
    return tuple(strides[: len(shape)])


def _capsule(image: Any, stream: int) -> Any:
    """Return a capsule of DLPack that is ordered before later work of the stream."""
    try:
        return image.__dlpack__(stream=stream, max_version=(1, 0))
    except TypeError:  # the producer knows no versions of DLPack
        return image.__dlpack__(stream=stream)


def _from_dlpack(image: Any, name: str, core: _core.Renderer) -> CudaArray:
    kind, ordinal = (int(number) for number in image.__dlpack_device__())
    if kind == _CUDA_MANAGED:
        raise ValueError(
            f"{name}: it is in managed (unified) memory; copy it to the device's own memory"
        )
    ours, stream = core.cuda()
    if ordinal != ours:
        raise ValueError(
            f"{name}: it is on {core.cuda_name(ordinal)}, and the renderer is on "
            f"{core.cuda_name(ours)}; open a renderer with the array's GPU as adapter, or move the "
            "array"
        )
    # PyTorch exports only tensors of the current device.
    capsule = core.in_context(functools.partial(_capsule, image, stream))
    address, (kind, _), (code, bits, lanes), shape, strides = _core.read_dlpack(capsule)
    if kind != _CUDA:
        raise ValueError(f"{name}: its DLPack capsule is of device type {kind}, not 2 (CUDA)")
    dtype = _check_dtype(name, code, bits, lanes)
    size = np.dtype(dtype).itemsize
    elements = _contiguous(shape) if strides is None else strides
    # Modulo 2**64, since CuPy 14 divides negative strides as if they had no sign.
    in_bytes = [(size * stride + 2**63) % 2**64 - 2**63 for stride in elements]
    return CudaArray(capsule, address, shape, tuple(in_bytes), dtype)


def fill(target: Any, name: str, made: DeviceArray, core: _core.Renderer) -> None:
    """Copy a framebuffer to the caller's array on the device, after what its producer works on."""
    array = _from_dlpack(target, name, core)
    if (array.shape, array.dtype) != (made.shape, made.dtype.name):
        raise ValueError(
            f"{name} has shape {array.shape} and dtype {array.dtype}, it must have {made.shape} "
            f"and {made.dtype}"
        )
    size = made.dtype.itemsize
    if array.strides != tuple(size * stride for stride in _contiguous(made.shape)):
        raise ValueError(f"{name} must be C-contiguous")
    if isinstance(made._memory, np.ndarray):
        raise TypeError(f"{name}: the framebuffer is on the host")
    start = made._memory.address + made._offset
    made._memory.copy_bytes(array.address, start, made.nbytes)


def take(
    image: Any,
    name: str,
    core: _core.Renderer,
    sides: tuple[int, ...] = (3,),
    channels: tuple[int, ...] = (3, 4),
) -> ImportedArray:
    """Copy an array of CUDA to memory that Vulkan shares, ordered after its producer's work."""
    _require_no_capture()
    try:
        core.cuda()
    except _core.Error as error:
        if type(error) is not _core.Error:
            raise
        raise TypeError(f"{on_another_device(image, name)} ({error})") from None
    array = _from_dlpack(image, name, core)
    shape = array.shape
    if len(shape) not in sides or 0 in shape or (len(shape) > 2 and shape[-1] not in channels):
        wanted = " or ".join(f"(H, W, {count})" for count in channels) if 3 in sides else "(H, W)"
        raise ValueError(
            f"{name}: shape {shape} is not {wanted} with sides of at least 1"
            + (f"; for a batch, call map({name})" if len(shape) == 4 else "")
            + (
                f"; move the channels last: {name}.permute(1, 2, 0)"
                if len(shape) == 3 and shape[0] in (3, 4)
                else ""
            )
        )
    return array.copy(core)
