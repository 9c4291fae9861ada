"""Bloom as an operator of PyTorch, with its derivatives.

Tensors of float64 are computed by `vkbloom.reference`, all others by a renderer. The bloom buffers
are "rgba32float".

Examples
--------
>>> import torch
>>> import vkbloom.torch
>>> image = torch.full((8, 8, 3), 0.5, requires_grad=True)
>>> final = vkbloom.torch.bloom(image, vkbloom.Pyramid(levels=1, intensity=0.5))
>>> final.sum().backward()
>>> round(float(image.grad.mean()), 4)
1.5
"""

from __future__ import annotations

import functools
import threading
import weakref
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, cast

import numpy as np

from vkbloom.checks import check_mask, import_extra
from vkbloom.core_access import core_of
from vkbloom.device_arrays import DeviceArray, merged, take
from vkbloom.gradients import pull_each, pullback_of
from vkbloom.reference import apply as reference_apply
from vkbloom.reference import vjp as reference_vjp
from vkbloom.reference.derivatives import check_cotangents, differentiable
from vkbloom.renderer import Renderer
from vkbloom.settings import Settings, check_settings, field_info
from vkbloom.sources import Inputs, checked_inputs

torch: Any = import_extra("torch", "torch", "vkbloom.torch")

__all__ = ["Bloom", "bloom"]


def bloom(
    image: Any,
    settings: Settings,
    *,
    mask: Any = None,
    emission: Any = None,
    renderer: Renderer | None = None,
    channels_first: bool = False,
) -> Any:
    """Add bloom to tensors.

    Parameters
    ----------
    image : Tensor, shape (..., H, W, C)
        Linear light with 3 or 4 channels, of float16, float32 or float64. Those of float64 are
        computed in NumPy by `vkbloom.reference`, all others by the renderer. Tensors of CUDA, and
        the derivatives by them, stay on their GPU; only a mask, whose values are checked on the
        host, and what `Renderer.vjp` takes from the reference go through the host.
    settings : Settings
        `Settings.format` is not read: the bloom buffers are "rgba32float".
    mask : Tensor, shape (..., H, W), optional
        As for `Renderer.apply`, with the image's leading dimensions.
    emission : Tensor, optional
        Of the image's shape and dtype.
    renderer : Renderer, optional
        Default: one that this module opens at the first call, for tensors of CUDA on their GPU.
    channels_first : bool
        Whether image, emission and result have the shape (..., C, H, W).

    Returns
    -------
    Tensor
        ``final``, of the image's shape, dtype and device.

    Raises
    ------
    ValueError, TypeError
        As for `Renderer.apply` and `Renderer.vjp`.
    RuntimeError
        From a backward pass: a second derivative was asked for.

    See Also
    --------
    Bloom : The same as a module, which can learn fields of the settings.
    vkbloom.Renderer.vjp : The derivatives as arrays.

    Notes
    -----
    The operator is ``torch.ops.vkbloom.bloom``, with a fake kernel, so `torch.compile` does not
    look into it.

    Examples
    --------
    >>> image = torch.rand(2, 3, 16, 16)
    >>> vkbloom.torch.bloom(image, vkbloom.Pyramid(levels=2), channels_first=True).shape
    torch.Size([2, 3, 16, 16])
    """
    settings = check_settings(settings, of_image=True)
    return _call(
        image,
        settings,
        {},
        mask=mask,
        emission=emission,
        renderer=renderer,
        channels_first=channels_first,
    )


