"""The operator of PyTorch: its derivatives, its registration, and what it refuses."""

from __future__ import annotations

import gc
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

import vkbloom
from tests.conftest import ADAPTER
from tests.processes import output
from tests.refusals import assert_refused, rows
from vkbloom import Renderer, reference, testing

torch = pytest.importorskip("torch", reason="PyTorch is not installed; run make test-torch")
tracing = pytest.importorskip("torch.fx.experimental.proxy_tensor")

from tests.planned import watch_submissions  # noqa: E402
from vkbloom import torch as vkbloom_torch  # noqa: E402
from vkbloom._gradients import operators  # noqa: E402

#: Tensors are on the GPU where the tests run on one.
DEVICE = "cuda" if ADAPTER == "hardware" and torch.cuda.is_available() else "cpu"
SETTINGS = vkbloom.Pyramid(levels=2, threshold=0.4, knee=0.5, intensity=0.7)


def tensor(*shape: int, dtype: Any = None, seed: int = 1, requires_grad: bool = True) -> Any:
    random = torch.Generator().manual_seed(seed)
    found = torch.rand(shape, generator=random, dtype=dtype or torch.float32)
    return found.to(DEVICE).requires_grad_(requires_grad)


def arguments(dtype: Any, settings: Any = SETTINGS) -> tuple[Any, ...]:
    values = torch.tensor([0.7], dtype=dtype, device=DEVICE, requires_grad=True)
    image, emission = (tensor(4, 5, 3, dtype=dtype, seed=seed) for seed in (1, 2))
    mask = tensor(4, 5, dtype=dtype, seed=3).detach() * 0.8 + 0.1
    return image, mask.requires_grad_(), emission, values, "intensity", settings.to_json(), 0


def test_result_is_that_of_the_renderer(renderer: Renderer) -> None:
    image = tensor(2, 7, 9, 3, requires_grad=False)
    final = vkbloom_torch.bloom(image, SETTINGS, renderer=renderer)
    for one, expected in zip(final, image, strict=True):
        frames = renderer.apply(expected.cpu().numpy(), SETTINGS)
        assert np.array_equal(one.cpu().numpy(), frames["final"])
    first = vkbloom_torch.bloom(
        image.movedim(-1, -3), SETTINGS, renderer=renderer, channels_first=True
    )
    assert torch.equal(first.movedim(-3, -1), final)


def spot(u: float, v: float) -> np.ndarray[Any, Any]:
    y, x = np.mgrid[-3:4, -3:4]
    kernel = np.exp(-((x - u) ** 2 + (y - v) ** 2) / 2)
    return np.asarray(kernel / kernel.sum())


@pytest.mark.parametrize(
    "lens",
    [vkbloom.psf.Varying(function=spot), vkbloom.psf.Gathered([[np.eye(3), np.ones((3, 3))]])],
)
def test_kernels_may_depend_on_the_place(renderer: Renderer, lens: Any) -> None:
    """A function is known to the operator by its name. The sum over both is the same."""
    settings = vkbloom.Convolution(lens, composite="mix", intensity=1)
    image, cotangent = tensor(2, 7, 9, 3), tensor(2, 7, 9, 3, seed=2).detach()
    final = vkbloom_torch.bloom(image, settings, renderer=renderer)
    frames = renderer.apply(image[0].detach().cpu().numpy(), settings)
    assert np.array_equal(final[0].detach().cpu().numpy(), frames["final"])
    (final * cotangent).sum().backward()
    forth, back = (
        float((one * other).sum().detach())
        for one, other in ((final, cotangent), (image, image.grad))
    )
    assert back == pytest.approx(forth, rel=1e-6)


