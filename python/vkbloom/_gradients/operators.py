"""The operators of PyTorch that `vkbloom.torch` calls, with what they are registered with.

An operator takes settings as text and renderers by number. A text that was made from settings, or a
number, is a constant of code that `torch.compile` made.
"""

from __future__ import annotations

import functools
import math
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple, cast

import numpy as np

from vkbloom import _core
from vkbloom._extras import import_extra
from vkbloom._gradients.passes import DeviceGradients, in_floats
from vkbloom._gradients.pulling import pull_each, undefined
from vkbloom._gradients.sums import device_fields
from vkbloom._image_arguments import check_mask
from vkbloom._psf.values import ARRAYS, ArrayValue
from vkbloom._renderer.default import default_renderer, renderer_on
from vkbloom._renderer.device_arrays import (
    LEGACY_STREAM,
    CudaArray,
    DeviceArray,
    ImportedArray,
    merge,
    take,
)
from vkbloom._renderer.frames import Frames
from vkbloom._renderer.renderer import RENDERERS, Renderer, Taken
from vkbloom._renderer.sources import Inputs, check_inputs
from vkbloom._settings.fields import fields_of
from vkbloom._settings.records import Record
from vkbloom._settings.settings import Settings
from vkbloom.reference import apply as reference_apply
from vkbloom.reference import vjp as reference_vjp
from vkbloom.reference._derivatives import check_cotangents

torch: Any = import_extra("torch", "torch", "vkbloom.torch")


@functools.lru_cache(64)
def _text(settings: Settings) -> str:
    return settings.to_json()


def text_of(settings: Settings) -> str:
    """Return settings as the text that an operator can take."""
    return _constant(_parts(settings)) if torch.compiler.is_compiling() else _text(settings)


# Dynamo calls this while it compiles. It guards on the values of the argument.
@torch.compiler.assume_constant_result  # type: ignore[untyped-decorator]
def _constant(parts: Any) -> str:
    settings: Settings = _whole(parts)
    return settings.to_json()


@torch.compiler.assume_constant_result  # type: ignore[untyped-decorator]
def _names(kind: type[Record]) -> tuple[str, ...]:
    return tuple(fields_of(kind))


def _parts(value: Any) -> Any:
    """Return settings or a value of theirs as tuples of constants, which Dynamo follows.

    It would take the object that settings were copied from for the copy.
    """
    if isinstance(value, Record):
        values = [_parts(getattr(value, name)) for name in _names(type(value))]
        return (Record, type(value), *values)
    if isinstance(value, tuple):
        return (tuple, *[_parts(part) for part in value])
    if isinstance(value, int | float) and not isinstance(value, bool):
        # Dynamo computes with other numbers as unknown ones, but not with the text of one.
        return (float, type(value), float(value).hex())
    return (ArrayValue, value.name) if isinstance(value, ArrayValue) else value


def _whole(parts: Any) -> Any:
    """Return the value of such tuples."""
    if not isinstance(parts, tuple):
        return parts
    kind, *rest = parts
    if kind is tuple:
        return tuple(map(_whole, rest))
    if kind is float:
        return rest[0](float.fromhex(rest[1]))
    if kind is ArrayValue:
        return ARRAYS[rest[0]]
    names = fields_of(rest[0])
    return rest[0](**dict(zip(names, map(_whole, rest[1:]), strict=True)))


@functools.lru_cache(64)
def _settings(text: str) -> Settings:
    return Settings.from_json(text)


class _Reads(threading.local):
    """What a thread has read for the operator that it calls next: a tensor's key, and its copy."""

    last: tuple[Any, Any] | None = None


_reads = _Reads()


def flatten(tensors: Sequence[Any]) -> Any:
    """Return all numbers of tensors as one dimension, which an operator takes; None: no tensors.

    PyTorch takes 18 us longer to call an operator with a list of tensors, and as long for its
    derivative (2.13 on a CPU, 2026-11-30). Numbers on a GPU are read together: each wait takes
    0.1 ms.
    """
    if not tensors:
        return None
    where = tensors[0].device
    # Three numbers take 1.8 us in place of 4.9 as a stack, their derivatives 15 in place of 21.
    if all(tensor.ndim == 0 and tensor.device == where for tensor in tensors):
        return torch.stack([*tensors])
    return torch.cat([tensor.to(where).reshape(-1) for tensor in tensors])


