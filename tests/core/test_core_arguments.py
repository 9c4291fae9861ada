"""The core checks what it is given, also where the package has checked it before."""

from __future__ import annotations

import gc
import threading
import weakref
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vkbloom import Renderer, Scene, Separable, _core
from vkbloom.renderer import _render_arguments

METHODS = ("bevy", "kino", "filament", "urp", "hdrp", "unreal")


class Given:
    """Settings as far as an object has them; objects of this type have different attributes."""


def settings_with(**fields: Any) -> object:
    given = Given()
    complete = {"method": "separable", "weights": (1.0,), "layers": ((1.0, 1.0),)}
    vars(given).update({**complete, **fields})
    return given


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"blur_scale": -1.0}, "blur_scale: -1.0 is out of range, 0.0 to 16.0"),
        ({"blur_scale": float("nan")}, "blur_scale: nan is out of range"),
        ({"blur_scale": "1"}, "real number"),
        ({"composite": "divide"}, "composite: there is no 'divide'"),
        ({"composite": 5}, "composite: there is no 5"),
        ({"format": "bgra8unorm"}, "format: 'bgra8unorm' is no format of bloom buffers"),
        ({"format": "depth32float"}, "format: 'depth32float' is no format"),
        ({"format": 5}, "format: 5 is no format"),
        ({"bloom_size": (0, 5)}, r"bloom_size: \(0, 5\) is out of range"),
        ({"bloom_size": 5}, "bloom_size: a tuple is needed, not 5"),
        ({"method": "gauss"}, "method: there is no 'gauss'"),
        ({"method": None}, "method: there is no None"),
        ({"weights": ()}, "weights: 0 weights are out of range, 1 to"),
        ({"weights": (1.0,) * 100}, "weights: 100 weights are out of range"),
        ({"weights": 5}, "len|sequence"),
        ({"weights": ("a",)}, "real number"),
        ({"layers": ()}, "layers: 0 layers are out of range, 1 to"),
        ({"weights": (1.0, float("nan"))}, "weights: nan is out of range"),
        ({"weights": (float("inf"),)}, "weights: inf is out of range"),
        ({"weights": (-1e39,)}, "weights: -1e\\+39 is out of range"),
        ({"layers": ((1.0, float("inf")),)}, r"layers: \(1.0, inf\) is out of range, 0.0 to 16.0"),
        ({"layers": ((float("nan"), 1.0),)}, "layers: .* is out of range, 0.0 to 16.0"),
        ({"layers": ((-1.0, 1.0),)}, "layers: .* is out of range, 0.0 to 16.0"),
        ({"layers": ((16.5, 1.0),)}, "layers: .* is out of range, 0.0 to 16.0"),
        ({"layers": ((1.0, 1.0), (1.0, -0.5))}, "layers: .* is out of range, 0.0 to 16.0"),
        ({"layers": ((1.0, 1.0),) * 9}, "layers: 9 layers are out of range, 1 to 8"),
        ({"layers": (1.0,)}, "layers: a tuple is needed, not 1.0"),
        ({"layers": 5}, "len|sequence"),
    ],
)
def test_settings(fields: dict[str, Any], message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        _core.describe(settings_with(**fields), (16, 16), True, "forward")


@pytest.mark.parametrize("name", sorted(_core.VALUES))
def test_every_number_has_a_range(name: str) -> None:
    _, low, high = _core.VALUES[name]
    for wrong in (low - 1, high + 1, np.nextafter(low, -np.inf), np.inf, -np.inf, np.nan, 1e300):
        with pytest.raises(ValueError, match=f"{name}: .* is out of range"):
            _core.describe(settings_with(**{name: float(wrong)}), (16, 16), True, "forward")


@pytest.mark.parametrize("method", ["pyramid", "dual_kawase", *METHODS])
@pytest.mark.parametrize("side", [1, 16, 32768])
def test_the_ends_of_all_ranges_together(method: str, side: int) -> None:
    """Every number at its least or its most: no index or size follows that is out of bounds."""
    for end in (1, 2):
        fields = {name: row[end] for name, row in _core.VALUES.items()}
        settings = settings_with(method=method, **{**fields, "bloom": 1})
        for size in ((side, side), (side, 1), (1, side)):
            try:
                _core.describe(settings, size, True, "deferred")
            except ValueError as error:
                assert "out of this adapter's range" in str(error)  # noqa: PT017


@pytest.mark.parametrize("missing", ["weights", "layers"])
def test_a_separable_blur_has_weights_and_layers(missing: str) -> None:
    settings = settings_with()
    delattr(settings, missing)
    with pytest.raises(ValueError, match=f"{missing}: a separable blur needs them"):
        _core.describe(settings, (16, 16), True, "forward")


def test_objects_of_one_type_may_differ_in_attributes() -> None:
    """Once the first object of a type settled which attributes were read of all others."""
    _core.describe(settings_with(), (16, 16), True, "forward")
    with pytest.raises(ValueError, match="loops: 17 is out of range"):
        _core.describe(settings_with(loops=17), (16, 16), True, "forward")


def test_types_of_settings_are_not_kept() -> None:
    class Passing(Given):
        method = "pyramid"

    _core.describe(Passing(), (16, 16), True, "forward")
    kept = weakref.ref(Passing)
    del Passing
    gc.collect()
    assert kept() is None


def test_an_error_in_a_property_is_not_hidden() -> None:
    class Failing(Given):
        method = "pyramid"

        @property
        def levels(self) -> int:
            return self.nowhere  # type: ignore[attr-defined,no-any-return]

    with pytest.raises(AttributeError, match="nowhere"):
        _core.describe(Failing(), (16, 16), True, "forward")


def test_settings_that_raise() -> None:
    class Given:
        method = "separable"

        @property
        def blur_scale(self) -> float:
            raise OSError("no disk")

    with pytest.raises(OSError, match="no disk"):
        _core.describe(Given(), (16, 16), True, "forward")
    with pytest.raises(AttributeError, match="method"):
        _core.describe(object(), (16, 16), True, "forward")


BEYOND_32_BITS = [2**32, 2**32 + 16, 2**64 + 16, 2**128, -1, -(2**32) + 16]


@pytest.mark.parametrize("side", BEYOND_32_BITS)
def test_sizes_are_not_taken_modulo_2_to_the_32(
    renderer: Renderer, scene: Scene, side: int
) -> None:
    """Once 2**32 + 16 was a side of 16."""
    arrays, camera, _, *rest = _render_arguments(scene, (8, 8), "forward", 0.0, "all")
    for size in ((side, 16), (16, side)):
        with pytest.raises(ValueError, match="is out of range, 0 to 4294967295"):
            _core.describe(Separable(), size, True, "forward")
        with pytest.raises(ValueError, match="is out of range, 0 to 4294967295"):
            _core.describe(settings_with(bloom_size=size), (16, 16), True, "forward")
        with pytest.raises(ValueError, match="is out of range, 0 to 4294967295"):
            renderer._core.render(arrays, camera, size, *rest)
    serial, body, *others = arrays
    for surface in ((side, 0, 0), (0, side, 0), (0, 0, side)):
        wrong = (serial, (*body[:4], (surface,)), *others)
        with pytest.raises(ValueError, match="is out of range, 0 to 4294967295"):
            renderer._core.render(wrong, camera, (8, 8), *rest)


def test_sides_that_are_no_whole_numbers() -> None:
    with pytest.raises(TypeError, match="is not a whole number"):
        _core.describe(Separable(), (16.5, 16), True, "forward")  # type: ignore[arg-type]


@pytest.mark.parametrize("serial", [0, -1, 2**64, 2**64 + 1])
def test_serials_have_64_bits(renderer: Renderer, scene: Scene, serial: int) -> None:
    (_, *others), *rest = _render_arguments(scene, (8, 8), "forward", 0.0, "all")
    with pytest.raises((ValueError, OverflowError)):
        renderer._core.render((serial, *others), *rest)


def test_shadings_and_sizes() -> None:
    with pytest.raises(ValueError, match="shading: there is no toon"):
        _core.describe(Separable(), (16, 16), True, "toon")
    with pytest.raises(TypeError):
        _core.describe(Separable(), 16, True, "forward")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "array",
    [
        np.zeros((4, 4, 3)),
        np.zeros((4, 4, 3), np.int32),
        np.zeros((4, 4), np.uint8),
        np.zeros((4, 4, 2), np.uint8),
        np.zeros((0, 4, 3), np.uint8),
        "image",
    ],
    ids=str,
)
def test_images(renderer: Renderer, array: Any) -> None:
    with pytest.raises((TypeError, ValueError)):
        renderer._core.apply(array, None)