class Bloom(torch.nn.Module):  # type: ignore[misc]
    """Bloom as a module of PyTorch.

    Parameters
    ----------
    settings : Settings
        Where learning starts, and the fields that stay as they are.
    learn : sequence of str
        The fields that are parameters of the module: real ones, such as "intensity",
        "level_weights" or "glare.0.intensity".
    renderer, channels_first
        As for `bloom`.

    Raises
    ------
    ValueError
        A field has no derivative, or is None.

    See Also
    --------
    bloom : The function.

    Notes
    -----
    An optimizer may move a parameter out of the range of its field. Each call moves it back to the
    nearest end.

    Examples
    --------
    >>> module = vkbloom.torch.Bloom(vkbloom.Pyramid(levels=2), learn=("intensity",))
    >>> [name for name, _ in module.named_parameters()]
    ['learned.intensity']
    >>> module(torch.rand(16, 16, 3)).shape
    torch.Size([16, 16, 3])
    """

    def __init__(
        self,
        settings: Settings,
        learn: tuple[str, ...] = (),
        *,
        renderer: Renderer | None = None,
        channels_first: bool = False,
    ) -> None:
        super().__init__()
        self._start = check_settings(settings, of_image=True)
        self._names = (learn,) if isinstance(learn, str) else tuple(learn)
        self._renderer = renderer
        self._channels_first = channels_first
        known = differentiable(self._start)
        for name in self._names:
            if name not in known:
                raise ValueError(
                    f"learn: {name!r} of the method {self._start.method} has no derivative; those "
                    f"with one are {', '.join(known)}"
                )
        # The names of parameters have no dots.
        self.learned = torch.nn.ParameterDict(
            {name.replace(".", "_"): torch.tensor(known[name]) for name in self._names}
        )

    @property
    def settings(self) -> Settings:
        """The settings with what was learned."""
        return _replaced(self._start, dict(zip(self._names, self._values(), strict=True)))

    def forward(self, image: Any, *, mask: Any = None, emission: Any = None) -> Any:
        """Add bloom, as `bloom` does."""
        values = dict(zip(self._names, self._values(), strict=True))
        return _call(
            image,
            self._start,
            values,
            mask=mask,
            emission=emission,
            renderer=self._renderer,
            channels_first=self._channels_first,
        )

    def _values(self) -> list[Any]:
        """Return the parameters, moved into the ranges of their fields."""
        parameters = [self.learned[name.replace(".", "_")] for name in self._names]
        with torch.no_grad():
            for name, parameter in zip(self._names, parameters, strict=True):
                if (ends := field_info(self._start, name).range) is not None:
                    parameter.clamp_(*ends)
        return parameters


def _call(
    image: Any,
    settings: Settings,
    values: dict[str, Any],
    *,
    mask: Any,
    emission: Any,
    renderer: Renderer | None,
    channels_first: bool,
) -> Any:
    """Run the operator; `values` are tensors of fields."""
    for name, tensor in (("image", image), ("mask", mask), ("emission", emission)):
        if tensor is not None and not isinstance(tensor, torch.Tensor):
            raise TypeError(f"{name}: a tensor is needed, not {type(tensor).__name__}")
    _check(image, mask, emission, channels_first)
    if channels_first:
        image = image.movedim(-3, -1)
        emission = None if emission is None else emission.movedim(-3, -1)
    final = torch.ops.vkbloom.bloom(
        image,
        mask,
        emission,
        [*values.values()],
        ",".join(values),
        _text(settings),
        _number(renderer),
    )
    return final.movedim(-1, -3) if channels_first else final


def _check(image: Any, mask: Any, emission: Any, channels_first: bool) -> None:
    """Check shapes, dtypes and devices, so that errors come from the call and not the operator."""
    shape = tuple(image.shape)
    order = "(..., C, H, W)" if channels_first else "(..., H, W, C)"
    if len(shape) < 3 or shape[-3 if channels_first else -1] not in (3, 4):
        text = f"image: the shape {shape} is not {order} with 3 or 4 channels"
        if len(shape) >= 3 and shape[-1 if channels_first else -3] in (3, 4):
            text += f"; give channels_first={not channels_first}"
        raise ValueError(text)
    if not image.is_floating_point():
        raise TypeError(f"image: {image.dtype} has no derivative; give floats of linear light")
    if image.dtype == torch.bfloat16:
        raise TypeError(
            "image: dtype torch.bfloat16 is not one of floats that NumPy has, float16, "
            "float32, float64; convert it: image.float()"
        )
    if emission is not None and (emission.shape, emission.dtype) != (image.shape, image.dtype):
        raise ValueError(
            f"emission: {tuple(emission.shape)} of {emission.dtype} is not the image's "
            f"{shape} of {image.dtype}"
        )
    sides = (*shape[:-3], *(shape[-2:] if channels_first else shape[-3:-1]))
    if mask is not None and tuple(mask.shape) != sides:
        raise ValueError(f"mask: the shape {tuple(mask.shape)} is not {sides}")
    for name, tensor in (("mask", mask), ("emission", emission)):
        if tensor is not None and tensor.device != image.device:
            raise ValueError(f"{name}: its device {tensor.device} is not the image's")


@functools.lru_cache(64)
def _text(settings: Settings) -> str:
    """Return settings as the text that an operator can take."""
    return settings.to_json()


@functools.lru_cache(64)
def _settings(text: str) -> Settings:
    return Settings.from_json(text)


@functools.lru_cache(64)
def _in_floats(text: str) -> Settings:
    """Return settings whose bloom buffers are floats; the same object, whose plan is kept."""
    return _settings(text).replace(format="rgba32float")


def _replaced(settings: Settings, values: Mapping[str, Any]) -> Settings:
    """Return settings with the values of tensors."""
    return settings.replace(
        **{name: _field_value(value.detach().cpu().tolist()) for name, value in values.items()}
    )


def _field_value(value: Any) -> Any:
    return tuple(map(_field_value, value)) if isinstance(value, list) else value