def names_of(fields: Mapping[str, Any]) -> str:
    """Return the names and the shapes of fields' tensors as the text that an operator takes."""
    return ",".join(
        name + ":" * (tensor.ndim > 0) + "x".join(map(str, tensor.shape))
        for name, tensor in fields.items()
    )


@functools.lru_cache(64)
def _shapes(names: str) -> dict[str, tuple[int, ...]]:
    """Return the shapes by name of such a text."""
    parts = (part.partition(":") for part in names.split(",") if part)
    return {name: tuple(map(int, sides.split("x"))) if sides else () for name, _, sides in parts}


def read_ahead(values: Any) -> Any:
    """Return such numbers on the host, and keep them for the next operator."""
    read = values.detach().cpu()
    # A tensor within a transform of torch.func has no address.
    try:
        key = _key_of_each(values)
    except RuntimeError:
        key = None
    _reads.last = None if key is None else (key, read)
    return read


def replace(settings: Settings, fields: str, values: Any) -> Settings:
    """Return settings with the values of `flatten`, on the host, of the fields of `names_of`."""
    if not fields:
        return settings
    given, at, array = {}, 0, values.numpy()
    for name, shape in _shapes(fields).items():
        part = array[at : at + math.prod(shape)].reshape(shape)
        given[name] = part if part.ndim == 3 else _numbers(part.tolist())
        at += part.size
    if any(isinstance(value, np.ndarray) for value in given.values()):
        return settings.replace(**given)
    return _replaced(settings, tuple(given.items()))


# Both directions of a step have the same values.
@functools.lru_cache(16)
def _replaced(settings: Settings, values: tuple[tuple[str, Any], ...]) -> Settings:
    return settings.replace(**dict(values))


def _numbers(value: Any) -> Any:
    return tuple(map(_numbers, value)) if isinstance(value, list) else value


#: The number that stands for the default renderer. Those of others begin at 1.
_DEFAULT: Final = 0


def _renderer(number: int, image: Any = None) -> Renderer:
    """Return the renderer with that number; for tensors of CUDA, the default is on their GPU."""
    if number == _DEFAULT:
        if image is None:
            return default_renderer()
        uuid = torch.cuda.get_device_properties(image.device.index).uuid
        return renderer_on(f"uuid:{uuid}")
    renderer = RENDERERS.get(number)
    if renderer is None:
        raise ValueError("renderer: it was collected; keep a reference to it until the last call")
    return renderer


def number_of(renderer: Renderer | None) -> int:
    """Return the number of a renderer that the operator takes; None: the default one.

    (Dynamo reads and guards an attribute in each version of PyTorch.)
    """
    return _DEFAULT if renderer is None else renderer._number


class _Call(NamedTuple):
    """The arguments of an operator: images, the values of fields, texts, and a renderer."""

    image: Any
    mask: Any
    emission: Any
    values: Any
    names: str
    settings: str
    renderer: int

    @property
    def images(self) -> dict[str, Any]:
        """The image, and mask and emission where they are given."""
        named = {"image": self.image, "mask": self.mask, "emission": self.emission}
        return {name: part for name, part in named.items() if part is not None}

    @property
    def fields(self) -> dict[str, tuple[int, ...]]:
        """The shapes of fields' values."""
        return _shapes(self.names)

    @property
    def on_device(self) -> bool:
        """Whether the work stays on the GPU."""
        return bool(self.image.is_cuda and self.image.dtype != torch.float64)

    def replace(self, settings: Settings) -> Settings:
        """Return settings with the values of fields, as this thread has read them for the call."""
        ahead, _reads.last = _reads.last, None
        if self.values is None:
            return settings
        is_read = ahead is not None and ahead[0] == _key_of_each(self.values)
        read = ahead[1] if ahead and is_read else self.values.detach().cpu()
        return replace(settings, self.names, read)

    def each(self) -> Iterator[tuple[tuple[int, ...], dict[str, Any], Settings]]:
        """Yield the index, the arrays and the settings of each image of a batch."""
        arrays = {
            name: part.detach().cpu().contiguous().numpy() for name, part in self.images.items()
        }
        settings = self.replace(_settings(self.settings))
        for index in np.ndindex(tuple(self.image.shape[:-3])):
            yield index, {name: part[index] for name, part in arrays.items()}, settings


