"""The operators of PyTorch that `vkbloom.torch` calls, with what they are registered with.

An operator takes settings as text and renderers by number. A text that was made from settings, or a
number, is a constant of code that `torch.compile` made.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

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

#: The most tensors that are read one by one.
_FEW: Final = 8


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


def flatten(tensors: Sequence[Any]) -> Any:
    """Return all numbers of tensors as one dimension, which an operator takes; None: no tensors.

    PyTorch takes 18 us longer to call an operator with a list of tensors, and as long for its
    derivative (2.13 on a CPU, 2026-11-30).
    """
    if not tensors:
        return None
    where = tensors[0].device
    # Three numbers take 1.8 us in place of 4.9 as a stack, their derivatives 15 in place of 21.
    if _are_numbers(tensors) and all(tensor.device == where for tensor in tensors):
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


def read(tensors: Sequence[Any]) -> NDArray[Any]:
    """Return all numbers of tensors as an array of one dimension on the host."""
    # After a wait for the GPU three numbers take 46 us in place of 111, eight 92 in place of 123
    # (H200, 2026-11-30).
    if len(tensors) <= _FEW:
        parts = [_number(tensor) for tensor in tensors]
        return np.array(parts) if _are_numbers(tensors) else np.hstack(parts)
    with torch.no_grad():
        return _on_host(flatten(tensors))


def _are_numbers(tensors: Iterable[Any]) -> bool:
    return all(tensor.ndim == 0 for tensor in tensors)


def _number(tensor: Any) -> Any:
    """Return the number of a tensor without dimensions, or an array of one dimension."""
    return tensor.item() if tensor.ndim == 0 else _on_host(tensor).reshape(-1)


def _on_host(tensor: Any) -> NDArray[Any]:
    copy = tensor.detach().cpu()
    array: NDArray[Any] = (copy.float() if copy.dtype == torch.bfloat16 else copy).numpy()
    return array


def values_of(names: str, numbers: NDArray[Any]) -> dict[str, Any]:
    """Return the values of the fields of `names_of`, whose numbers `read` has returned."""
    shapes, values, at = _shapes(names), {}, 0
    if not any(shapes.values()):
        return dict(zip(shapes, numbers.tolist(), strict=True))
    for name, shape in shapes.items():
        part = numbers[at : at + math.prod(shape)].reshape(shape)
        values[name] = part if part.ndim == 3 else _numbers(part.tolist())
        at += part.size
    return values


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
    """What is drawn or differentiated.

    - `settings`: With the values of the fields.
    - `fields`: The shapes of the fields that are tensors.
    - `number`: The renderer's.
    - `on_gpu`: Whether the fields' tensors are on a GPU.
    - `key`: What the forward and the backward pass of a call have in common, and no other call.
      None: no backward pass follows, or it is not known.
    """

    image: Any
    mask: Any
    emission: Any
    settings: Settings
    fields: dict[str, tuple[int, ...]]
    number: int
    on_gpu: bool
    key: Any

    @property
    def images(self) -> dict[str, Any]:
        """The image, and mask and emission where they are given."""
        named = {"image": self.image, "mask": self.mask, "emission": self.emission}
        return {name: part for name, part in named.items() if part is not None}

    @property
    def on_device(self) -> bool:
        """Whether the work stays on the GPU."""
        return bool(self.image.is_cuda and self.image.dtype != torch.float64)

    @property
    def renderer(self) -> Renderer:
        """The open renderer; for tensors of CUDA, the default is on their GPU."""
        return _renderer(self.number, self.image if self.on_device else None)

    def each(self) -> Iterator[tuple[tuple[int, ...], dict[str, Any]]]:
        """Yield the index and the arrays of each image of a batch."""
        arrays = {
            name: part.detach().cpu().contiguous().numpy() for name, part in self.images.items()
        }
        for index in np.ndindex(tuple(self.image.shape[:-3])):
            yield index, {name: part[index] for name, part in arrays.items()}


@functools.lru_cache(16)
def _replaced(text: str, in_doubles: bool, values: tuple[tuple[str, Any], ...]) -> Settings:
    settings = _settings(text)
    if not in_doubles:
        settings = in_floats(settings)
    return settings._replaced(dict(values)) if values else settings


def _chosen(text: str, names: str, numbers: Any, in_doubles: bool) -> Settings:
    """Return the settings of a text, with the numbers that `read` has returned, if names are given.

    Calls with the same numbers get the same object, whose plan is kept.
    """
    values = values_of(names, numbers) if names else {}
    arrays = {name: value for name, value in values.items() if isinstance(value, np.ndarray)}
    others = tuple([one for one in values.items() if one[0] not in arrays])
    # Arrays may be large: they are not kept.
    settings = _replaced(text, in_doubles, others)
    return settings._replaced(arrays) if arrays else settings


def _call_of_operator(given: tuple[Any, ...], *, goes_back: bool) -> _Call:
    """Return what the arguments of an operator stand for."""
    image, mask, emission, values, names, text, number = given
    refuse_capture(image)
    key = _key_of_each(image, values)
    key = key and (*key, names, text)
    on_gpu = values is not None and values.is_cuda
    call = _Call(image, mask, emission, _settings(text), _shapes(names), number, on_gpu, key)
    taken = call.renderer._taken if goes_back and call.on_device else None
    if taken and taken.key == key:
        # The device still works: no wait for the values.
        return call._replace(settings=taken.settings)
    numbers = read(() if values is None else (values,))
    return call._replace(settings=_chosen(text, names, numbers, image.dtype == torch.float64))


def _pull(arrays: dict[str, Any], call: _Call, cotangent: Any, by_images: bool) -> Any:
    """Return the derivatives: of the reference for float64, else of the renderer."""
    settings = call.settings
    if not np.isfinite(cotangent).all():
        return undefined(arrays, settings)
    if arrays["image"].dtype == np.float64:
        return reference_vjp(settings=settings, **arrays)[1]({"final": cotangent})
    cotangents = check_cotangents({"final": cotangent}, {"final": cotangent})
    pulled = pull_each(
        call.renderer,
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


def _take_forward(call: _Call, renderer: Renderer, stream: int) -> ImportedArray:
    """Copy the images, and keep copy and settings if a backward pass may follow.

    Each forward pass replaces them, and the backward pass of an image comes after its forward pass
    and before its memory is freed: so another image has another key. On the device, passes find
    what the forward pass has drawn of the same copy.
    """
    renderer._taken = None
    images = _take_batch(call.image, "image", renderer, stream)
    if call.key is not None:
        renderer._taken = Taken(call.key, images, call.settings)
    return images


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
    renderer, settings, mask = call.renderer, call.settings, call.mask
    taken, renderer._taken = renderer._taken, None
    if taken and taken.key != call.key:
        taken = None
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
    stays = call.on_gpu and device_fields(settings).issuperset(call.fields)
    yield from pull_each(
        renderer,
        settings,
        sequence,
        call.fields,
        "cuda",
        images=by_images,
        sums_destination="cuda" if stays else "host",
    )


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


def _bloom_of(*given: Any) -> Any:
    call = _call_of_operator(given, goes_back=False)
    is_learned = any(one is not None and one.requires_grad for one in (given[0], given[3]))
    return _draw(call if is_learned else call._replace(key=None))


def _draw(call: _Call) -> Any:
    image = call.image
    refuse_capture(image)
    if call.on_device:
        return _on_device(call)
    final = torch.empty(image.shape, dtype=image.dtype).numpy()
    for index, arrays in call.each():
        pixels = arrays.pop("image")
        if pixels.dtype == np.float64:
            final[index] = reference_apply(pixels, call.settings, **arrays)["final"]
        else:
            frames = call.renderer.apply(pixels, call.settings, framebuffers="final", **arrays)
            final[index] = frames["final"]
    return torch.from_numpy(final).to(image.device)


def _on_device(call: _Call) -> Any:
    """Run the operator without the host; a batch without masks changes the context once."""
    settings, renderer = call.settings, call.renderer
    count, stream = call.image.shape[:-3].numel(), _stream_of(call.image)
    frames: Iterable[Frames]
    if call.mask is None and call.emission is None and count > 1:
        renderer._taken = None
        frames = renderer.map(_batch(call.image), settings, framebuffers="final")
    elif call.mask is None and call.emission is None and count == 1:
        inputs = Inputs(_take_forward(call, renderer, stream).at(0))
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


_bloom: Final[Any] = _operator("bloom", _bloom_of, "", "Tensor")


@torch.library.register_fake(_bloom, lib=_LIBRARY)  # type: ignore[untyped-decorator]
def _(image: Any, *rest: Any) -> Any:
    return torch.empty(image.shape, dtype=image.dtype, device=image.device)


def _bloom_backward_of(cotangent: Any, by_images: bool, *given: Any) -> tuple[Any, ...]:
    """Return the derivatives by image, mask, emission and values; without elements: of none."""
    call = _call_of_operator(given, goes_back=True)
    *by_image, by_values = _differentiate(call, cotangent, by_images)
    if by_values is not None:
        by_values = by_values.to(given[3])
    return tuple(torch.empty(0) if one is None else one for one in (*by_image, by_values))


def _differentiate(call: _Call, cotangent: Any, by_images: bool) -> tuple[Any, ...]:
    """Return the derivatives by image, mask, emission and values; None: there are none.

    Of a batch, the derivatives by values are added. Without `by_images` they are by values alone.
    """
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
        pulled = (_pull(arrays, call, wanted[index], by_images) for index, arrays in call.each())
    for gradients in pulled:
        for name, parts in derivatives.items():
            parts.append(_as_tensor(gradients[name], stream))
        if call.fields:
            values.append(_by_values(gradients, call, stream))
    return (
        *(
            _join(derivatives[name], images[name]) if name in images else None
            for name in ("image", "mask", "emission")
        ),
        _sum(values, call) if call.fields else None,
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


def _sum(parts: list[Any], call: _Call) -> Any:
    """Return the sum of derivatives by values; without any, 0."""
    if parts:
        return sum(parts[1:], parts[0])
    return torch.zeros(sum(map(math.prod, call.fields.values())), dtype=torch.float64)


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
    _bloom_backward_of,
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
    *by_image, by_values = _bloom_backward(
        cotangent, by_images, *inputs, ctx.names, ctx.settings, ctx.number
    )
    by_values = None if inputs[3] is None else by_values
    return *_of_images(by_image, inputs[:3], by_images), by_values, None, None, None


def _of_images(derivatives: list[Any], images: Iterable[Any], by_images: bool) -> list[Any]:
    """Return the derivatives by image, mask and emission; None for those that are not given."""
    pairs = zip(derivatives, images, strict=True)
    return [one if by_images and image is not None else None for one, image in pairs]


def _refuse(ctx: Any, *cotangents: Any) -> Any:
    raise RuntimeError(
        "vkbloom::bloom: its second derivative is not implemented; the first is exact, so compute "
        "without create_graph=True"
    )


torch.library.register_autograd(_bloom, _back, setup_context=_keep, lib=_LIBRARY)
torch.library.register_autograd(_bloom_backward, _refuse, lib=_LIBRARY)


class VkbloomBloom(torch.autograd.Function):  # type: ignore[misc]
    """What the operator computes, beside PyTorch's dispatcher; profilers show its name.

    Of parameters only what was read is kept: they may change before the backward pass.
    """

    @staticmethod
    def forward(ctx: Any, *inputs: Any) -> Any:
        *images, ctx.rest, ctx.given, ctx.numbers = inputs[:6]
        ctx.save_for_backward(*images)
        ctx.kinds = [(one.shape, one.dtype, one.device) for one in inputs[6:]]
        call = _Call(*images, *ctx.rest)
        # Held until the backward pass, also if the caller lets it go before.
        ctx.renderer = RENDERERS.get(call.number)
        return _draw(call)

    @staticmethod
    def backward(ctx: Any, cotangent: Any) -> tuple[Any, ...]:
        images, by_images = ctx.saved_tensors, any(ctx.needs_input_grad[:3])
        # The operator refuses second derivatives, and is there for what looks at operators.
        if torch.is_grad_enabled() or _is_watched((cotangent, *images)) or _is_batched(cotangent):
            values = None
            if ctx.kinds:
                values = torch.tensor(ctx.numbers).to(cotangent.device)
                # Or a second derivative by parameters alone would be 0, and not refused.
                values.requires_grad_(any(ctx.needs_input_grad[6:]))
            found = _bloom_backward(cotangent, by_images, *images, values, *ctx.given)
        else:
            found = _differentiate(_Call(*images, *ctx.rest), cotangent, by_images)
        *by_image, by_values = found
        rest = None, None, None
        return *_of_images(by_image, images, by_images), *rest, *_split(by_values, ctx.kinds)


def _is_batched(tensor: Any) -> bool:
    """Return whether it is of the vmap by which autograd takes a batch of cotangents."""
    return not torch._C._has_storage(tensor)


def _split(values: Any, kinds: list[tuple[Any, Any, Any]]) -> Iterator[Any]:
    """Yield the derivatives by each parameter, of its shape, dtype and device."""
    if not kinds:
        return
    # One conversion for all. Of several kinds each is converted from doubles.
    if len({kind[1:] for kind in kinds}) == 1:
        values = values.to(kinds[0][2], kinds[0][1])
    parts = values.split([shape.numel() for shape, _, _ in kinds])
    for part, (shape, dtype, device) in zip(parts, kinds, strict=True):
        yield part.reshape(shape).to(device, dtype)


_PLAIN: Final = {torch.Tensor, torch.nn.Parameter, type(None)}


def draw(
    images: tuple[Any, Any, Any],
    given: tuple[str, str, int],
    parameters: Sequence[Any],
    numbers: NDArray[Any] | None,
) -> Any:
    """Call the operator; of plain tensors, which nothing else looks at, without the dispatcher.

    Where the caches are cold, as after a wait for a GPU, a call with a derivative takes 62 us in
    place of 140 to 176 (2.13, an operator that does nothing on a CPU, 2026-11-30).

    `given`: What `names_of`, `text_of` and `number_of` return. `numbers`: Of the parameters, as
    `read` returns them; None: there are none, or Dynamo traces.
    """
    # Dynamo traces no further than the first condition.
    if torch.compiler.is_compiling() or _is_watched((*images, *parameters)):
        return _bloom(*images, flatten(parameters), *given)
    names, text, number = given
    settings = _chosen(text, names, numbers, images[0].dtype == torch.float64)
    on_gpu = bool(parameters) and all(one.is_cuda for one in parameters)
    is_learned = any(one is not None and one.requires_grad for one in (*images, *parameters))
    key = object() if is_learned and torch.is_grad_enabled() else None
    rest = settings, _shapes(names), number, on_gpu, key
    return VkbloomBloom.apply(*images, rest, given, numbers, *parameters)


def _is_watched(tensors: Iterable[Any]) -> bool:
    """Return whether a trace, a transform, a mode or a subclass looks at operators."""
    return (
        torch.jit.is_tracing()
        or torch._C._are_functorch_transforms_active()
        or torch._C._len_torch_dispatch_stack() > 0
        or not all(type(one) in _PLAIN for one in tensors)
    )