#: Renderers by the number that the operator takes; `_OWN` is the one of this module.
_RENDERERS: Final[weakref.WeakValueDictionary[int, Renderer]] = weakref.WeakValueDictionary()
_OWN: Final = 0
_opening: Final = threading.Lock()


@functools.cache
def _own_renderer() -> Renderer:
    return Renderer()


@functools.cache
def _renderer_on(index: int) -> Renderer:
    """Return this module's renderer on the GPU with PyTorch's number."""
    return Renderer(f"uuid:{torch.cuda.get_device_properties(index).uuid}")


def _renderer(number: int, image: Any = None) -> Renderer:
    """Return the renderer with that number; for tensors of CUDA, this module's is on their GPU."""
    if number != _OWN:
        return _RENDERERS[number]
    with _opening:
        return _own_renderer() if image is None else _renderer_on(image.device.index)


def _number(renderer: Renderer | None) -> int:
    if renderer is None:
        return _OWN
    _RENDERERS[id(renderer)] = renderer
    return id(renderer)


def _each(  # noqa: PLR0917
    image: Any, mask: Any, emission: Any, values: Sequence[Any], names: str, text: str
) -> Iterator[tuple[tuple[int, ...], dict[str, Any], Settings]]:
    """Yield the index, the arrays and the settings of each image of a batch."""
    given = {"image": image, "mask": mask, "emission": emission}
    arrays = {
        name: part.detach().cpu().contiguous().numpy()
        for name, part in given.items()
        if part is not None
    }
    settings = _replaced(_settings(text), dict(zip(_split(names), values, strict=True)))
    for index in np.ndindex(tuple(image.shape[:-3])):
        yield index, {name: part[index] for name, part in arrays.items()}, settings


def _split(names: str) -> list[str]:
    return names.split(",") if names else []


def _pulled(arrays: dict[str, Any], settings: Settings, renderer: int, cotangent: Any) -> Any:
    """Return the derivatives: of the reference for float64, else of the renderer."""
    if arrays["image"].dtype == np.float64:
        return reference_vjp(settings=settings, **arrays)[1]({"final": cotangent})
    pullback = pullback_of(_renderer(renderer), checked_inputs(**arrays), settings)
    return pullback(check_cotangents({"final": cotangent}, {"final": cotangent}))


def _pulled_on_device(  # noqa: PLR0917
    cotangent: Any,
    image: Any,
    mask: Any,
    emission: Any,
    settings: Settings,
    number: int,
) -> Iterator[Any]:
    """Yield the derivatives of each image, with those by images as tensors of the GPU."""
    renderer = _renderer(number, image)
    core = core_of(renderer)
    masks = None if mask is None else mask.detach().reshape(-1, *mask.shape[-2:]).cpu().numpy()
    images, emissions, cotangents = (
        None if one is None else take(_batch(one), name, core, (4,))
        for name, one in (("image", image), ("emission", emission), ("cotangent", cotangent))
    )
    assert images
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
    yield from pull_each(renderer, settings, sequence, "cuda")


def _batch(tensor: Any) -> Any:
    return tensor.detach().reshape(-1, *tensor.shape[-3:])


def _operator(name: str, parameters: str, result: str) -> Any:
    """Declare an operator, whose types PyTorch cannot read from annotations of `Any`."""
    schema = f"({parameters}Tensor image, Tensor? mask, Tensor? emission, Tensor[] values, "
    schema += f"str names, str settings, int renderer) -> {result}"
    return torch.library.custom_op(name, mutates_args=(), schema=schema)


@_operator("vkbloom::bloom", "", "Tensor")  # type: ignore[untyped-decorator]
def _bloom(  # noqa: PLR0917
    image: Any,
    mask: Any,
    emission: Any,
    values: Sequence[Any],
    names: str,
    settings: str,
    renderer: int,
) -> Any:
    if image.is_cuda and image.dtype != torch.float64:
        return _on_device(image, mask, emission, values, names, settings, renderer)
    final = np.empty(image.shape, _dtype(image))
    for index, arrays, one in _each(image, mask, emission, values, names, settings):
        given = dict(arrays)
        pixels = given.pop("image")
        if pixels.dtype == np.float64:
            final[index] = reference_apply(pixels, one, **given)["final"]
        else:
            frames = _renderer(renderer).apply(
                pixels, one.replace(format="rgba32float"), attachments="final", **given
            )
            final[index] = frames["final"]
    return torch.from_numpy(final).to(image.device)