def _pull(
    arrays: dict[str, Any], settings: Settings, call: _Call, cotangent: Any, by_images: bool
) -> Any:
    """Return the derivatives: of the reference for float64, else of the renderer."""
    if not np.isfinite(cotangent).all():
        return undefined(arrays, settings)
    if arrays["image"].dtype == np.float64:
        return reference_vjp(settings=settings, **arrays)[1]({"final": cotangent})
    cotangents = check_cotangents({"final": cotangent}, {"final": cotangent})
    pulled = pull_each(
        _renderer(call.renderer),
        settings,
        [(check_inputs(**arrays), cotangents)],
        call.fields,
        images=by_images,
    )
    return next(pulled)


def _key_of_each(*tensors: Any) -> tuple[Any, ...] | None:
    """Return what tensors with the same elements have in common while some of them exist.

    None: the version of an inference tensor is not known.
    """
    keys = []
    for tensor in tensors:
        if tensor is None:
            continue
        if tensor.is_inference():
            return None
        keys += [tensor.data_ptr(), tensor._version, tensor.dtype, tensor.shape, tensor.stride()]
    return tuple(keys)


def _take_forward(
    call: _Call, renderer: Renderer, settings: Settings, stream: int
) -> ImportedArray:
    """Copy the images, and keep copy and settings if a backward pass may follow.

    Each forward pass replaces them, and the backward pass of an image comes after its forward pass
    and before its memory is freed: so another image has another key. On the device, passes find
    what the forward pass has drawn of the same copy.
    """
    renderer._taken = None
    images = _take_batch(call.image, "image", renderer, stream)
    is_learned = call.image.requires_grad or (call.values is not None and call.values.requires_grad)
    if is_learned and (key := _key_of(call)) is not None:
        renderer._taken = Taken(key, images, settings)
    return images


def _key_of(call: _Call) -> Any:
    keys = _key_of_each(call.image, call.values)
    return keys and (*keys, call.names, call.settings)


_DTYPES: Final = {torch.float16: "float16", torch.float32: "float32"}


def _take_batch(tensor: Any, name: str, renderer: Renderer, stream: int) -> ImportedArray:
    """Copy a batch, which does not change within the operator, on PyTorch's stream."""
    core = renderer._core
    dtype = _DTYPES.get(tensor.dtype)
    if dtype is None or not _is_on(core, tensor):
        return take(_batch(tensor), name, core, (4,))  # which says what is wrong
    # As a tensor a batch of one would take 20 us after a wait for the GPU.
    batch = tensor if tensor.ndim == 3 else _batch(tensor)
    shape, strides = tuple(batch.shape), tuple([tensor.itemsize * one for one in batch.stride()])
    if batch.ndim == 3:
        shape, strides = (1, *shape), (0, *strides)
    array = CudaArray(batch, batch.data_ptr(), shape, strides, dtype, stream)
    # CUDA copies it when earlier passes have ended: beside passes the GPU would change between
    # both, and on an H200 a step of a convolution took 10.8 ms in place of 6.5. The core waits for
    # them when it has the plan and the memory of the call: steps in a row take 2.43 ms in place of
    # 2.64 (a pyramid), 3.62 in place of 3.80 (kino; 2026-11-29).
    return array.copy(core, later=True)


def _is_on(core: _core.Renderer, tensor: Any) -> bool:
    """Return whether an open renderer is on a tensor's GPU."""
    try:
        return not core.closed and bool(core.cuda()[0] == tensor.device.index)
    except _core.Error:
        return False


def _stream_of(tensor: Any) -> int:
    """Return PyTorch's stream on a tensor's GPU as DLPack has it."""
    # torch.cuda.current_stream makes an object of it, in 22 us after a wait for the GPU.
    return torch._C._cuda_getCurrentRawStream(tensor.device.index) or LEGACY_STREAM