def test_arrays_of_the_wrong_size(renderer: Renderer) -> None:
    batch = renderer._core.apply(np.zeros((4, 4, 3), np.uint8), None)
    with pytest.raises(ValueError, match="glow: the array has the wrong size"):
        batch.add(Separable(), lambda name, shape, dtype: np.zeros(3, dtype))
    with pytest.raises(RuntimeError, match="without points"):
        batch.submit()
    with pytest.raises(RuntimeError, match="collected once"):
        batch.collect()


def _filled(name: str, shape: tuple[int, ...], dtype: str) -> np.ndarray[Any, Any]:
    return np.empty(shape, dtype)


@pytest.mark.parametrize("names", [["final"], "final", 5], ids=str)
def test_names_that_are_no_tuple(renderer: Renderer, names: Any) -> None:
    with pytest.raises(TypeError, match="attachments: a tuple is needed"):
        renderer._core.apply(np.zeros((4, 4, 3), np.uint8), names)


@pytest.mark.parametrize("points", [0, 1, 8])
def test_a_batch_is_not_filled_from_its_own_allocations(renderer: Renderer, points: int) -> None:
    """Once the points were written past the end of their memory."""
    batch = renderer._core.apply(np.zeros((4, 4, 3), np.uint8), None)

    def allocate(name: str, shape: tuple[int, ...], dtype: str) -> np.ndarray[Any, Any]:
        with pytest.raises(RuntimeError, match="a point is being added"):
            batch.add(Separable(bloom=False), _filled)
        with pytest.raises(RuntimeError, match="a point is being added"):
            batch.submit()
        return np.empty(shape, dtype)

    for exposure in range(points):
        batch.add(Separable(exposure=exposure), _filled)
    batch.add(Separable(), allocate)
    batch.submit()
    assert len(batch.collect()) == points + 1


