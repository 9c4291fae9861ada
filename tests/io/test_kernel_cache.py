"""The cache of kernels on disk: found again, and only where nothing else can change them."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vkbloom import BlenderGlare, Convolution, Pyramid, psf
from vkbloom import _array_cache as array_cache
from vkbloom._core_kernel import core_kernel
from vkbloom._psf import core_kernels as kernels

SIZES = (8, 6), (8, 6)
APERTURE = psf.aperture(psf.iris(size=16), f_number=2, pixel_pitch=8)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("VKBLOOM_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(kernels, "MIN_SECONDS", 0)
    # Nothing is found in memory.
    monkeypatch.setattr(array_cache, "_of_renderers", lambda: array_cache.ArrayCache(0, 0))
    return tmp_path / "cache" / "kernels"


COLOURS = np.random.default_rng(1).random((5, 6, 3))
PADDED = np.pad(COLOURS, ((3, 0), (1, 2), (0, 0)))


@pytest.mark.parametrize(
    ("values", "channels"),
    [
        (COLOURS, 4),
        (PADDED, 4),
        (COLOURS[..., 0], 1),
        (np.repeat(PADDED[..., :1], 3, axis=2), 1),
        (np.zeros((3, 2)), 1),
    ],
)
def test_what_is_read_is_what_was_written(values: np.ndarray[Any, Any], channels: int) -> None:
    made = core_kernel(values)
    assert made.pixels.shape == (*values.shape[:2], channels)
    found = kernels._unpack(kernels._pack(made))
    assert np.array_equal(found.pixels, made.pixels)
    assert found[1:] == made[1:]


@pytest.mark.parametrize(
    "settings",
    [Convolution(APERTURE), Convolution(psf.unreal(APERTURE)), BlenderGlare(type="fog_glow")],
)
def test_methods_use_it(
    folder: Path, settings: Convolution | BlenderGlare, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = settings.core_kernel(*SIZES)
    (file,) = folder.iterdir()
    with monkeypatch.context() as patch:
        patch.setattr("vkbloom._psf.core_kernels.core_kernel", lambda _: pytest.fail("made again"))
        assert np.array_equal(settings.core_kernel(*SIZES).pixels, made.pixels)
    file.write_bytes(file.read_bytes()[:-1])
    assert np.array_equal(settings.core_kernel(*SIZES).pixels, made.pixels)
    settings.core_kernel((8, 5), (8, 5))
    assert len([*folder.iterdir()]) == 2


@dataclasses.dataclass(frozen=True)
class mine(psf.spencer):
    """A function of a user, whose formula may change."""


@pytest.mark.parametrize(
    "spread",
    [
        mine(),
        psf.samples(np.eye(3)),
        psf.measured(Pyramid(levels=2), size=(8, 8)),
        psf.unreal(psf.measured(Pyramid(levels=2), size=(8, 8))),
    ],
)
def test_what_may_change_is_not_written(folder: Path, spread: psf.PSF) -> None:
    Convolution(spread).core_kernel(*SIZES)
    assert not folder.exists()


@pytest.mark.parametrize("module", [None, "vkbloom._psf.eye"])
def test_a_class_that_is_defined_again(folder: Path, module: str | None) -> None:
    """As in a notebook: of the same name and fields, and another formula."""
    kernel_sets: list[list[np.ndarray[Any, Any]]] = []
    for shift in (0, 1):

        class Shifted(Convolution):
            def _kernel(self, *_: Any) -> Any:
                return np.roll(np.eye(3)[..., None], shift, 0)  # noqa: B023

        class shifted(psf.spencer):
            def array(self, *_: Any) -> Any:
                return np.roll(np.eye(3)[..., None].repeat(3, 2), shift, 0)  # noqa: B023

        for kind in (Shifted, shifted) if module else ():
            kind.__module__ = module or ""
        made = Shifted(), Convolution(shifted())
        kernel_sets.append([settings.core_kernel(*SIZES).pixels for settings in made])
    for first, second in zip(*kernel_sets, strict=True):
        assert not np.array_equal(first, second)
    assert not folder.exists()


def test_what_is_fast_is_not_written(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernels, "MIN_SECONDS", 1000)
    Convolution(APERTURE).core_kernel(*SIZES)
    assert not folder.exists()


def test_another_formula_is_another_kernel(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    Convolution(APERTURE).core_kernel(*SIZES)
    monkeypatch.setattr(np, "__version__", "1.0")
    monkeypatch.setattr(kernels, "_formulas", kernels._formulas.__wrapped__)
    Convolution(APERTURE).core_kernel(*SIZES)
    assert len([*folder.iterdir()]) == 2


def test_all_that_differs_is_in_the_key() -> None:
    masks = [np.eye(8), 1 - np.eye(8), np.ones((9, 9))]
    keys = [
        *((), ((),), (1,), (1.0,), ("1",), (True,), (None,), (1, 2), ((1, 2),), ((1,), 2)),
        (psf.fog_glow(8),),
        (psf.fog_glow(9),),
        *((psf.aperture(mask),) for mask in masks),
        *((psf.unreal(psf.aperture(mask)),) for mask in masks),
        *((psf.aperture(psf.iris(size=8), f_number=f),) for f in (8, 8 + 1e-15)),
        *((psf.cie_general(age),) for age in (35, 36)),
        (psf.cie_total(),),
    ]
    assert len({kernels._key(key) for key in keys} - {None}) == len(keys)