def _pull_on_device(call: _Call, cotangent: Any, by_images: bool, stream: int) -> Iterator[Any]:
    """Yield the derivatives of each image, with those by images as tensors of the GPU."""
    renderer, mask = _renderer(call.renderer, call.image), call.mask
    taken, renderer._taken = renderer._taken, None
    if taken and taken.key != _key_of(call):
        taken = None
    # Before the waits, since the device still works.
    settings = taken.settings if taken else _settings_of(call)
    masks = None if mask is None else mask.detach().reshape(-1, *mask.shape[-2:]).cpu().numpy()
    images = taken.images if taken else _take_batch(call.image, "image", renderer, stream)
    emissions, cotangents = (
        None if tensor is None else _take_batch(tensor, name, renderer, stream)
        for name, tensor in (("emission", call.emission), ("cotangent", cotangent))
    )
    assert cotangents
    sequence = (
        (
            Inputs(
                images.at(index),
                emissions.at(index) if emissions else None,
                None if masks is None else check_mask(masks[index], masks.shape[1:]),
            ),
            {"final": cotangents.at(index)},
        )
        for index in range(images.shape[0])
    )
    # Beside values on the host, or derivatives that the host computes, the host waits.
    stays = call.values is not None and call.values.is_cuda
    stays = stays and device_fields(settings).issuperset(call.fields)
    yield from pull_each(
        renderer,
        settings,
        sequence,
        call.fields,
        "cuda",
        images=by_images,
        sums_destination="cuda" if stays else "host",
    )


def _settings_of(call: _Call) -> Settings:
    return call.replace(in_floats(_settings(call.settings)))


def _batch(tensor: Any) -> Any:
    return tensor.detach().reshape(-1, *tensor.shape[-3:])


def _operator(name: str, function: Callable[..., Any], parameters: str, result: str) -> Any:
    """Return the operator of a function.

    One of PyTorch's decorator for custom operators takes 22 us in place of 20 forward, and 23 in
    place of 17 backward (2.13 on a CPU, 2026-11-30): it compares the results with the arguments.
    """
    schema = f"{name}({parameters}Tensor image, Tensor? mask, Tensor? emission, "
    schema += f"Tensor? values, str names, str settings, int renderer) -> {result}"
    _LIBRARY.define(schema, **_TAGS)
    _LIBRARY.impl(name, function, "CompositeExplicitAutograd")
    return getattr(torch.ops.vkbloom, name).default


#: Holds the operators.
_LIBRARY: Final[Any] = torch.library.Library("vkbloom", "FRAGMENT")
#: What `torch.compile` must not put into a graph of CUDA. (PyTorch has the tag since 2.8.)
_TAGS: Final[dict[str, Any]] = (
    {"tags": (torch.Tag.cudagraph_unsafe,)} if hasattr(torch.Tag, "cudagraph_unsafe") else {}
)


def refuse_capture(image: Any) -> None:
    """Raise RuntimeError in a capture, whose graph would leave out what Vulkan does."""
    if image.is_cuda and torch.cuda.is_current_stream_capturing():
        raise RuntimeError(
            "vkbloom::bloom: a CUDA graph cannot hold it, since Vulkan computes it; capture the "
            "parts of the step before and after it"
        )


def refuse_tangents(tensors: Iterable[Any]) -> None:
    """Raise RuntimeError in forward mode: PyTorch would take the operator for a constant."""
    for tensor in tensors:
        if tensor is not None and torch.autograd.forward_ad.unpack_dual(tensor).tangent is not None:
            raise RuntimeError(
                "vkbloom::bloom: derivatives of forward mode (torch.func.jvp, jacfwd, forward_ad) "
                "are not implemented; those of reverse mode are exact, so compute with backward() "
                "or torch.autograd.grad"
            )


def _draw(*given: Any) -> Any:
    call = _Call(*given)
    image = call.image
    refuse_capture(image)
    if call.on_device:
        return _on_device(call)
    final = torch.empty(image.shape, dtype=image.dtype).numpy()
    for index, arrays, chosen in call.each():
        pixels = arrays.pop("image")
        if pixels.dtype == np.float64:
            final[index] = reference_apply(pixels, chosen, **arrays)["final"]
        else:
            frames = _renderer(call.renderer).apply(
                pixels, in_floats(chosen), framebuffers="final", **arrays
            )
            final[index] = frames["final"]
    return torch.from_numpy(final).to(image.device)


