"""Derivatives from a renderer: those of the reference, in float32."""

from __future__ import annotations

import copy
import functools
import pickle
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.images import random_image
from tests.planned import DeviceGradients, Inputs, pull_each, watch_submissions
from tests.refusals import assert_refused, rows
from vkbloom import Renderer, reference

ONES = np.ones((4, 4, 3), np.float32)


def test_arrays_may_change_before_the_pullback(renderer: Renderer) -> None:
    image = random_image(6, 8, seed=1).astype(np.float32)
    settings = vkbloom.Separable(threshold=0.5)
    cotangents = {"bloom": np.ones((6, 8, 4), np.float32)}
    expected = vkbloom.vjp(image.copy(), settings, renderer=renderer)[1](cotangents)["image"]
    _, pullback = vkbloom.vjp(image, settings, renderer=renderer)
    image[:] = 0
    assert np.array_equal(pullback(cotangents)["image"], expected)


def test_what_has_no_derivative_is_named(renderer: Renderer) -> None:
    _, pullback = vkbloom.vjp(ONES, vkbloom.Pyramid(levels=2), renderer=renderer)
    with pytest.raises(ValueError, match="gradients: 'levels' has no derivative; available: image"):
        pullback({"final": ONES})["levels"]


@pytest.mark.parametrize("dtype", [np.float32, np.float16, np.uint8])
@pytest.mark.parametrize("names", [(), ("mask",), ("emission",), ("mask", "emission")])
def test_uploaded_images_have_the_derivatives_of_their_arrays(
    renderer: Renderer, dtype: Any, names: tuple[str, ...]
) -> None:
    scale = 255 if dtype == np.uint8 else 1
    pixels = (random_image(7, 6, channels=4, seed=seed).clip(0, 1) * scale for seed in (1, 2))
    image, emission = (one.astype(dtype) for one in pixels)
    if dtype != np.uint8:
        image[1, 2] = (np.nan, np.inf, -0.25, 0.5)
    mask = np.random.default_rng(3).random((7, 6), np.float32)
    given: Any = {name: {"mask": mask, "emission": emission}[name] for name in names}
    settings = vkbloom.Pyramid(levels=2, threshold=0.3, knee=0.5)
    cotangents = {"final": np.ones((7, 6, 4), np.float32)}
    frames, pullback = vkbloom.vjp(image, settings, **given, renderer=renderer)
    expected = dict(pullback(cotangents).items())
    uploaded = renderer.upload(image, **given)
    for part in (image, emission, mask):
        part[:] = 0
    found_frames, pullback = vkbloom.vjp(uploaded, settings, renderer=renderer)
    found = pullback(cotangents)
    assert np.array_equal(found_frames["final"], frames["final"], equal_nan=True)
    assert [*found] == [*expected]
    assert all(np.array_equal(found[name], part) for name, part in expected.items())


def test_uploaded_images_are_refused_as_in_apply(renderer: Renderer) -> None:
    uploaded = renderer.upload(ONES)
    for name, given in (("mask", ONES[..., 0]), ("emission", ONES)):
        wrong: Any = {name: given}
        with pytest.raises(ValueError, match=f"{name}: the image was uploaded already"):
            vkbloom.vjp(uploaded, vkbloom.Pyramid(), **wrong, renderer=renderer)
    with Renderer(renderer.info.name) as other:
        messages = []
        for call in (other.apply, functools.partial(vkbloom.vjp, renderer=other)):
            use: Any = call
            with pytest.raises(ValueError) as raised:  # noqa: PT011  the same as of apply
                use(uploaded, vkbloom.Pyramid())
            messages.append(str(raised.value))
    assert messages[0] == messages[1]


def through_pickle(value: Any) -> Any:
    return pickle.loads(pickle.dumps(value))


@pytest.mark.parametrize("copied", [through_pickle, copy.copy, copy.deepcopy])
@pytest.mark.parametrize("settings", [vkbloom.Pyramid(threshold=0.2), vkbloom.HdrpBloom()])
def test_what_vjp_returns_can_be_pickled_and_copied(
    renderer: Renderer, settings: Any, copied: Any
) -> None:
    """Also derivatives that were not read yet, and a pullback, on any renderer."""
    image, mask = random_image(6, 7, seed=1).astype(np.float32), np.ones((6, 7), np.float32)
    cotangents = {"final": image}
    for vjp in (functools.partial(vkbloom.vjp, renderer=renderer), reference.vjp):
        frames, pullback = vjp(image, settings, mask=mask)
        expected = dict(pullback(cotangents))
        for found in (copied(pullback)(cotangents), copied(pullback(cotangents))):
            assert [*found] == [*expected]
            for name, part in expected.items():
                np.testing.assert_array_equal(found[name], part)
            with pytest.raises(ValueError, match="gradients: 'levels' has no derivative"):
                found["levels"]
        np.testing.assert_array_equal(copied(frames)["final"], frames["final"])