def test_settings_that_submit_the_batch(renderer: Renderer) -> None:
    batch = renderer._core.apply(np.zeros((4, 4, 3), np.uint8), None)
    batch.add(Separable(), _filled)

    class Given:
        method = "pyramid"

        @property
        def exposure(self) -> float:
            batch.submit()
            return 0.0

    with pytest.raises(RuntimeError, match="submitted before"):
        batch.add(Given(), _filled)
    assert len(batch.collect()) == 1


def test_a_batch_is_collected_by_one_thread(renderer: Renderer) -> None:
    image = np.random.default_rng(3).random((80, 80, 4), np.float32)
    # So that all threads wait for the renderer at once: 65 x 65 taps a pixel take a while.
    slow = Separable(weights=(1 / 65,) * 33, direct=True, blur_scale=0.5)

    def collect(batch: _core.Batch, counts: list[int]) -> None:
        try:
            counts.append(len(batch.collect()))
        except RuntimeError:
            counts.append(0)

    for exposure in range(2):
        batch = renderer._core.apply(image, None)
        batch.add(Separable(exposure=exposure), _filled)
        batch.submit()
        counts: list[int] = []
        threads = [threading.Thread(target=renderer.apply, args=(image + exposure, slow))]
        threads += [threading.Thread(target=collect, args=(batch, counts)) for _ in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert sorted(counts) == [0, 0, 1]


def test_scenes(renderer: Renderer, scene: Scene) -> None:
    arrays, *rest = _render_arguments(scene, (8, 8), "forward", 0.0, "all")
    serial, body, glow, sky, textures = arrays
    wrong = [
        (serial, (body[0].astype(np.float64), *body[1:]), glow, sky, textures),
        (serial, (body[0], body[1].astype(np.int8), *body[2:]), glow, sky, textures),
        (serial, (*body[:2], np.zeros((1, 3), np.float32), *body[3:]), glow, sky, textures),
        (serial, (*body[:4], ((3, 0, 0),)), glow, sky, textures),
        (serial, body, glow, sky[:1] * 20, textures),
        (serial, body, glow, sky[:1] * 2, textures),
        (serial, body, glow, (np.zeros((6, 2, 4, 4), np.uint8),), textures),
        (serial, body, glow, (np.zeros((6, 1, 1, 4), np.uint8),) * 2, textures),
        (serial, body, glow, sky, (((), "repeat", "repeat", "linear", "linear", "linear"),)),
        (serial, body, glow, sky, ((sky, "repeat", "tile", "linear", "linear", "linear"),)),
        (serial, body, glow, sky),
        (serial, 5, glow, sky, textures),
        (serial, (*body[:4], (5,)), glow, sky, textures),
        (serial, body, glow, sky, (5,)),
    ]
    for given in wrong:
        with pytest.raises((TypeError, ValueError)):
            renderer._core.render(given, *rest)


def test_more_indices_than_32_bits_count(renderer: Renderer, scene: Scene, tmp_path: Path) -> None:
    arrays, *rest = _render_arguments(scene, (8, 8), "forward", 0.0, "all")
    serial, body, glow, sky, textures = arrays
    # A file of a hole takes no room. In 32 bits there would be three indices.
    indices = np.memmap(tmp_path / "indices", np.uint32, "w+", shape=(2**32 + 3,))
    with pytest.raises(ValueError, match="scene: 4294967299 indices are out of range"):
        renderer._core.render((serial, (body[0], indices, *body[2:]), glow, sky, textures), *rest)


def test_a_renderer_takes_no_keywords() -> None:
    make: Any = _core.Renderer
    with pytest.raises(TypeError, match="keyword"):
        make("auto", validation=True)
    for seconds in (0.0, -1.0, float("nan")):
        with pytest.raises(ValueError, match="frame_seconds: a number above 0 is needed"):
            _core.Renderer("auto", "", True, "auto", seconds, _no_cache)
    with pytest.raises(OSError, match="no cache"):
        _core.Renderer("auto", "", True, "auto", 1.0, _no_cache)
    with pytest.raises(TypeError):
        _core.Renderer("auto", "", True, "auto", 1.0, lambda uuid: "text")  # type: ignore[arg-type,return-value]


def _no_cache(uuid: bytes) -> bytes | None:
    raise OSError("no cache")