def _on_device(call: _Call) -> Any:
    """Run the operator without the host; a batch without masks changes the context once."""
    settings, renderer = _settings_of(call), _renderer(call.renderer, call.image)
    count, stream = call.image.shape[:-3].numel(), _stream_of(call.image)
    frames: Iterable[Frames]
    if call.mask is None and call.emission is None and count > 1:
        renderer._taken = None
        frames = renderer.map(_batch(call.image), settings, framebuffers="final")
    elif call.mask is None and call.emission is None and count == 1:
        inputs = Inputs(_take_forward(call, renderer, settings, stream).at(0))
        final = renderer._apply_inputs(inputs, settings, ("final",))["final"]
        return _join([_as_tensor(final, stream)], call.image)
    else:
        renderer._taken = None
        masks, emissions = (
            [None] * count
            if tensor is None
            else tensor.detach().reshape(-1, *tensor.shape[-sides:])
            for tensor, sides in ((call.mask, 2), (call.emission, 3))
        )
        frames = (
            renderer.apply(
                tensor, settings, mask=masks[i], emission=emissions[i], framebuffers="final"
            )
            for i, tensor in enumerate(_batch(call.image))
        )
    # The images of a batch are in the same memory.
    batches = merge([cast("DeviceArray", tensor["final"]) for tensor in frames])
    return _join([_as_tensor(batch, stream) for batch in batches], call.image, torch.cat)


_bloom: Final[Any] = _operator("bloom", _draw, "", "Tensor")


@torch.library.register_fake(_bloom, lib=_LIBRARY)  # type: ignore[untyped-decorator]
def _(image: Any, *rest: Any) -> Any:
    return torch.empty(image.shape, dtype=image.dtype, device=image.device)


def _differentiate(cotangent: Any, by_images: bool, *given: Any) -> tuple[Any, ...]:
    """Return the derivatives by image, mask, emission and values; without elements: of none.

    Of a batch, the derivatives by values are added. Without `by_images` they are by values alone.
    """
    call = _Call(*given)
    refuse_capture(call.image)
    images = call.images if by_images else {}
    derivatives: dict[str, list[Any]] = {name: [] for name in images}
    values: list[Any] = []
    stream = None
    # An empty batch has nothing to take to the device.
    if call.on_device and call.image.numel() > 0:
        stream = _stream_of(call.image)
        pulled = _pull_on_device(call, cotangent, by_images, stream)
    else:
        wanted = cotangent.detach().cpu().numpy()
        pulled = (
            _pull(arrays, chosen, call, wanted[index], by_images)
            for index, arrays, chosen in call.each()
        )
    for gradients in pulled:
        for name, parts in derivatives.items():
            parts.append(_as_tensor(gradients[name], stream))
        if call.values is not None:
            values.append(_by_values(gradients, call, stream))
    return (
        *(
            _join(derivatives[name], images[name]) if name in images else torch.empty(0)
            for name in ("image", "mask", "emission")
        ),
        torch.empty(0) if call.values is None else _sum(values, call.values),
    )


def _by_values(gradients: Any, call: _Call, stream: int | None) -> Any:
    """Return the derivatives by values as float64, combined where the sums are."""
    if isinstance(gradients, DeviceGradients) and gradients.sums_for:
        sums = gradients.sums_for(call.fields)
        if sums.arrays and [*sums.factors] == [*call.fields]:
            # Few calls: one takes 20 to 30 us after a wait for the GPU. So an infinite channel
            # makes all derivatives NaN, also those that do not need it.
            each = [_as_tensor(part, stream)[0, 0] for part in sums.arrays]
            by_channel = each[0] if len(each) == 1 else torch.cat(each)
            width = by_channel.numel()
            rows = np.concatenate([part.reshape(-1, width) for part in sums.factors.values()])
            factors = torch.from_numpy(rows).to(by_channel.device, non_blocking=True)
            return (factors * by_channel).sum(1)
    # Of numbers, the host waits for the device.
    numbers = [np.asarray(gradients[name], np.float64).reshape(-1) for name in call.fields]
    return torch.from_numpy(np.concatenate(numbers))


def _sum(parts: list[Any], like: Any) -> Any:
    """Return the sum of tensors as one of the kind of another; without any, 0."""
    return (sum(parts[1:], parts[0]) if parts else torch.zeros_like(like)).to(like)