def _on_device(  # noqa: PLR0917
    image: Any,
    mask: Any,
    emission: Any,
    values: Sequence[Any],
    names: str,
    text: str,
    number: int,
) -> Any:
    """Run the operator without the host; a batch without masks changes the context once."""
    settings = _in_floats(text)
    if names:
        settings = _replaced(settings, dict(zip(_split(names), values, strict=True)))
    renderer = _renderer(number, image)
    images = _batch(image)
    if mask is None and emission is None and len(images) > 1:
        frames = renderer.apply_each(images, settings, attachments="final")
    else:
        masks, emissions = (
            [None] * len(images) if one is None else one.detach().reshape(-1, *one.shape[-sides:])
            for one, sides in ((mask, 2), (emission, 3))
        )
        frames = (
            renderer.apply(one, settings, mask=masks[i], emission=emissions[i], attachments="final")
            for i, one in enumerate(images)
        )
    # The images of a batch are in the same memory.
    batches = merged([cast("DeviceArray", one["final"]) for one in frames])
    return _joined([torch.from_dlpack(one) for one in batches], image, torch.cat)


def _dtype(tensor: Any) -> Any:
    return torch.empty(0, dtype=tensor.dtype).numpy().dtype


@_bloom.register_fake  # type: ignore[untyped-decorator]
def _(  # noqa: PLR0917
    image: Any, mask: Any, emission: Any, values: Any, names: str, settings: str, renderer: int
) -> Any:
    return torch.empty(image.shape, dtype=image.dtype, device=image.device)


@_operator("vkbloom::bloom_backward", "Tensor cotangent, ", "Tensor[]")  # type: ignore[untyped-decorator]
def _backward(  # noqa: PLR0917
    cotangent: Any,
    image: Any,
    mask: Any,
    emission: Any,
    values: Sequence[Any],
    names: str,
    settings: str,
    renderer: int,
) -> list[Any]:
    """Return the derivatives by the image, those of mask and emission that are there, and values.

    Of a batch, the derivatives by values are added.
    """
    inputs = {"image": image, "mask": mask, "emission": emission}
    images = {name: part for name, part in inputs.items() if part is not None}
    fields = dict(zip(_split(names), values, strict=True))
    found: dict[str, list[Any]] = {name: [] for name in (*images, *fields)}
    on_device = image.is_cuda and image.dtype != torch.float64
    if on_device:
        one = _replaced(_settings(settings), fields)
        pulled = _pulled_on_device(cotangent, image, mask, emission, one, renderer)
    else:
        wanted = cotangent.detach().cpu().numpy()
        pulled = (
            _pulled(arrays, one, renderer, wanted[index])
            for index, arrays, one in _each(image, mask, emission, values, names, settings)
        )
    for gradients in pulled:
        for name, parts in found.items():
            parts.append(_as_tensor(gradients[name]))
    return [
        *(_joined(found[name], part) for name, part in images.items()),
        *(sum(found[name], torch.zeros(part.shape)).to(part) for name, part in fields.items()),
    ]


def _as_tensor(part: Any) -> Any:
    """Return a derivative as a tensor; one of NumPy in float64, so that sums are exact."""
    if isinstance(part, DeviceArray):
        return torch.from_dlpack(part)
    return torch.from_numpy(np.array(part, np.float64))


def _joined(parts: list[Any], like: Any, join: Any = None) -> Any:
    """Return images, or with `join` batches, as a tensor of the kind of another one."""
    if not parts:
        return like.new_zeros(like.shape)
    joined = parts[0] if len(parts) == 1 else (join or torch.stack)(parts)
    return joined.reshape(like.shape).to(like).contiguous()


@_backward.register_fake  # type: ignore[untyped-decorator]
def _(  # noqa: PLR0917
    cotangent: Any,
    image: Any,
    mask: Any,
    emission: Any,
    values: Any,
    names: str,
    settings: str,
    renderer: int,
) -> Any:
    parts = [part for part in (image, mask, emission, *values) if part is not None]
    return [torch.empty(part.shape, dtype=part.dtype, device=part.device) for part in parts]


def _keep(ctx: Any, inputs: tuple[Any, ...], output: Any) -> None:
    image, mask, emission, values, *ctx.texts = inputs
    ctx.given = [part is not None for part in (image, mask, emission)]
    ctx.save_for_backward(*(part for part in (image, mask, emission) if part is not None), *values)


def _back(ctx: Any, cotangent: Any) -> tuple[Any, ...]:
    saved = iter(ctx.saved_tensors)
    inputs = [next(saved) if given else None for given in ctx.given]
    found = iter(torch.ops.vkbloom.bloom_backward(cotangent, *inputs, [*saved], *ctx.texts))
    return *(next(found) if given else None for given in ctx.given), [*found], None, None, None


def _refuse(ctx: Any, *cotangents: Any) -> Any:
    raise RuntimeError(
        "vkbloom::bloom: its second derivative is not implemented; the first is exact, so compute "
        "without create_graph=True"
    )


_bloom.register_autograd(_back, setup_context=_keep)
_backward.register_autograd(_refuse)
