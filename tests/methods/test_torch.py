"""The operator of PyTorch: its derivatives, its registration, and what it refuses."""

from __future__ import annotations

import gc
from typing import Any

import numpy as np
import pytest

import vkbloom
from vkbloom import Renderer

torch = pytest.importorskip("torch", reason="PyTorch is not installed")

from vkbloom import torch as vkbloom_torch  # noqa: E402

SETTINGS = vkbloom.Pyramid(levels=2, threshold=0.4, knee=0.5, intensity=0.7)


def tensor(*shape: int, dtype: Any = None, seed: int = 1, requires_grad: bool = True) -> Any:
    random = torch.Generator().manual_seed(seed)
    found = torch.rand(shape, generator=random, dtype=dtype or torch.float32)
    return found.requires_grad_(requires_grad)


def arguments(dtype: Any, settings: Any = SETTINGS) -> tuple[Any, ...]:
    value = torch.tensor(0.7, dtype=dtype, requires_grad=True)
    image, emission = (tensor(4, 5, 3, dtype=dtype, seed=seed) for seed in (1, 2))
    mask = tensor(4, 5, dtype=dtype, seed=3).detach() * 0.8 + 0.1
    return image, mask.requires_grad_(), emission, [value], "intensity", settings.to_json(), 0


def test_result_is_that_of_the_renderer(renderer: Renderer) -> None:
    image = tensor(2, 7, 9, 3, requires_grad=False)
    final = vkbloom_torch.bloom(image, SETTINGS, renderer=renderer)
    for one, expected in zip(final, image, strict=True):
        frames = renderer.apply(expected.numpy(), SETTINGS)
        assert np.array_equal(one.numpy(), frames["final"])
    first = vkbloom_torch.bloom(
        image.movedim(-1, -3), SETTINGS, renderer=renderer, channels_first=True
    )
    assert torch.equal(first.movedim(-3, -1), final)


def test_derivatives_are_those_of_the_renderer(renderer: Renderer) -> None:
    image, cotangent = tensor(2, 7, 9, 3), tensor(2, 7, 9, 3, seed=2).detach()
    module = vkbloom_torch.Bloom(SETTINGS, learn=("intensity", "threshold"), renderer=renderer)
    (module(image) * cotangent).sum().backward()
    totals = {"intensity": 0.0, "threshold": 0.0}
    for index in range(2):
        _, pullback = renderer.vjp(image[index].detach().numpy(), SETTINGS)
        found = pullback({"final": cotangent[index].numpy()})
        assert np.allclose(image.grad[index].numpy(), found["image"], rtol=0, atol=1e-6)
        totals = {name: total + float(found[name]) for name, total in totals.items()}
    for name, total in totals.items():
        assert abs(module.learned[name].grad.item() - total) <= 1e-5 * abs(total)


def test_derivatives_of_doubles_pass_gradcheck() -> None:
    torch.autograd.gradcheck(
        lambda image, mask, emission, value: torch.ops.vkbloom.bloom(
            image, mask, emission, [value], *arguments(torch.float64)[4:]
        ),
        (*arguments(torch.float64)[:3], arguments(torch.float64)[3][0]),
    )


# (opcheck itself reads .grad of its copies.)
@pytest.mark.filterwarnings("ignore:The .grad attribute of a Tensor that is not a leaf")
@pytest.mark.parametrize("name", ["float32", "float64"])
def test_operators_pass_opcheck(name: str) -> None:
    dtype = getattr(torch, name)
    torch.library.opcheck(torch.ops.vkbloom.bloom.default, arguments(dtype))
    cotangent = tensor(4, 5, 3, dtype=dtype, requires_grad=False)
    detached = [
        [one.detach() for one in part]
        if isinstance(part, list)
        else part.detach()
        if isinstance(part, torch.Tensor)
        else part
        for part in arguments(dtype)
    ]
    torch.library.opcheck(torch.ops.vkbloom.bloom_backward.default, (cotangent, *detached))


def test_second_derivative_is_refused_with_a_reason(renderer: Renderer) -> None:
    image = tensor(4, 5, 3)
    final = vkbloom_torch.bloom(image, SETTINGS, renderer=renderer)
    (first,) = torch.autograd.grad(final.sum(), image, create_graph=True)
    with pytest.raises(RuntimeError, match="its second derivative is not implemented"):
        first.sum().backward()


def test_field_is_learned_and_nothing_grows(renderer: Renderer) -> None:
    image = tensor(8, 8, 3, requires_grad=False)
    target = vkbloom_torch.bloom(image, SETTINGS, renderer=renderer)
    module = vkbloom_torch.Bloom(
        SETTINGS.replace(intensity=0.1), learn=("intensity",), renderer=renderer
    )
    optimizer = torch.optim.SGD(module.parameters(), lr=0.02)
    counts = []
    for step in range(60):
        optimizer.zero_grad()
        (module(image) - target).square().sum().backward()
        optimizer.step()
        if step in (20, 59):
            gc.collect()
            counts.append(len(gc.get_objects()))
    assert abs(module.settings.intensity - 0.7) <= 1e-3
    assert counts[1] - counts[0] < 50


def test_parameters_return_to_their_ranges(renderer: Renderer) -> None:
    module = vkbloom_torch.Bloom(SETTINGS, learn=("knee",), renderer=renderer)
    with torch.no_grad():
        module.learned["knee"].fill_(-0.5)
    module(tensor(4, 4, 3))
    assert module.settings.knee == 0


def test_wrong_arguments_are_named(renderer: Renderer) -> None:
    image = tensor(6, 5, 3)
    with pytest.raises(ValueError, match="learn: 'levels' of the method pyramid has no derivative"):
        vkbloom_torch.Bloom(SETTINGS, learn=("levels",))
    with pytest.raises(ValueError, match=r"image: the shape \(6, 5, 3\) is not \(..., C, H, W\)"):
        vkbloom_torch.bloom(image, SETTINGS, channels_first=True)
    for shape, first in (((3, 6, 5), False), ((2, 4, 6, 5), False), ((6, 5, 3), True)):
        with pytest.raises(ValueError, match=f"; give channels_first={not first}"):
            vkbloom_torch.bloom(tensor(*shape), SETTINGS, channels_first=first)
    with pytest.raises(ValueError, match=r"mask: the shape \(5, 6\) is not \(6, 5\)"):
        vkbloom_torch.bloom(image, SETTINGS, mask=tensor(5, 6))
    with pytest.raises(TypeError, match="image: a tensor is needed, not list"):
        vkbloom_torch.bloom([0.5], SETTINGS)
    with pytest.raises(ValueError, match=r"emission: .* is not the image's"):
        vkbloom_torch.bloom(image, SETTINGS, emission=tensor(6, 5, 4))