def test_after_an_error_derivatives_are_read_again() -> None:
    """An error, of the device or of the host's memory, takes no source of derivatives away."""
    errors: list[Exception] = [vkbloom.OutOfMemoryError("full"), MemoryError()]

    def fields() -> dict[str, Any]:
        if len(errors) == 2:
            raise errors.pop(0)
        return {"exposure": np.float32(1)}

    def every() -> dict[str, Any]:
        if errors:
            raise errors.pop(0)
        return {"exposure": np.float32(2), "radius": np.float32(3)}

    names = ("exposure", "radius")
    gradients = DeviceGradients({}, names, ({"exposure"}, fields), (names, every))
    with pytest.raises(vkbloom.OutOfMemoryError):
        gradients["radius"]
    assert gradients["exposure"] == 1
    with pytest.raises(MemoryError):
        gradients["radius"]
    assert gradients["radius"] == 3
    assert gradients["exposure"] == 1


def test_a_field_has_the_same_bits_however_it_is_read(renderer: Renderer) -> None:
    image = random_image(9, 8, seed=1).astype(np.float32)
    settings = vkbloom.Separable(threshold=0.2, knee=0.5, intensity=0.7, exposure=0.3)
    _, pullback = vkbloom.vjp(image, settings, renderer=renderer)
    cotangents = {"final": random_image(9, 8, seed=2).astype(np.float32)}
    readings: tuple[Any, ...] = (
        lambda found: dict(found.items()),
        lambda found: dict(zip(found, found.values(), strict=True)),
        lambda found: {name: found[name] for name in found},
        lambda found: {name: found.get(name) for name in reversed([*found])},
        lambda found: (found["knee"], dict(found.items()))[1],
        lambda found: (repr(found), dict(found))[1],
    )
    first, *others = (read(pullback(cotangents)) for read in readings)
    for other in others:
        assert all(np.array_equal(part, other[name]) for name, part in first.items())


def test_only_what_is_read_is_computed(monkeypatch: pytest.MonkeyPatch, renderer: Renderer) -> None:
    """Sums, weights of a field of kernels, and derivatives by images have passes of their own."""
    submitted = watch_submissions(monkeypatch)
    lens = vkbloom.psf.Varying(np.ones((2, 3, 3)), weights=np.ones((2, 2, 2)))
    settings = vkbloom.Convolution(lens, threshold=0.2, knee=0.5)
    image, cotangent = (random_image(9, 8, seed=seed).astype(np.float32) for seed in (1, 2))
    inputs, cotangents = Inputs(image), {"final": cotangent}
    expected = vkbloom.vjp(image, settings, renderer=renderer)[1](cotangents)
    table: tuple[tuple[list[str], bool, list[str]], ...] = (
        (["psf.weights"], True, ["images", "weights"]),
        (["psf.weights"], False, ["weights"]),
        (["intensity", "threshold"], True, ["all"]),
        (["intensity", "threshold"], False, ["sums"]),
        (["psf.weights", "intensity"], False, ["sums", "weights"]),
        ([], True, ["images"]),
    )
    for names, images, kinds in table:
        wanted = ["image", *names] if images else names
        right = {name: expected[name] for name in wanted}
        submitted.clear()
        pulled = [(inputs, cotangents)]
        (found,) = pull_each(renderer, settings, pulled, names, images=images)
        for name in wanted:
            np.testing.assert_allclose(found[name], right[name], rtol=1e-5, err_msg=name)
        assert submitted == kinds


@pytest.mark.parametrize(("call", "error"), rows(__file__, "cotangents"))
def test_wrong_cotangent_is_refused_by_name(renderer: Renderer, call: str, error: str) -> None:
    of_device: Any = functools.partial(vkbloom.vjp, renderer=renderer)
    for vjp in (of_device, reference.vjp):
        names = {"pullback": vjp(ONES, vkbloom.Separable())[1], "ONES": ONES, "np": np}
        assert_refused(call, error, names)
