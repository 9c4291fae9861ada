"""The cache of kernels on disk: found again, never trusted, and bounded by bytes."""

from __future__ import annotations

import dataclasses
import shutil
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vkbloom import BlenderGlare, Convolution, Pyramid, Renderer, psf
from vkbloom import _array_cache as array_cache
from vkbloom._core_kernel import CoreKernel, core_kernel
from vkbloom.psf import _kernel_cache as kernel_cache

SPREAD = psf.spencer()
APERTURE = psf.aperture(psf.iris(size=16), f_number=2, pixel_pitch=8)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("VKBLOOM_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(kernel_cache.CACHE, "written", {})
    monkeypatch.setattr(kernel_cache, "MIN_SECONDS", 0)
    # Nothing is found in memory.
    monkeypatch.setattr(array_cache, "_of_renderers", lambda: array_cache.ArrayCache(0, 0))
    return tmp_path / "cache" / "kernels"


def no_kernel() -> CoreKernel:
    raise AssertionError("made again")


def kernel_of(number: float, side: int = 4) -> Callable[[], CoreKernel]:
    return lambda: core_kernel(np.full((side, side), number))


def same(kernel: CoreKernel, other: CoreKernel) -> bool:
    return np.array_equal(kernel.pixels, other.pixels) and kernel[1:] == other[1:]


COLOURS = np.random.default_rng(1).random((5, 6, 3))
PADDED = np.pad(COLOURS, ((3, 0), (1, 2), (0, 0)))


@pytest.mark.parametrize(
    "values", [COLOURS, PADDED, COLOURS[..., 0], PADDED[..., 0], np.zeros((3, 2))]
)
def test_what_is_found_is_what_was_written(values: np.ndarray[Any, Any]) -> None:
    made = kernel_cache.find_or_make((SPREAD, 1), lambda: core_kernel(values))
    assert same(kernel_cache.find_or_make((SPREAD, 1), no_kernel), made)


@pytest.mark.parametrize(
    "settings",
    [Convolution(APERTURE), Convolution(psf.unreal(APERTURE)), BlenderGlare(type="fog_glow")],
)
def test_methods_use_it(folder: Path, settings: Convolution | BlenderGlare) -> None:
    made = settings.core_kernel((8, 6), (8, 6))
    (file,) = folder.iterdir()
    file.touch()
    before = file.stat()
    found = settings.core_kernel((8, 6), (8, 6))
    assert same(found, made)
    assert file.stat().st_ino == before.st_ino, "written again"
    settings.core_kernel((8, 5), (8, 5))
    assert len([*folder.iterdir()]) == 2


def test_the_device_gets_the_same(folder: Path) -> None:
    image = np.random.default_rng(2).random((6, 8, 3), np.float32)
    blooms = []
    for _ in range(2):
        with Renderer("software") as renderer:
            blooms.append(renderer.apply(image, Convolution(APERTURE))["bloom"])
        assert len([*folder.iterdir()]) == 1
    np.testing.assert_array_equal(blooms[0], blooms[1])


def damages(content: bytes) -> list[bytes]:
    flipped = [bytearray(content) for _ in range(5)]
    for place, damaged in zip((0, 20, 60, 80, -1), flipped, strict=True):
        damaged[place] ^= 1
    return [b"", content[:10], content[:60], content[:-1], content + b"\0", *map(bytes, flipped)]


def test_a_damaged_file_is_replaced(folder: Path) -> None:
    made = kernel_cache.find_or_make((SPREAD,), kernel_of(1))
    (file,) = folder.iterdir()
    content = file.read_bytes()
    for damaged in damages(content):
        file.write_bytes(damaged)
        assert same(kernel_cache.find_or_make((SPREAD,), kernel_of(1)), made)
        assert file.read_bytes() == content


def test_the_file_of_another_kernel_is_not_used(folder: Path) -> None:
    kernel_cache.find_or_make((SPREAD,), kernel_of(1))
    (file,) = folder.iterdir()
    kernel_cache.find_or_make((APERTURE,), kernel_of(2))
    (other,) = {*folder.iterdir()} - {file}
    shutil.copy(other, file)
    assert same(kernel_cache.find_or_make((SPREAD,), kernel_of(1)), kernel_of(1)())


def test_a_folder_that_cannot_be(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for place in (str(tmp_path / "file"), "", "/proc/self/none"):
        monkeypatch.setenv("VKBLOOM_CACHE_DIR", place)
        for _ in range(2):
            assert kernel_cache.find_or_make((SPREAD,), kernel_of(1)).pixels[0, 0, 0] == 1


def test_many_at_once_leave_one_whole_file(folder: Path) -> None:
    # Each writes a file of its own and renames it, as processes do.
    with ThreadPoolExecutor(8) as threads:
        found = [
            threads.submit(kernel_cache.find_or_make, (SPREAD,), kernel_of(1, 200))
            for _ in range(32)
        ]
    assert all(same(one.result(), found[0].result()) for one in found)
    assert len([*folder.iterdir()]) == 1
    kernel_cache.find_or_make((SPREAD,), no_kernel)


def test_files_are_bounded_by_bytes(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kernel_cache.find_or_make((0,), kernel_of(1))
    size = next(folder.iterdir()).stat().st_size
    monkeypatch.setattr(kernel_cache.CACHE, "max_bytes", 3 * size)
    for number in (1, 2, 0, 3):  # 0 is found, so that 1 is the oldest.
        # Of another process each.
        monkeypatch.setattr(kernel_cache.CACHE, "written", {})
        kernel_cache.find_or_make((number,), kernel_of(1))
    assert len([*folder.iterdir()]) == 3
    for number in (0, 2, 3):
        kernel_cache.find_or_make((number,), no_kernel)
    with pytest.raises(AssertionError, match="made again"):
        kernel_cache.find_or_make((1,), no_kernel)


def test_another_formula_is_another_kernel(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, folder: Path
) -> None:
    copy = tmp_path / "package"
    shutil.copytree(kernel_cache._PACKAGE, copy, ignore=shutil.ignore_patterns("*.so"))
    monkeypatch.setattr(kernel_cache, "_PACKAGE", copy)
    changed = ["psf/radial.py", "psf/aperture.py", *kernel_cache._SOURCES]
    monkeypatch.setattr(kernel_cache, "_formulas", kernel_cache._formulas.__wrapped__)
    for number, name in enumerate(changed):
        kernel_cache.find_or_make((SPREAD,), kernel_of(number))
        assert len([*folder.iterdir()]) == number + 1
        with (copy / name).open("a") as file:
            file.write("\n")
    monkeypatch.setattr(np, "__version__", "1.0")
    kernel_cache.find_or_make((SPREAD,), kernel_of(1))
    assert len([*folder.iterdir()]) == len(changed) + 1
    # Without the source, a change would not be noticed.
    (copy / changed[0]).unlink()
    (copy / changed[0]).mkdir()
    kernel_cache.find_or_make((SPREAD,), kernel_of(1))
    assert len([*folder.iterdir()]) == len(changed) + 1


@dataclasses.dataclass(frozen=True)
class mine(psf.spencer):
    """A function of a user, whose formula may change."""


@pytest.mark.parametrize(
    "what",
    [
        mine(),
        psf.samples(np.eye(3)),
        psf.measured(Pyramid(levels=2), size=(8, 8)),
        psf.unreal(psf.measured(Pyramid(levels=2), size=(8, 8))),
        np.eye(3),
    ],
)
def test_what_may_change_is_not_written(folder: Path, what: object) -> None:
    kernel_cache.find_or_make((what,), kernel_of(1))
    assert not folder.exists()


def test_all_that_differs_is_in_the_key() -> None:
    masks = [np.eye(8), 1 - np.eye(8), np.ones((9, 9))]
    keys = [
        (),
        ((),),
        (1,),
        (1.0,),
        ("1",),
        (True,),
        (None,),
        (1, 2),
        ((1, 2),),
        ((1,), 2),
        (psf.fog_glow(8),),
        (psf.fog_glow(9),),
        *((psf.aperture(mask),) for mask in masks),
        *((psf.unreal(psf.aperture(mask)),) for mask in masks),
        *((psf.aperture(psf.iris(size=8), f_number=f),) for f in (8, 8 + 1e-15)),
        *((psf.cie_general(age),) for age in (35, 36)),
        (psf.cie_total(),),
    ]
    assert len({kernel_cache._key(key) for key in keys} - {None}) == len(keys)


@pytest.mark.parametrize(("seconds", "files"), [(1.5, 0), (2, 1)])
def test_only_what_took_long_has_a_file(
    folder: Path, monkeypatch: pytest.MonkeyPatch, seconds: float, files: int
) -> None:
    now = 0.0

    def make() -> CoreKernel:
        nonlocal now
        now += seconds
        return kernel_of(1)()

    monkeypatch.setattr(kernel_cache, "MIN_SECONDS", 2)
    monkeypatch.setattr("time.thread_time", lambda: now)
    kernel_cache.find_or_make((SPREAD,), make)
    assert len([*folder.glob("*")]) == files
