"""Bloom as an operator of PyTorch, with its derivatives.

Tensors of float64 are computed by `vkbloom.reference`, all others by a renderer. The bloom buffers
are "rgba32float".
"""

from __future__ import annotations

from typing import Any, Literal, TypeAlias

from vkbloom._extras import import_extra
from vkbloom._gradients.operators import (
    draw,
    names_of,
    number_of,
    read,
    refuse_capture,
    refuse_tangents,
    text_of,
    values_of,
)
from vkbloom._renderer.renderer import Renderer
from vkbloom._settings.settings import Settings, check_settings, field_info
from vkbloom.reference._derivatives import differentiable, is_unset

torch: Any = import_extra("torch", "torch", "vkbloom.torch")

__all__ = ["Bloom", "bloom"]

# The order of an image's dimensions, after those of a batch.
Order: TypeAlias = Literal["HWC", "CHW"]


def bloom(
    image: Any,
    settings: Settings | str,
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
        host, and what `vjp` takes from the reference go through the host.
    settings : Settings or str
        Settings, or the name of a preset. `Settings.format` is not read: the bloom buffers are
        "rgba32float".
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
    RuntimeError
        An argument has a tangent of forward mode, as in `torch.func.jvp` and `jacfwd`. From a
        backward pass: a second derivative was asked for.

    Notes
    -----
    The operator is ``torch.ops.vkbloom.bloom``, with a fake kernel, so `torch.compile` does not
    look into it. Called by itself it does not see tangents of forward mode.

    Examples
    --------
    >>> image = torch.rand(16, 16, 3, requires_grad=True)
    >>> vkbloom.torch.bloom(image, "kino").sum().backward()
    >>> image.grad.shape
    torch.Size([16, 16, 3])
    """
    settings = check_settings(settings, of_image=True)
    order: Order = "CHW" if channels_first else "HWC"
    arrays = {"mask": mask, "emission": emission}
    return _call(image, settings, order, **arrays, renderer=renderer)


class Bloom(torch.nn.Module):  # type: ignore[misc]
    """Bloom as a module of PyTorch.

    Parameters
    ----------
    settings : Settings or str
        Settings, or the name of a preset: where learning starts, and the fields that stay as they
        are.
    learn : sequence of str
        The fields that are parameters of the module: real ones, such as "intensity",
        "level_weights" or "glare.0.intensity".
    renderer, channels_first
        As for `bloom`.

    Raises
    ------
    ValueError
        A field has no derivative, or is None: give it a value where learning starts.

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
        settings: Settings | str,
        learn: tuple[str, ...] = (),
        *,
        renderer: Renderer | None = None,
        channels_first: bool = False,
    ) -> None:
        super().__init__()
        self._start = check_settings(settings, of_image=True)
        self._names = (learn,) if isinstance(learn, str) else tuple(learn)
        self._renderer = _check_renderer(renderer)
        self._order: Order = "CHW" if channels_first else "HWC"
        known = differentiable(self._start)
        for name in self._names:
            if is_unset(self._start, name):
                raise ValueError(
                    f"learn: {name!r} of the settings is None, where learning cannot start; give "
                    f"it a value, such as settings.replace({name}=...)"
                )
            if name not in known:
                raise ValueError(
                    f"learn: {name!r} of the method {self._start.method} has no derivative; those "
                    f"with one are {', '.join(known)}"
                )
        self._ranges = {name: field_info(self._start, name).range for name in self._names}
        # The names of parameters have no dots.
        self.learned = torch.nn.ParameterDict(
            {name.replace(".", "_"): torch.tensor(known[name]) for name in self._names}
        )
        self._sizes = {name: self._parameter(name).numel() for name in self._names}
        self._fields = names_of({name: self._parameter(name) for name in self._names})

    @property
    def settings(self) -> Settings:
        """The settings with what was learned."""
        values = [_clamp(self._parameter(name), self._ranges[name]) for name in self._names]
        return self._start.replace(**values_of(self._fields, read(values)))

    def forward(self, image: Any, *, mask: Any = None, emission: Any = None) -> Any:
        """Add bloom, as `bloom` does."""
        if not torch.compiler.is_compiling():
            # Comparing parameters waits for the device, which would end the capture.
            refuse_capture(image)
        parameters = [self._parameter(name) for name in self._names]
        numbers = self._move_into_ranges(parameters)
        learned = self._fields, parameters, numbers
        arrays = {"mask": mask, "emission": emission, "renderer": self._renderer}
        return _call(image, self._start, self._order, learned, **arrays)

    def _parameter(self, name: str) -> Any:
        return self.learned[name.replace(".", "_")]

    def _move_into_ranges(self, parameters: list[Any]) -> Any:
        """Move parameters into the ranges of their fields, and return their numbers.

        Compiled code, which cannot depend on values, has no numbers.
        """
        if torch.compiler.is_compiling():
            with torch.no_grad():
                for name, parameter in zip(self._names, parameters, strict=True):
                    parameter.copy_(_clamp(parameter, self._ranges[name]))
            return None
        numbers = read(parameters)
        values, at, moved = numbers.tolist(), 0, False
        for name, parameter in zip(self._names, parameters, strict=True):
            ends, part = self._ranges[name], values[at : at + parameter.numel()]
            if len(part) != self._sizes[name]:
                raise ValueError(
                    f"{name}: a parameter of {len(part)} numbers is not one of {self._sizes[name]}"
                )
            at += len(part)
            # A write, also of an equal value, makes what other operators have saved unusable.
            if not _is_within(part, ends):
                with torch.no_grad():
                    parameter.copy_(_clamp(parameter, ends))
                moved = True
        return read(parameters) if moved else numbers