def test_weights_of_kernels_are_learned(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They are a tensor whose derivative is that of the reference.

    Derivatives by an image that has none are left out.
    """
    kernels = np.stack([spot(0, 0), spot(1, -1)])
    lens = vkbloom.psf.Varying(kernels, weights=np.linspace(0, 1, 12).reshape(2, 2, 3))
    settings = vkbloom.Convolution(lens, composite="mix", intensity=1)
    module = vkbloom_torch.Bloom(settings, learn=("psf.weights",), renderer=renderer)
    image = tensor(9, 12, 3)
    final = module(image)
    final.sum().backward()
    exact = vkbloom.reference.vjp(image.detach().cpu().numpy(), settings)[1](
        {"final": np.ones(image.shape)}
    )["psf.weights"]
    made = module.learned["psf_weights"].grad.cpu().numpy()
    np.testing.assert_allclose(made, exact, rtol=0, atol=1e-5 * abs(exact).max())
    assert module.settings.value_of("psf.weights") == lens.weights
    submitted = watch_submissions(monkeypatch)
    module.zero_grad()
    module(image.detach()).sum().backward()
    assert submitted == ["weights"]
    again = module.learned["psf_weights"].grad.cpu().numpy()
    np.testing.assert_array_equal(again, made)


def test_derivatives_are_those_of_the_renderer(renderer: Renderer) -> None:
    image, cotangent = tensor(2, 7, 9, 3), tensor(2, 7, 9, 3, seed=2).detach()
    module = vkbloom_torch.Bloom(SETTINGS, learn=("intensity", "threshold"), renderer=renderer)
    (module(image) * cotangent).sum().backward()
    totals = {"intensity": 0.0, "threshold": 0.0}
    for index in range(2):
        _, pullback = vkbloom.vjp(image[index].detach().cpu().numpy(), SETTINGS, renderer=renderer)
        found = pullback({"final": cotangent[index].cpu().numpy()})
        assert np.allclose(image.grad[index].cpu().numpy(), found["image"], rtol=0, atol=1e-6)
        totals = {name: total + float(found[name]) for name, total in totals.items()}
    for name, total in totals.items():
        assert abs(module.learned[name].grad.item() - total) <= 1e-5 * abs(total)


def test_derivatives_of_doubles_pass_gradcheck() -> None:
    torch.autograd.gradcheck(
        lambda *tensors: torch.ops.vkbloom.bloom(*tensors, *arguments(torch.float64)[4:]),
        arguments(torch.float64)[:4],
    )


# (opcheck itself reads .grad of its copies.)
@pytest.mark.filterwarnings("ignore:The .grad attribute of a Tensor that is not a leaf")
@pytest.mark.parametrize("name", ["float32", "float64"])
def test_operators_pass_opcheck(name: str) -> None:
    dtype = getattr(torch, name)
    torch.library.opcheck(torch.ops.vkbloom.bloom.default, arguments(dtype))
    cotangent = tensor(4, 5, 3, dtype=dtype, requires_grad=False)
    detached = [
        part.detach() if isinstance(part, torch.Tensor) else part for part in arguments(dtype)
    ]
    for by_images in (True, False):
        given = cotangent, by_images, *detached
        torch.library.opcheck(torch.ops.vkbloom.bloom_backward.default, given)


@pytest.mark.filterwarnings("ignore:There is a performance drop")
@pytest.mark.filterwarnings("ignore:Warning. Profiler clears events")
def test_what_looks_at_operators_sees_one(renderer: Renderer) -> None:
    """Transforms, fake tensors, traces and subclasses; plain tensors pass the dispatcher by."""
    images = tensor(2, 4, 5, 3, requires_grad=False)

    def bloom(image: Any) -> Any:
        return vkbloom_torch.bloom(image, SETTINGS, renderer=renderer)

    assert torch.equal(torch.vmap(bloom)(images), bloom(images))
    assert "vkbloom.bloom" in tracing.make_fx(bloom)(images).code
    with torch._subclasses.FakeTensorMode():
        fake = torch.empty(4, 5, 3, requires_grad=True)
        bloom(fake).sum().backward()
        assert fake.grad.shape == fake.shape
    subclass = type("Subclass", (torch.Tensor,), {})
    assert type(bloom(images.as_subclass(subclass))) is subclass
    with torch.profiler.profile() as profile:
        bloom(images)
    assert [one.name for one in profile.events() if "bloom" in one.name] == ["VkbloomBloom"]


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


def test_derivatives_by_parameters_are_those_of_separate_calls(renderer: Renderer) -> None:
    fields = ("intensity", "knee", "glare.0.threshold")
    settings = SETTINGS.replace(knee=0.0, glare=(vkbloom.Streaks(threshold=0.1),))
    module = vkbloom_torch.Bloom(settings, learn=fields, renderer=renderer).to(DEVICE)
    images = [tensor(6, 5, 3, seed=seed, requires_grad=False) for seed in (1, 2)]

    def pull(*parts: Any) -> Any:
        module.zero_grad()
        finals = [module(image) for image in parts]
        # Calls before one backward keep what they have saved, also if settings are read between.
        assert module.settings.intensity >= 0
        sum(final.square().sum() for final in finals).backward()
        return torch.stack([parameter.grad for parameter in module.parameters()])

    assert torch.allclose(pull(*images), pull(images[0]) + pull(images[1]), rtol=1e-5)


def test_fields_pass_gradcheck() -> None:
    fields = ("intensity", "exposure", "threshold", "knee", "level_weights")
    settings = SETTINGS.replace(level_weights=(0.5, 0.5), exposure=0.1)
    module = vkbloom_torch.Bloom(settings, learn=fields).double().to(DEVICE)
    image = tensor(4, 5, 3, dtype=torch.float64)
    torch.autograd.gradcheck(lambda image, *_: module(image), (image, *module.parameters()))


def test_parameters_return_to_their_ranges(renderer: Renderer) -> None:
    module = vkbloom_torch.Bloom(SETTINGS, learn=("knee",), renderer=renderer)
    with torch.no_grad():
        module.learned["knee"].fill_(-0.5)
    module(tensor(4, 4, 3))
    assert module.settings.knee == 0


# (PyTorch's own forward mode.)
@pytest.mark.filterwarnings("ignore:.torch.jit.script. is deprecated")
@pytest.mark.parametrize(("call", "error"), rows(__file__, "tensors"))
def test_wrong_arguments_are_named(call: str, error: str) -> None:
    names = {"bloom": vkbloom_torch.bloom, "IMAGE": tensor(6, 5, 3)}
    assert_refused(call, error, {**globals(), **names})


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_cotangents_that_are_not_finite_reach_the_derivatives(
    renderer: Renderer, value: float, dtype: Any
) -> None:
    # As a scaler of gradients expects, which then skips the step.
    image, cotangent = tensor(7, 9, 3, dtype=dtype), torch.ones(7, 9, 3, dtype=dtype)
    cotangent[3, 4, 1] = value
    module = vkbloom_torch.Bloom(SETTINGS, learn=("intensity", "knee"), renderer=renderer)
    for place in ("cpu", DEVICE):
        module.to(place)(image).backward(cotangent.to(DEVICE))
        assert not image.grad[3, 4].isfinite().all()
        assert not any(parameter.grad.isfinite() for parameter in module.parameters())
        module.zero_grad()


@pytest.mark.parametrize(
    ("settings", "learn"),
    [
        (SETTINGS, ("knee", "intensity")),
        (SETTINGS.replace(intensity=0.0), ("intensity", "threshold")),
        (vkbloom.Separable(threshold=0.2, exposure=0.5), ("exposure", "threshold")),
        (SETTINGS.replace(tonemap="aces"), ("knee", "intensity")),
        (
            vkbloom.presets["bevy_natural"],
            ("low_frequency_boost", "intensity", "high_pass_frequency"),
        ),
    ],
)
def test_derivatives_are_the_same_where_parameters_are_on_the_gpu(
    renderer: Renderer, settings: vkbloom.Settings, learn: tuple[str, ...]
) -> None:
    """Sums are combined there, so that the host does not wait for them."""
    module = vkbloom_torch.Bloom(settings, learn=learn, renderer=renderer)
    images, cotangents = tensor(2, 37, 29, 3), tensor(2, 37, 29, 3, seed=2, requires_grad=False)
    for by_images in (True, False):
        found = []
        for place in ("cpu", DEVICE):
            module.to(place).zero_grad()
            module(images.detach().requires_grad_(by_images)).backward(cotangents)
            found.append([one.grad.cpu().clone() for one in module.parameters()])
        torch.testing.assert_close(*found, rtol=1e-6, atol=0.0)


def test_an_empty_batch_is_empty(renderer: Renderer) -> None:
    image, mask = tensor(2, 0, 4, 5, 3), tensor(2, 0, 4, 5)
    module = vkbloom_torch.Bloom(SETTINGS, learn=("intensity",), renderer=renderer).to(DEVICE)
    final = module(image, mask=mask)
    final.sum().backward()
    assert final.shape == image.grad.shape == image.shape
    assert mask.grad.shape == mask.shape
    assert module.learned["intensity"].grad == 0


def test_a_renderer_lives_until_the_backward_pass() -> None:
    image = tensor(4, 5, 3)
    final = vkbloom_torch.bloom(image, SETTINGS, renderer=Renderer())
    final.sum().backward()
    expected, image.grad = image.grad, None
    vkbloom_torch.bloom(image, SETTINGS).sum().backward()
    assert torch.equal(image.grad, expected)


def test_a_renderer_that_was_collected_is_named() -> None:
    *given, _ = arguments(torch.float32)
    renderer = Renderer()
    number = operators.number_of(renderer)
    assert torch.ops.vkbloom.bloom(*given, number).shape == (4, 5, 3)
    del renderer
    gc.collect()
    with pytest.raises(ValueError, match="renderer: it was collected; keep a reference to it"):
        torch.ops.vkbloom.bloom(*given, number)
    with pytest.raises(ValueError, match="renderer: it was collected; keep a reference to it"):
        torch.ops.vkbloom.bloom_backward(given[0], True, *given, number)


FORKED = """
import sys, warnings
import torch
from torch.utils.data import DataLoader, Dataset
import vkbloom, vkbloom.torch

class Bloomed(Dataset):
    def __len__(self):
        return 2
    def __getitem__(self, index):
        return vkbloom.torch.bloom(torch.full((4, 4, 3), index + 1.0), vkbloom.Pyramid(levels=1))

warnings.simplefilter("ignore")
images = Bloomed()
expected = torch.stack([images[0], images[1]])
loader = DataLoader(images, batch_size=2, num_workers=1, multiprocessing_context="fork")
print(torch.equal(next(iter(loader)), expected), torch.equal(images[1], expected[1]))
"""


@pytest.mark.usefixtures("software")
def test_a_forked_worker_opens_a_renderer_of_its_own() -> None:
    assert output("-c", FORKED, VKBLOOM_ADAPTER="software") == "True True\n"


def compile_call(fullgraph: bool, function: Any) -> Any:
    torch._dynamo.reset()
    return torch.compile(function, fullgraph=fullgraph, backend="aot_eager")


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # of PyTorch's compiler itself
@pytest.mark.parametrize("fullgraph", [True, False])
def test_compiled_code_has_the_settings_that_it_is_called_with(
    renderer: Renderer, fullgraph: bool
) -> None:
    def of_argument(image: Any, settings: Any) -> Any:
        return vkbloom_torch.bloom(image, settings, renderer=renderer)

    def make_inside(image: Any, settings: Any) -> Any:
        return vkbloom_torch.bloom(image, settings.replace(intensity=0.25), renderer=renderer)

    image = tensor(6, 5, 3)
    kernels = [np.random.default_rng(seed).random((3, 3)) for seed in (1, 2)]
    cases = (
        *(SETTINGS.replace(intensity=value) for value in (0.5, 1.0, 2.0, 0.5)),
        vkbloom.Pyramid(levels=3),
        SETTINGS.replace(glare=(vkbloom.Streaks(),)),
        *(vkbloom.Convolution(psf=kernel) for kernel in kernels),
        vkbloom.Convolution(psf=vkbloom.psf.gaussian(sigma=1.5)),
    )
    # (Dynamo compiles a function eight times at the most.)
    for function, part in (
        (of_argument, cases[:5]),
        (of_argument, cases[5:]),
        (make_inside, cases[:1]),
    ):
        run = compile_call(fullgraph, function)
        for settings in part:
            assert torch.equal(run(image, settings), function(image, settings)), settings


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # of PyTorch's compiler itself
@pytest.mark.parametrize("fullgraph", [True, False])
def test_a_compiled_module_trains(renderer: Renderer, fullgraph: bool) -> None:
    module = vkbloom_torch.Bloom(SETTINGS, learn=("intensity", "knee"), renderer=renderer)
    module = module.to(DEVICE)
    images = [tensor(6, 5, 3, seed=seed) for seed in (1, 2)]
    found = []
    for call in (compile_call(fullgraph, module), module):
        module.zero_grad()
        with torch.no_grad():
            module.learned["intensity"].fill_(-1.0)
        sum(call(image).square().sum() for image in images).backward()
        assert module.learned["intensity"] == 0
        found.append([one.grad.clone() for one in module.parameters()])
    assert all(torch.allclose(one, other) for one, other in zip(*found, strict=True))


@pytest.mark.filterwarnings("ignore:The CUDA Graph is empty")  # a step that was refused
@pytest.mark.filterwarnings("ignore:The AccumulateGrad node's stream")  # the image's is another
@pytest.mark.skipif(DEVICE != "cuda", reason="there are no tensors of CUDA here")
def test_a_graph_of_cuda_is_refused(renderer: Renderer) -> None:
    """What Vulkan computes would not be in it. Calls before and after are right."""
    module = vkbloom_torch.Bloom(SETTINGS, learn=("intensity",), renderer=renderer).to(DEVICE)
    image = tensor(2, 8, 8, 3)
    # Autograd goes back on the stream of the forward pass: it is the one that is captured.
    stream = torch.cuda.Stream()
    with torch.cuda.stream(stream):
        expected = module(image)
        loss = expected.sum()
        loss.backward(retain_graph=True)
        gradient = image.grad.clone()
    steps: tuple[Any, ...] = (lambda: module(image), lambda: loss.backward(retain_graph=True))
    for step in steps:
        torch.cuda.synchronize()
        with (
            pytest.raises(RuntimeError, match="a CUDA graph cannot hold it"),
            torch.cuda.graph(torch.cuda.CUDAGraph(), stream=stream),
        ):
            step()
    image.grad = None
    found = module(image)
    found.sum().backward()
    assert torch.equal(found, expected)
    assert torch.equal(image.grad, gradient)


@pytest.mark.skipif(DEVICE != "cuda", reason="there are no tensors of CUDA here")
def test_backward_passes_read_the_image_of_their_own_call(renderer: Renderer) -> None:
    """Also after other calls, after writes to the tensor, and where its memory is used again."""
    module = vkbloom_torch.Bloom(SETTINGS, learn=("intensity",), renderer=renderer).to(DEVICE)

    def gradients(image: Any, final: Any) -> list[Any]:
        image.grad = module.learned["intensity"].grad = None
        final.square().sum().backward()
        return [image.grad.clone(), module.learned["intensity"].grad.clone()]

    images = [tensor(31, 18, 3, seed=seed).detach().requires_grad_() for seed in (1, 2)]
    alone = [gradients(image, module(image)) for image in images]
    finals = [module(image) for image in images]
    together = [gradients(image, final) for image, final in zip(images, finals, strict=True)]
    with torch.no_grad():
        module(images[0])  # no backward pass follows
        images[0].copy_(images[1])
    together.append(gradients(images[0], module(images[0])))
    module(images[0])
    del finals, images[0]
    again = images[0].detach().clone().requires_grad_()
    together.append(gradients(again, module(again)))
    for found, right in zip(together, [*alone, alone[1], alone[1]], strict=True):
        for part, other in zip(found, right, strict=True):
            torch.testing.assert_close(part, other)


@pytest.mark.skipif(DEVICE != "cuda", reason="there are no tensors of CUDA here")
def test_backward_passes_have_the_values_of_their_own_call(renderer: Renderer) -> None:
    """Two calls with the same image, where a backward pass follows the other call."""
    image = tensor(31, 18, 3, seed=1).detach().requires_grad_()
    modules = [
        vkbloom_torch.Bloom(SETTINGS.replace(intensity=intensity), learn=learn, renderer=renderer)
        for intensity in (0.25, 0.75)
        for learn in (("intensity",), ("intensity", "threshold", "knee"))
    ]
    modules = [module.to(DEVICE) for module in modules]

    def gradients(module: Any, final: Any) -> list[Any]:
        image.grad = None
        module.zero_grad()
        final.square().sum().backward()
        return [image.grad.clone(), *(one.grad.clone() for one in module.parameters())]

    alone = [gradients(module, module(image)) for module in modules]
    finals = [module(image) for module in modules]
    for module, final, right in zip(modules, finals, alone, strict=True):
        for part, other in zip(gradients(module, final), right, strict=True):
            assert part.device == other.device
            torch.testing.assert_close(part, other)
    # Results share no memory, so that optimizers may write to them.
    assert len({part.data_ptr() for part in alone[1]}) == len(alone[1])


def test_parameters_may_change_before_the_backward_pass(renderer: Renderer) -> None:
    module = vkbloom_torch.Bloom(SETTINGS, learn=("intensity", "threshold"), renderer=renderer)
    image = tensor(9, 8, 3)
    found = []
    for value in (None, 0.1):
        module.to(DEVICE).zero_grad()
        final = module(image)
        with torch.no_grad():
            if value is not None:
                module.learned["intensity"].fill_(value)
        (gradient,) = torch.autograd.grad(final.sum(), image, retain_graph=True)
        final.sum().backward()
        found.append([gradient, *(one.grad.clone() for one in module.parameters())])
    torch.testing.assert_close(*found, rtol=0.0, atol=0.0)


@pytest.mark.parametrize("learn", [("intensity",), ("level_weights", "intensity", "radius")])
def test_second_derivatives_by_parameters_are_refused(
    renderer: Renderer, learn: tuple[str, ...]
) -> None:
    """Where a graph of the derivatives is made, these are the same."""
    settings = SETTINGS.replace(level_weights=(0.5, 0.5))
    module = vkbloom_torch.Bloom(settings, learn=learn, renderer=renderer).to(DEVICE)
    parameters = [*module.parameters()]
    final = module(tensor(9, 8, 3))
    alone = torch.autograd.grad(final.sum(), parameters, retain_graph=True)
    found = torch.autograd.grad(final.sum(), parameters, create_graph=True)
    torch.testing.assert_close(alone, [one.detach() for one in found], rtol=1e-6, atol=0.0)
    with pytest.raises(RuntimeError, match="its second derivative is not implemented"):
        found[0].sum().backward()


def test_second_derivatives_by_parameters_alone_are_refused(renderer: Renderer) -> None:
    """Also of a loss that is linear in the result, whose cotangents have no graph."""
    module = vkbloom_torch.Bloom(SETTINGS, learn=("threshold", "intensity"), renderer=renderer)
    loss = module(tensor(9, 8, 3, requires_grad=False)).mean()
    found = torch.autograd.grad(loss, [*module.parameters()], create_graph=True)
    with pytest.raises(RuntimeError, match="its second derivative is not implemented"):
        (loss + sum(one.square() for one in found)).backward()


def test_parameters_have_derivatives_of_their_own_kind(renderer: Renderer) -> None:
    """One of halves does not round the others, and one of another shape has its shape."""
    settings = vkbloom.Separable(threshold=0.4, knee=0.3)
    learn = ("weights", "blur_scale", "intensity")
    module = vkbloom_torch.Bloom(settings, learn=learn, renderer=renderer).to(DEVICE)
    image = 2 * tensor(20, 26, 3, requires_grad=False)

    def pull() -> dict[str, Any]:
        module.zero_grad()
        (1e4 * module(image)).sum().backward()
        return {name: one.grad for name, one in module.learned.items()}

    expected = pull()
    module.learned["weights"].data = module.learned["weights"].data.bfloat16().float()
    rounded = pull()
    module.learned["weights"].data = module.learned["weights"].data.bfloat16()
    module.learned["intensity"] = torch.nn.Parameter(torch.ones(1, device=DEVICE))
    found = pull()
    assert found["weights"].dtype == torch.bfloat16
    assert found["intensity"].shape == (1,)
    torch.testing.assert_close(found["intensity"][0], rounded["intensity"], rtol=1e-6, atol=0.0)
    torch.testing.assert_close(found["blur_scale"], rounded["blur_scale"], rtol=1e-5, atol=0.0)
    torch.testing.assert_close(found["blur_scale"], expected["blur_scale"], rtol=0.02, atol=0.0)
    module.learned["weights"] = torch.nn.Parameter(torch.ones(6, device=DEVICE))
    with pytest.raises(ValueError, match="weights: a parameter of 6 numbers is not one of 5"):
        module(image)


@pytest.mark.filterwarnings("ignore:There is a performance drop")
def test_a_batch_of_cotangents_has_a_batch_of_derivatives(renderer: Renderer) -> None:
    module = vkbloom_torch.Bloom(SETTINGS, learn=("intensity", "knee"), renderer=renderer)
    image, cotangents = tensor(4, 5, 3), tensor(2, 4, 5, 3, seed=2, requires_grad=False)
    wanted = [image, *module.to(DEVICE).parameters()]
    final = module(image)
    found = torch.autograd.grad(final, wanted, cotangents, is_grads_batched=True, retain_graph=True)
    for number, cotangent in enumerate(cotangents):
        alone = torch.autograd.grad(final, wanted, cotangent, retain_graph=True)
        for part, whole in zip(alone, found, strict=True):
            torch.testing.assert_close(whole[number], part, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("out", [-3.0, 0.4, 7.0, float("nan")])
def test_parameters_are_read_as_they_are(renderer: Renderer, out: float) -> None:
    """Each call has the values at its time, those of `data` too, moved into their ranges."""
    module = vkbloom_torch.Bloom(SETTINGS, learn=("intensity", "threshold"), renderer=renderer)
    module, image = module.to(DEVICE), tensor(9, 8, 3, seed=1).detach()
    for value in (0.25, out, 0.75):
        module.learned["intensity"].data.fill_(value)
        if np.isnan(value):
            with pytest.raises(ValueError, match="nan"):
                module(image)
            continue
        held = min(max(value, 0.0), module._ranges["intensity"][1])
        settings = SETTINGS.replace(intensity=held)
        torch.testing.assert_close(
            module(image), vkbloom_torch.bloom(image, settings, renderer=renderer)
        )
        assert module.learned["intensity"].item() == pytest.approx(held)


@pytest.mark.parametrize(
    "settings",
    [
        # Powers and roots of black pixels, whose slope is infinite.
        vkbloom.Pyramid(levels=2, encoding="srgb", intensity=0.0),
        vkbloom.Separable(encoding="hlg", intensity=0.0, alpha="blur"),
        vkbloom.DualKawase(levels=2, tonemap="agx", threshold=0.5, glare=(vkbloom.Ghosts(),)),
        vkbloom.BlenderGlare(type="fog_glow", threshold=0.3, saturation=0.5),
        vkbloom.HdrpBloom(alpha="max"),
    ],
    ids=lambda settings: settings.method,
)
def test_pytorch_derives_the_reference(settings: Any) -> None:
    """Its derivatives are those of `vjp`, and results stay on the device."""
    image, mask = tensor(7, 9, 4, dtype=torch.float64), tensor(7, 9, dtype=torch.float64)
    with torch.no_grad():
        image[1, 2, :3] = 0
        image[3, 4, 0] = float("nan")
    found: Any = reference.apply(image, settings, mask=mask)
    arrays = [part.detach().cpu().numpy() for part in (image, mask)]
    expected, pullback = reference.vjp(arrays[0], settings, mask=arrays[1])
    cotangent = np.random.default_rng(1).random((7, 9, 4))
    final = found["final"]
    assert final.device == image.device
    assert final.dtype == torch.float64
    assert_allclose(final.detach().cpu().numpy(), expected["final"], rtol=1e-12, atol=1e-12)
    (final.nan_to_num() * torch.tensor(cotangent, device=DEVICE)).sum().backward()
    gradients = pullback({"final": np.where(np.isfinite(expected["final"]), cotangent, 0)})
    for name, part in (("image", image), ("mask", mask)):
        derivative = part.grad.cpu().numpy()
        # Channels of the fog glow that are equal but for roundings are at a kink of `vjp`.
        assert_allclose(derivative, gradients[name], rtol=1e-5, atol=1e-6, err_msg=name)


def test_the_reference_refuses_what_numpy_has_not() -> None:
    with pytest.raises(TypeError, match=r"torch.Tensor: torch.bfloat16 is not a dtype of NumPy"):
        reference.apply(tensor(4, 5, 3, dtype=torch.bfloat16), "kino")


def test_laws_take_tensors_that_record() -> None:
    def halve(image: Any) -> Any:
        return torch.tensor(image, device=DEVICE, requires_grad=True) / 2

    testing.assert_laws(halve, "gain", "finite", gain=0.5, size=(24, 16))