def _as_tensor(part: Any, stream: int | None) -> Any:
    """Return an array as a tensor; PyTorch's stream waits for one on its GPU."""
    if isinstance(part, DeviceArray):
        return torch.from_dlpack(part.__dlpack__(stream=stream))
    return torch.from_numpy(np.array(part, np.float64))


def _join(parts: list[Any], like: Any, join: Any = None) -> Any:
    """Return images, or with `join` batches, as a tensor of the kind of another one."""
    if not parts:
        return like.new_zeros(like.shape)
    joined = parts[0] if len(parts) == 1 else (join or torch.stack)(parts)
    # Also where both do nothing they take 20 us after a wait for the GPU.
    is_like = (joined.shape, joined.dtype, joined.device) == (like.shape, like.dtype, like.device)
    return joined if is_like else joined.reshape(like.shape).to(like)


_bloom_backward: Final[Any] = _operator(
    "bloom_backward",
    _differentiate,
    "Tensor cotangent, bool by_images, ",
    "(Tensor, Tensor, Tensor, Tensor)",
)


@torch.library.register_fake(_bloom_backward, lib=_LIBRARY)  # type: ignore[untyped-decorator]
def _(cotangent: Any, by_images: bool, *given: Any) -> tuple[Any, ...]:
    image, mask, emission, values, *_ = given
    return tuple(
        torch.empty(0)
        if part is None
        else torch.empty(part.shape, dtype=part.dtype, device=part.device)
        for part in (*((image, mask, emission) if by_images else (None,) * 3), values)
    )


def _keep(ctx: Any, inputs: tuple[Any, ...], output: Any) -> None:
    *tensors, ctx.names, ctx.settings, ctx.number = inputs
    # Held until the backward pass, also if the caller lets it go before.
    ctx.renderer = RENDERERS.get(ctx.number)
    ctx.save_for_backward(*tensors)


def _back(ctx: Any, cotangent: Any) -> tuple[Any, ...]:
    inputs = ctx.saved_tensors
    # A step that learns fields alone needs none of the others.
    by_images = any(ctx.needs_input_grad[:3])
    derivatives = _bloom_backward(
        cotangent, by_images, *inputs, ctx.names, ctx.settings, ctx.number
    )
    wanted = (by_images, by_images, by_images, True)
    return (
        *(
            derivative if part is not None and is_wanted else None
            for derivative, part, is_wanted in zip(derivatives, inputs, wanted, strict=True)
        ),
        None,
        None,
        None,
    )


def _refuse(ctx: Any, *cotangents: Any) -> Any:
    raise RuntimeError(
        "vkbloom::bloom: its second derivative is not implemented; the first is exact, so compute "
        "without create_graph=True"
    )


torch.library.register_autograd(_bloom, _back, setup_context=_keep, lib=_LIBRARY)
torch.library.register_autograd(_bloom_backward, _refuse, lib=_LIBRARY)


class VkbloomBloom(torch.autograd.Function):  # type: ignore[misc]
    """What the operator computes, beside PyTorch's dispatcher; profilers show its name."""

    @staticmethod
    def forward(ctx: Any, *inputs: Any) -> Any:
        _keep(ctx, inputs, None)
        return _draw(*inputs)

    backward = staticmethod(_back)


_PLAIN: Final = {torch.Tensor, torch.nn.Parameter, type(None)}


def draw(*inputs: Any) -> Any:
    """Call the operator; of plain tensors, which nothing else looks at, without the dispatcher.

    Where the caches are cold, as after a wait for a GPU, a call with a derivative takes 62 us in
    place of 140 to 176 (2.13, an operator that does nothing on a CPU, 2026-11-30).
    """
    # Dynamo traces no further than the first condition.
    if torch.compiler.is_compiling() or _is_watched(inputs[:4]):
        return _bloom(*inputs)
    return VkbloomBloom.apply(*inputs)


def _is_watched(tensors: Iterable[Any]) -> bool:
    """Return whether a trace, a transform, a mode or a subclass looks at operators."""
    return (
        torch.jit.is_tracing()
        or torch._C._are_functorch_transforms_active()
        or torch._C._len_torch_dispatch_stack() > 0
        or not all(type(one) in _PLAIN for one in tensors)
    )
