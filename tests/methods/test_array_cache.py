"""What convolutions leave in memory: bounded by bytes, and nothing when the renderer is closed."""

from __future__ import annotations

import gc
import tracemalloc
from collections.abc import Iterator

import numpy as np
import pytest

from tests.planned import image_source
from vkbloom import Convolution, Dirt, Pyramid, Renderer, Settings, _core, psf
from vkbloom import _array_cache as array_cache

IMAGE = np.zeros((90, 160, 3), np.float32)
#: Kernels of (179, 319, 4) float32 each, some with arrays of their own.
SPREADS: list[psf.PSF] = [
    *(psf.gaussian(sigma) for sigma in range(1, 4)),
    psf.aperture(psf.iris(size=32), f_number=22),
    psf.measured(Pyramid(levels=3), size=(127, 127)),
]
KERNEL = 179 * 319 * 16


@pytest.fixture(autouse=True)
def _fixture_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Hide the renderers of other tests, which hold their kernels."""
    monkeypatch.setattr(array_cache, "_of_renderers", lambda: None)


@pytest.fixture(name="traced")
def fixture_traced() -> Iterator[None]:
    gc.collect()
    tracemalloc.start()
    yield
    tracemalloc.stop()


def settings_of(spread: psf.PSF) -> Settings:
    return Convolution(spread, kernel_size=(319, 179), glare=(Dirt(image=np.ones((99, 99, 3))),))


@pytest.mark.usefixtures("traced")
def test_nothing_is_left_of_kernels_when_the_renderer_is_closed() -> None:
    def use(spreads: list[psf.PSF]) -> None:
        with Renderer("software") as renderer:
            for spread in spreads:
                renderer.apply(IMAGE, settings_of(spread), framebuffers="final")

    use([SPREADS[0], *SPREADS[-2:]])  # imports
    gc.collect()
    before, _ = tracemalloc.get_traced_memory()
    use(SPREADS)
    gc.collect()
    after, _ = tracemalloc.get_traced_memory()
    assert after - before < KERNEL / 4, f"{after - before} bytes are left"


def test_kernels_are_kept_until_all_renderers_are_closed() -> None:
    made = Convolution(psf.gaussian(3))
    sizes = (31, 17), (31, 17)
    with Renderer("software") as outer:
        kernel = made.core_kernel(*sizes)
        with Renderer("software"):
            assert made.core_kernel(*sizes).pixels is kernel.pixels
        assert made.core_kernel(*sizes).pixels is kernel.pixels
        assert not outer.closed
    first, second = Renderer("software"), Renderer("software")
    again = made.core_kernel(*sizes)
    assert again.pixels is not kernel.pixels
    assert again.serial == kernel.serial, "the device has this kernel already"
    first.close()
    del second
    gc.collect()
    assert made.core_kernel(*sizes).pixels is not again.pixels


def test_the_bound_is_of_bytes() -> None:
    arrays = array_cache.ArrayCache(1000, 1)
    for key in range(5):
        arrays.add(key, np.zeros(300, np.uint8))
        assert arrays.find(0) is not None, "what is used stays"
    assert arrays.nbytes == 900
    assert [arrays.find(key) is not None for key in range(5)] == [True, False, False, True, True]
    arrays.add("large", np.zeros(5000, np.uint8))
    assert arrays.nbytes == 5000, "the last one stays"
    small = array_cache.ArrayCache(1000, 0)
    small.add("large", np.zeros(5000, np.uint8))
    assert small.nbytes == 0


@pytest.mark.usefixtures("traced")
def test_plans_without_a_renderer_hold_no_pixels() -> None:
    """The order of a grid is determined with the plans of many settings."""
    source = image_source(IMAGE)
    before, _ = tracemalloc.get_traced_memory()
    # More than stay in the process.
    count = 2 * array_cache.CLOSED_BYTES // KERNEL
    steps = tuple(
        (source, _core.plan(source, settings_of(psf.gaussian(1 + k / 9)), None, "fragment"))
        for k in range(count)
    )
    after, _ = tracemalloc.get_traced_memory()
    assert after - before < 1.25 * array_cache.CLOSED_BYTES
    assert all("kernel" in {name for name, *_ in ran} for ran in _core.dry_run(steps)[1:])
    assert not _core.dry_run((steps[0], steps[0]))[1]