def _is_within(values: Any, ends: tuple[float, float] | None) -> bool:
    """Return whether all numbers of a list are between the ends, or there are none."""
    return ends is None or all(ends[0] <= value <= ends[1] for value in values)


def _clamp(value: Any, ends: tuple[float, float] | None) -> Any:
    """Return a value, or the nearest end of its range."""
    return value.detach() if ends is None else value.detach().clamp(*ends)


def _check_renderer(renderer: object) -> Renderer | None:
    if renderer is None or isinstance(renderer, Renderer):
        return renderer
    raise TypeError(
        f"renderer: {renderer!r} is not a Renderer; give an open one, such as "
        "vkbloom.Renderer('software')"
    )


def _call(
    image: Any,
    settings: Settings,
    order: Order,
    learned: tuple[str, list[Any], Any] = ("", [], None),
    *,
    mask: Any,
    emission: Any,
    renderer: Renderer | None,
) -> Any:
    """Run the operator; `learned` is what `names_of` returns, the parameters and their numbers."""
    fields, parameters, numbers = learned
    for name, tensor in (("image", image), ("mask", mask), ("emission", emission)):
        if not isinstance(tensor, torch.Tensor) and (tensor is not None or name == "image"):
            raise TypeError(f"{name}: a tensor is needed, not {type(tensor).__name__}")
    _check(image, mask, emission, order)
    _check_renderer(renderer)
    refuse_tangents((image, mask, emission, *parameters))
    if order == "CHW":
        image = image.movedim(-3, -1)
        emission = None if emission is None else emission.movedim(-3, -1)
    given = fields, text_of(settings), number_of(renderer)
    final = draw((image, mask, emission), given, parameters, numbers)
    return final.movedim(-1, -3) if order == "CHW" else final


def _check(image: Any, mask: Any, emission: Any, order: Order) -> None:
    """Check shapes, dtypes and devices, so that errors come from the call and not the operator."""
    shape, channels_first = tuple(image.shape), order == "CHW"
    form = "(..., C, H, W)" if channels_first else "(..., H, W, C)"
    if len(shape) < 3 or shape[-3 if channels_first else -1] not in (3, 4):
        text = f"image: the shape {shape} is not {form} with 3 or 4 channels"
        if len(shape) >= 3 and shape[-1 if channels_first else -3] in (3, 4):
            text += f"; give channels_first={not channels_first}"
        raise ValueError(text)
    if 0 in shape[-3:]:
        raise ValueError(f"image: the shape {shape} is not {form} with sides of at least 1")
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
