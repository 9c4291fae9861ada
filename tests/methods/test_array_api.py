"""The reference on arrays of other libraries. (Those of PyTorch: test_torch.py.)"""

from __future__ import annotations

import sys
from types import SimpleNamespace
from typing import Any

import array_api_compat
import array_api_strict
import numpy as np
import pytest
from numpy.testing import assert_allclose

import vkbloom
from tests.images import random_image
from tests.methods.cases import ENCODINGS, TONEMAPS, presets_of_low_levels
from vkbloom import reference, testing

IMAGE = random_image(7, 11, 3) * 2
MASK = random_image(7, 11, 1)[..., 0]
KERNEL = np.random.default_rng(5).random((5, 4, 3))
GLARE = (vkbloom.Streaks(angle=10, threshold=0.1), vkbloom.Ghosts(), vkbloom.Halo())
# Everyday settings of all methods, and formulas that these do not reach.
CASES: dict[str, vkbloom.Settings] = {
    **presets_of_low_levels(16),
    **{name: vkbloom.Separable(tonemap=name) for name in TONEMAPS},
    **{name: vkbloom.Separable(encoding=name) for name in ENCODINGS},
    **{
        name: vkbloom.Convolution(KERNEL, boundary=name)
        for name in ("zero", "edge", "wrap", "wrap_x")
    },
    **{
        name: vkbloom.BlenderGlare(type=name, threshold=0.5)
        for name in ("streaks", "ghosts", "fog_glow", "simple_star", "sun_beams")
    },
    "field": vkbloom.Convolution(psf=vkbloom.psf.Varying([[KERNEL, KERNEL[::-1]]])),
    "glare": vkbloom.Pyramid(levels=2, glare=GLARE, format="rg11b10ufloat"),
    "stored": vkbloom.DualKawase(levels=2, format="rgba8unorm-srgb"),
}


def strict(array: Any) -> Any:
    return array_api_strict.asarray(array)


def assert_same(found: Any, expected: Any) -> None:
    assert [*found] == [*expected]
    for name, part in expected.items():
        assert type(found[name]) is type(strict(0.0))
        assert found[name].dtype == array_api_strict.float64
        values = np.from_dlpack(found[name])
        assert_allclose(values, part, rtol=1e-12, atol=1e-12, err_msg=name)


@pytest.mark.parametrize("settings", CASES.values(), ids=CASES)
def test_every_method_runs_by_the_standard(settings: Any) -> None:
    expected = reference.apply(IMAGE, settings, mask=MASK)
    assert_same(reference.apply(strict(IMAGE), settings, mask=strict(MASK)), expected)


@pytest.mark.parametrize("exposure", vkbloom.exposures)
def test_exposures_meter_what_is_copied_to_the_host(exposure: str) -> None:
    state = reference.apply(IMAGE, "godot_4_6", exposure=exposure)
    expected = reference.apply(IMAGE, "godot_4_6", exposure=exposure, state=state)
    given = {name: strict(part) for name, part in state.items()}
    found = reference.apply(strict(IMAGE), "godot_4_6", exposure=exposure, state=given)
    assert_same(found, expected)
    assert_same(reference.expose(strict(IMAGE), exposure), reference.expose(IMAGE, exposure))


def test_other_functions_and_arguments() -> None:
    """Also alpha, values that are not finite, uint8, arrays of NumPy beside, and dither."""
    image, emission = (random_image(5, 6, 4, seed=seed) for seed in (1, 2))
    image[1, 2] = np.nan, np.inf, -np.inf, 0.5
    settings = vkbloom.Pyramid(levels=2, alpha="blur", composite="mix", threshold=0.5, knee=0.5)
    expected = reference.apply(image, settings, emission=emission)
    assert_same(reference.apply(strict(image), settings, emission=emission), expected)
    assert_same(reference.apply(image, settings, emission=strict(emission)), expected)
    small = (emission * 255).astype(np.uint8)
    dithered = vkbloom.Separable(dither=True)
    assert_same(reference.apply(strict(small), dithered), reference.apply(small, dithered))
    assert_same(reference.passes(strict(IMAGE), "kino"), reference.passes(IMAGE, "kino"))
    for function, arrays in (
        (reference.blur, (IMAGE, "kino")),
        (reference.composite, (IMAGE, IMAGE, dithered)),
        (reference.shade, (IMAGE,) * 4),
    ):
        call: Any = function
        given = (strict(part) if part is IMAGE else part for part in arrays)
        assert_same({"": call(*given)}, {"": call(*arrays)})


def test_what_other_arrays_cannot_do_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    image = strict(IMAGE)
    by_function = vkbloom.psf.Varying(function=lambda u, v: np.ones((3, 3)))
    calls: tuple[Any, ...] = (
        lambda: reference.apply(image, "kino", taa="bevy"),
        lambda: reference.apply(image, vkbloom.Convolution(psf=by_function)),
    )
    for refused in calls:
        with pytest.raises(TypeError, match=r"temporal .* run on NumPy's arrays only"):
            refused()
    # As of JAX, which has no doubles by default.
    single = SimpleNamespace(float64=array_api_strict.float32, astype=array_api_strict.astype)
    libraries = iter((single, array_api_strict, single))
    with monkeypatch.context() as patch:
        patch.setattr(array_api_compat, "array_namespace", lambda array: next(libraries))
        with pytest.raises(TypeError, match=r"image: array_api_strict.*Array has no float64 here"):
            reference.apply(image, "kino")
        single.float64 = array_api_strict.float64
        with pytest.raises(TypeError, match=r"mask: .* is not of the library of image"):
            reference.apply(image, "kino", mask=strict(MASK))
    monkeypatch.setitem(sys.modules, "array_api_compat", None)
    with pytest.raises(ModuleNotFoundError, match=r"needs array_api_compat: pip .*\[arrays\]"):
        reference.apply(image, "kino")


def test_laws_take_other_arrays() -> None:
    """Also of a library whose arrays NumPy knows by DLPack only."""

    class OnlyDlpack:
        def __init__(self, array: Any) -> None:
            self._array = array

        def __dlpack__(self, **options: Any) -> Any:
            return self._array.__dlpack__(**options)

        def __dlpack_device__(self) -> Any:
            return self._array.__dlpack_device__()

    for convert in (strict, OnlyDlpack):

        def halve(image: Any, convert: Any = convert) -> Any:
            return convert(np.asarray(image / 2, np.float32))

        testing.assert_laws(halve, "gain", "superposition", "finite", gain=0.5, size=(24, 16))
