"""What a renderer does with arrays of CUDA, over the stand-in for libcuda; prints JSON.

Arguments: "validated" or "plain", and the names of functions; all of WORK without.

The device's memory is the host's, so that arrays of NumPy stand for arrays on the device.
"""

from __future__ import annotations

import ctypes
import functools
import gc
import json
import os
import sys
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.custom import TRAIL
from tests.device.abilities import infinities
from tests.exhaustive import EXHAUSTIVE
from tests.images import picture
from tests.taa.moving import moving_frame
from vkbloom import Convolution, Pyramid, Renderer, Separable
from vkbloom._gradients.pulling import pull_each
from vkbloom._renderer.device_arrays import CudaArray, merge
from vkbloom._renderer.sources import Inputs, check_inputs

VALIDATION = "validated" in sys.argv
#: Whether calls return before the device has finished.
LATE = "waits" in os.environ.get("VKBLOOM_LESSER", "").split(",")
ADAPTER = os.environ.get("VKBLOOM_TEST_NAME") or "software"

_get = ctypes.pythonapi.PyCapsule_GetPointer
_get.restype, _get.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]


# Arrays on the device have no type of NumPy.
vjp: Any = vkbloom.vjp


class OnDevice:
    """An array of NumPy that says that it is on a device of CUDA."""

    def __init__(self, array: NDArray[Any], device: tuple[int, int] = (2, 1), code: int = 0):
        self.array, self.device, self.code = array, device, code
        self.unsigned = False
        self.streams: list[int | None] = []

    def __dlpack_device__(self) -> tuple[int, int]:
        return self.device

    def __dlpack__(self, *, stream: int | None = None) -> Any:
        # PyTorch refuses to export tensors of another device than the current one.
        assert ctypes.CDLL("libcuda.so.1").stand_in_current() == 1
        self.streams.append(stream)
        capsule = self.array.__dlpack__()
        tensor = _get(capsule, b"dltensor")
        assert tensor
        ctypes.c_int32.from_address(tensor + 8).value = self.device[0]
        ctypes.c_int32.from_address(tensor + 12).value = self.device[1]
        if self.code:
            ctypes.c_uint8.from_address(tensor + 20).value = self.code
        strides = ctypes.c_uint64.from_address(tensor + 32).value
        for axis, stride in enumerate(self.array.strides if self.unsigned else ()):
            # CuPy 14 divides negative strides as if they had no sign.
            stored = stride % 2**64 // self.array.itemsize
            ctypes.c_uint64.from_address(strides + 8 * axis).value = stored
        return capsule


def make_strided(rng: np.random.Generator, dtype: str) -> NDArray[Any]:
    """Return an image with one of many layouts."""
    height, width, channels = (
        int(rng.integers(1, 40)),
        int(rng.integers(1, 40)),
        3 + rng.integers(2),
    )
    image = picture(width, height, int(channels), dtype, seed=int(rng.integers(99)))
    match rng.integers(6):
        case 0:
            return np.moveaxis(np.ascontiguousarray(np.moveaxis(image, -1, 0)), 0, -1)
        case 1:
            return image[::-1, ::-1]
        case 2:
            return np.repeat(image, 2, axis=1)[:, ::2]
        case 3:
            large = np.zeros((height + 3, width + 5, 4), dtype)
            large[1:-2, 2:-3, : image.shape[2]] = image
            return large[1:-2, 2:-3, : image.shape[2]]
        case 4:
            return image.transpose(1, 0, 2)
    return image


def same(frames: Any, expected: Any) -> None:
    assert list(frames) == list(expected)
    for name, array in expected.items():
        made = frames[name]
        assert isinstance(made, vkbloom.DeviceArray), type(made)
        assert made.shape == array.shape
        assert made.dtype == array.dtype
        np.testing.assert_array_equal(made.numpy(), array, err_msg=name)
    assert (frames.info["nan"], frames.info["inf"]) == (expected.info["nan"], expected.info["inf"])


def layouts(renderer: Any) -> None:
    rng = np.random.default_rng(1)
    methods = (Separable(threshold=0.3), Pyramid(levels=2), Separable(bloom_scale=0.5))
    for step in range(60 if EXHAUSTIVE else 10):
        dtype = ("uint8", "float16", "float32")[step % 3]
        image = make_strided(rng, dtype)
        if dtype != "uint8" and step % 4 == 0:
            image = image.copy()
            image[0, 0, 0], image[-1, -1, -1] = np.nan, -np.inf
        mask: Any = rng.random(image.shape[:2], np.float32) if step % 5 == 0 else None
        settings = methods[step % len(methods)]
        expected = renderer.apply(image, settings, mask=mask)
        device_mask = OnDevice(mask) if mask is not None and step % 2 else mask
        given = OnDevice(image)
        given.unsigned = step % 2 == 0
        same(renderer.apply(given, settings, mask=device_mask), expected)
        # And the host's again: its image on the device was replaced.
        again = renderer.apply(image, settings, mask=mask)
        np.testing.assert_array_equal(again["final"], expected["final"])


def histories(renderer: Any) -> None:
    """A batch, images and states on the device; each image continues the one before."""
    settings = vkbloom.load_method(TRAIL, name="trail")()
    images = np.stack([picture(24, 16, 4, "float16", seed=seed) for seed in range(9)])
    expected = list(renderer.map(list(images), settings))
    for batch in (OnDevice(images), [OnDevice(image) for image in images]):
        for frames, right in zip(renderer.map(batch, settings), expected, strict=True):
            same(frames, right)
            assert frames.state == right.state
    given: Any = {"trail": renderer.apply(OnDevice(images[0]), settings)["trail"]}
    for state in (expected[0].state, given):
        same(renderer.apply(OnDevice(images[1]), settings, state=state), expected[1])


def geometries(renderer: Any) -> None:
    """Motion and depth on the device: the same bits, without a byte through the host."""
    bytes_so_far = ctypes.CDLL("libcuda.so.1").stand_in_host_bytes
    bytes_so_far.restype = ctypes.c_long
    moving = [moving_frame(number, 23, 37, nearest=0.0) for number in range(3)]
    # Motions of two floats a pixel, of halves whose words hold another pixel's, and turned ones.
    forms: tuple[Callable[[NDArray[Any]], NDArray[Any]], ...] = (
        np.asarray,
        lambda array: array.astype(np.float16),
        np.asfortranarray,
    )
    for step, form in enumerate(forms):
        given: dict[str, Any] = {"taa": ("godot", "hdrp", "o3de")[step], "exposure": "hdrp"}
        places = (("image", "motion", "depth"), ("motion",), ("image", "depth"))[step]
        motions = [form(frame.motion) for frame in moving]
        depths = [form(frame.depth) for frame in moving]
        state: Any = {}
        for frame, motion, depth in zip(moving, motions, depths, strict=True):
            parts = {"image": frame.image, "motion": motion, "depth": depth}
            expected = renderer.apply(**parts, **given, settings=LOW, state=state)
            moved = {
                name: OnDevice(part) if name in places else part for name, part in parts.items()
            }
            before = bytes_so_far()
            frames = renderer.apply(**moved, **given, settings=LOW, state=state)
            assert bytes_so_far() == before
            same(frames, expected)
            state = expected.state
        assert frames.state == state
        images = [OnDevice(frame.image) for frame in moving]
        beside = {"motion": [OnDevice(part) for part in motions], "depth": depths}
        last = list(renderer.map(images, LOW, **given, **beside))[-1]
        assert last.state == state
    image, motion, depth = (np.array(part) for part in moving[1])
    wrong = motion.copy()
    wrong[3, 4, 1], wrong[5, 6, 0], wrong[7, 8] = np.nan, np.inf, -np.inf
    holes = depth.copy()
    holes[3, 4], holes[9, 9] = np.nan, np.inf
    right = np.where(np.isfinite(wrong), wrong, 0), np.nan_to_num(holes, posinf=np.inf)
    expected = renderer.apply(image, LOW, taa="godot", motion=right[0], depth=right[1])
    moved = {"motion": OnDevice(wrong), "depth": OnDevice(holes)}
    same(renderer.apply(OnDevice(image), LOW, taa="godot", **moved), expected)
    refused: tuple[tuple[str, Any, type[Exception], str], ...] = (
        ("motion", motion.astype(np.uint8), TypeError, "uint8 is not one of float16, float32"),
        ("motion", motion[1:], ValueError, "motion: shape (22, 37, 2) is not (23, 37, 2)"),
        ("motion", depth, ValueError, "motion: shape (23, 37) is not (H, W, 2)"),
        ("depth", motion, ValueError, "depth: shape (23, 37, 2) is not (H, W)"),
        ("depth", depth.astype(float), TypeError, "float64 is not one of"),
    )
    for name, part, kind, text in refused:
        call = functools.partial(renderer.apply, image, taa="bevy", **{name: OnDevice(part)})
        raises(kind, text, call)


def streams(renderer: Any) -> None:
    image = OnDevice(picture(20, 10))
    renderer.apply(image)
    assert len(image.streams) == 1
    assert image.streams[0] not in (None, 0)


def later(renderer: Any) -> None:
    """What is taken for later is copied once: when a submission, or somebody else, reads it."""
    images = [picture(24, 16, 3, seed=seed) for seed in range(3)]
    expected = [renderer.apply(image, LOW, framebuffers="final") for image in images]
    batch = np.zeros((1, 16, 24, 3), np.float32)

    def take() -> Any:
        """Take it on CUDA's default stream."""
        array = CudaArray(batch, batch.ctypes.data, batch.shape, batch.strides, "float32", 1)
        return array.copy(renderer._core, later=True)

    def run(taken: Any) -> Any:
        return renderer._apply_inputs(Inputs(taken.at(0)), LOW, ("final",))

    # The array changes before each copy, which shows when that is made.
    first = take()
    pending = []
    for image, right in zip(images, expected, strict=True):
        taken = take()
        batch[0] = image
        frames = run(taken)
        np.testing.assert_array_equal(taken.numpy()[0], image)
        batch[0] = np.nan
        same(run(taken), right)
        pending.append((frames, right))
    for frames, right in pending:
        same(frames, right)
    batch[0] = images[1]
    np.testing.assert_array_equal(first.numpy()[0], images[1])
    batch[0] = np.nan
    same(run(first), expected[1])
    del first, taken
    # Memory that is used again has nothing left to copy.
    renderer.apply(OnDevice(images[0]), LOW)
    assert np.isnan(take().numpy()).all()
    take()
    batch[0] = images[2]
    same(renderer.apply(OnDevice(images[0]), LOW, framebuffers="final"), expected[0])


def sequences(renderer: Any) -> None:
    images = np.stack([picture(24, 16, 3, "float16", seed=i) for i in range(5)])
    expected = [renderer.apply(image) for image in images]
    moved = np.moveaxis(np.ascontiguousarray(np.moveaxis(images, -1, 1)), 1, -1)
    for batch in (images, moved, images[::2]):
        wanted = expected[::2] if len(batch) == 3 else expected
        for frames, right in zip(renderer.map(OnDevice(batch)), wanted, strict=True):
            same(frames, right)
    for frames, right in zip(
        renderer.map([OnDevice(one) for one in images]), expected, strict=True
    ):
        same(frames, right)
    settings = [Pyramid(levels=2, intensity=step / 4) for step in range(12)]
    many = renderer.sweep(OnDevice(images[0]), settings)
    for frames, one in zip(many, settings, strict=True):
        same(frames, renderer.apply(images[0], one))
    handle = renderer.upload(OnDevice(images[1]), mask=np.ones((16, 24), np.float32))
    same(renderer.apply(handle), renderer.apply(images[1], mask=np.ones((16, 24), np.float32)))


def layers(renderer: Any) -> None:
    """Batches of which each pass runs for many images, where the adapter is not a CPU."""
    images = np.stack([picture(9, 7, 3, "float16", seed=i) for i in range(10)])
    images[2, 3, 3, 1], images[9, 0, 0, 1] = infinities(renderer, "float16")[0], np.nan
    batch = OnDevice(images[:, ::-1])
    # In turns with single images: both have images of the same names.
    for settings, together in ((LOW, 10), (Separable(), 10), (Convolution(), 0), (LOW, 10)):
        frames = list(renderer.map(batch, settings))
        for made, image in zip(frames, images, strict=True):
            same(made, renderer.apply(image[::-1], settings))
        shared = len({one["final"]._memory for one in frames}) == 1
        assert shared == (renderer.info.type != "cpu" and together > 0)
    # As parts of five, of which the last begins in the one before.
    batches: Any = renderer._batches
    size = batches._size and batches._size[2]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("vkbloom._renderer.batches.MAX_BYTES", 5 * (size or 0))
        for count in (9, 10):
            part = OnDevice(images[:count, ::-1])
            frames = list(renderer.map(part, LOW, framebuffers="final"))
            for made, image in zip(frames, images[:count], strict=True):
                expected = renderer.apply(image[::-1], LOW, framebuffers="final")
                same(made, expected)
        abandoned = renderer.map(batch, LOW)
        same(next(abandoned), renderer.apply(images[0, ::-1], LOW))
        abandoned.close()
    # What the arrays of a batch give to others begins at their own pixels.
    last: Any = frames[-1]["final"]
    right = last.numpy()
    address = last.__cuda_array_interface__["data"][0]
    assert vkbloom._core.read_dlpack(last.__dlpack__(stream=1))[0] == address
    view = np.ctypeslib.as_array((ctypes.c_uint16 * right.size).from_address(address))
    np.testing.assert_array_equal(view, right.view(np.uint16).ravel())
    copied = vkbloom._core.read_dlpack(last.__dlpack__(stream=1, copy=True))[0]
    view = np.ctypeslib.as_array((ctypes.c_uint16 * right.size).from_address(copied))
    np.testing.assert_array_equal(view, right.view(np.uint16).ravel())
    same(renderer.apply(last, LOW), renderer.apply(right, LOW))
    # As PyTorch takes them: with rows of 256 bytes and more they follow one another.
    wide = np.stack([picture(32, 4, 4, "float16", seed=i) for i in range(6)])
    finals = [one["final"] for one in renderer.map(OnDevice(wide), Pyramid(levels=2))]
    found = merge([*finals, finals[0]])
    assert [len(one) for one in found] == ([6, 1] if renderer.info.type != "cpu" else [1] * 7)
    # The last one comes again; on a CPU each is an array of its own.
    joined = np.concatenate([one.numpy() for one in found])
    np.testing.assert_array_equal(joined[:6], np.stack([one.numpy() for one in finals]))


def places(renderer: Any) -> None:
    image, emission = picture(24, 16), picture(24, 16, seed=1)
    expected = renderer.apply(image, emission=emission)
    same(renderer.apply(OnDevice(image), emission=OnDevice(emission)), expected)
    same(renderer.apply(image, emission=OnDevice(emission)), expected)
    same(renderer.apply(OnDevice(image), emission=emission), expected)
    host = renderer.apply(OnDevice(image), emission=emission, device="host")
    assert isinstance(host["final"], np.ndarray)
    np.testing.assert_array_equal(host["final"], expected["final"])
    first = renderer.apply(OnDevice(image))
    second = renderer.apply(first["final"])
    same(second, renderer.apply(first["final"].numpy()))
    out, other = (
        OnDevice(np.zeros_like(image)),
        np.zeros(*renderer.plan(image).framebuffers["bloom"]),
    )
    frames = renderer.apply(OnDevice(image), out={"final": out, "bloom": other})
    np.testing.assert_array_equal(out.array, renderer.apply(image)["final"])
    assert frames["bloom"] is other
    renderer.apply(image, out={"final": out})
    assert renderer.plan(Kind(image)).framebuffers["final"] == (image.shape, image.dtype)


class Kind(OnDevice):
    """With the attributes that arrays of all libraries have."""

    @property
    def shape(self) -> tuple[int, ...]:
        return self.array.shape

    @property
    def dtype(self) -> str:
        return f"torch.{self.array.dtype}"


def capsules(renderer: Any) -> None:
    image = picture(24, 16)
    frames = renderer.apply(OnDevice(image))
    final = frames["final"]
    array: Any = final
    assert array.__dlpack_device__() == (2, 1)
    for version, name in (
        (None, b"dltensor"),
        ((0, 8), b"dltensor"),
        ((1, 1), b"dltensor_versioned"),
    ):
        capsule = array.__dlpack__(stream=1, max_version=version)
        assert _get(capsule, name)
        address, device, dtype, shape, strides = vkbloom._core.read_dlpack(capsule)
        assert (device, dtype, shape) == ((2, 1), (2, 32, 1), image.shape)
        assert strides == (24 * image.shape[2], image.shape[2], 1)
        assert address == array.__cuda_array_interface__["data"][0]
    about = array.__cuda_array_interface__
    assert about["version"] == 3
    assert about["stream"] is None
    copied = vkbloom._core.read_dlpack(array.__dlpack__(stream=1, copy=True))
    assert copied[0] != address
    np.testing.assert_array_equal(np.from_dlpack(Consumer(array)), array.numpy())
    raises(ValueError, "stream: 0", lambda: array.__dlpack__(stream=0))
    raises(BufferError, "dl_device: (2, 0)", lambda: array.__dlpack__(dl_device=(2, 0)))


def ends(renderer: Any) -> None:
    """What the host learns late: whether it reads it, lets go of it, or closes the renderer."""
    image = picture(64, 48)
    image[3, 4, 0] = np.nan
    expected = renderer.apply(image)
    frames = renderer.apply(OnDevice(image))
    assert (frames._end is not None) == LATE
    assert list(frames.timings) == list(expected.timings)
    assert frames.info["nan"] == 1
    assert frames._end is None
    # Consumers without a stream, and those that do not look at ours, cannot wait.
    for address_of in (
        lambda array: vkbloom._core.read_dlpack(array.__dlpack__(stream=-1))[0],
        lambda array: array.__cuda_array_interface__["data"][0],
    ):
        late: Any = renderer.apply(OnDevice(image))["final"]
        view = np.ctypeslib.as_array((ctypes.c_float * late.size).from_address(address_of(late)))
        np.testing.assert_array_equal(view, expected["final"].ravel())
    kept = [renderer.apply(OnDevice(image)) for _ in range(6)]
    # The next call has waited for those before.
    to_come = [one._end is not None and one._end.__self__._submission is not None for one in kept]
    assert to_come == [*[False] * 5, LATE]
    for one in kept:
        same(one, expected)
    other: Any = Renderer(ADAPTER, validation=VALIDATION)
    with other:
        left = [other.apply(OnDevice(image)) for _ in range(3)]
    assert [one.info["nan"] for one in left] == [1, 1, 1]
    np.testing.assert_array_equal(left[2]["final"].numpy(), expected["final"])


class Consumer:
    """Asks for the host's memory."""

    def __init__(self, array: Any):
        self.array = array

    def __dlpack_device__(self) -> tuple[int, int]:
        return (1, 0)

    def __dlpack__(self, **options: Any) -> Any:
        return self.array.__dlpack__(dl_device=(1, 0), max_version=(1, 0))


def recycling(renderer: Any) -> None:
    """Memory is used again when the last consumer lets go, and not before."""
    image = OnDevice(picture(64, 64))
    final = renderer.apply(image, framebuffers="final")["final"]
    address, right = final.__cuda_array_interface__["data"][0], final.numpy()
    capsule = final.__dlpack__(stream=1)
    del final
    others = [renderer.apply(image, framebuffers="final")["final"] for _ in range(5)]
    assert address not in [one.__cuda_array_interface__["data"][0] for one in others]
    del others
    view = np.ctypeslib.as_array((ctypes.c_float * right.size).from_address(address))
    np.testing.assert_array_equal(view, right.ravel())
    del capsule
    places = set()
    for _ in range(10):
        one = renderer.apply(image, framebuffers="final")["final"]
        places.add(one.__cuda_array_interface__["data"][0])
    assert len(places) <= 7


def lifetime(renderer: Any) -> None:
    other: Any = Renderer(ADAPTER)
    with other:
        image = picture(24, 16)
        final = other.apply(OnDevice(image))["final"]
        other_handle = other.upload(OnDevice(image))
        right = final.numpy()
        raises(ValueError, "uploaded to another renderer", lambda: renderer.apply(other_handle))
    np.testing.assert_array_equal(final.numpy(), right)
    capsule = final.__dlpack__(stream=1)
    del final
    gc.collect()
    assert vkbloom._core.read_dlpack(capsule)[0]
    same(renderer.apply(OnDevice(image)), renderer.apply(image))


def equal_gradients(
    found: Any, expected: Any, place: type = vkbloom.DeviceArray, tolerance: float = 0.0
) -> None:
    images = [name for name in ("image", "mask", "emission") if name in expected]
    for name in (*images, "intensity"):
        assert isinstance(found[name], place) or name not in images, name
        array = found[name].numpy() if isinstance(found[name], vkbloom.DeviceArray) else found[name]
        atol = tolerance * np.abs(expected[name]).max()
        np.testing.assert_allclose(array, expected[name], rtol=0, atol=atol, err_msg=name)
        assert array.shape == expected[name].shape
        assert array.dtype == np.float32


PULLED = (
    Separable(threshold=0.3, knee=0.5, intensity=0.4),
    Pyramid(levels=2, threshold=0.3, tonemap="reinhard"),
    vkbloom.DualKawase(levels=2),
    vkbloom.BevyBloom(max_mip_dimension=16),
    vkbloom.Convolution(psf=np.ones((3, 5, 3))),
)


def gradients(renderer: Any) -> None:
    """The bits of derivatives through NumPy, without a byte through the host."""
    bytes_so_far = ctypes.CDLL("libcuda.so.1").stand_in_host_bytes
    bytes_so_far.restype = ctypes.c_long
    rng = np.random.default_rng(2)
    for step in range(18 if EXHAUSTIVE else 6):
        settings = PULLED[step % len(PULLED)]
        image, cotangent = (
            make_strided(rng, ("float16", "float32")[step % 2]),
            make_strided(rng, "float32"),
        )
        cotangent = np.resize(cotangent, image.shape).astype(("float32", "float16")[step // 2 % 2])
        glowing: dict[str, Any] = {"emission": image[::-1].copy()} if step % 2 == 0 else {}
        expected = vjp(image, settings, **glowing, renderer=renderer)[1]({"final": cotangent})
        before = bytes_so_far()
        glowing = {name: OnDevice(part) for name, part in glowing.items()}
        frames, pullback = vjp(OnDevice(image), settings, **glowing, renderer=renderer)
        found = pullback({"final": OnDevice(cotangent)})
        assert isinstance(frames["final"], vkbloom.DeviceArray)
        assert isinstance(found["image"], vkbloom.DeviceArray)
        assert bytes_so_far() == before
        # A CPU's words are of float32, as cotangents of the host are: one product less is rounded.
        words = renderer.info.type == "cpu" and cotangent.dtype == np.float16
        tolerance = 1e-6 if words else 0.0
        equal_gradients(found, expected, tolerance=tolerance)
        equal_gradients(pullback({"final": cotangent}), expected)
        # Channels first, and all of one element, as PyTorch has them.
        first = np.ascontiguousarray(np.moveaxis(cotangent, -1, 0))
        found = pullback({"final": OnDevice(np.moveaxis(first, 0, -1))})
        equal_gradients(found, expected, tolerance=tolerance)
    one = np.lib.stride_tricks.as_strided(np.ones(1, np.float32), image.shape, (0, 0, 0))
    expected = vjp(image, Pyramid(levels=2), renderer=renderer)[1]({"final": np.ones(image.shape)})
    _, pullback = vjp(OnDevice(image), Pyramid(levels=2), renderer=renderer)
    equal_gradients(pullback({"final": OnDevice(one)}), expected)


def copies(renderer: Any) -> None:
    """Passes run once for a copy of an array. Other bytes in its memory are another picture."""
    image, settings = picture(24, 16), Pyramid(levels=2)
    other = image[::-1].copy()
    expected = [renderer.apply(part, settings, device="host")["final"] for part in (image, other)]
    inputs = check_inputs(OnDevice(image), core=renderer._core)
    calls = []
    for _ in range(2):
        frames = renderer._apply_inputs(inputs, settings, None)
        np.testing.assert_array_equal(frames["final"].numpy(), expected[0])
        calls.append(frames.timings)
    assert "final" in calls[0]
    assert not calls[1]
    held: Any = inputs.image
    held.memory.copy_bytes(held.memory.address, other.ctypes.data, other.nbytes)
    frames = renderer._apply_inputs(inputs, settings, None)
    np.testing.assert_array_equal(frames["final"].numpy(), expected[1])


def gradient_places(renderer: Any) -> None:
    """Masks, emissions, `device`, levels of bytes, other framebuffers, and what is refused."""
    image = picture(24, 16)
    mask = np.random.default_rng(1).random((16, 24), np.float32)
    settings = Separable(threshold=0.3, composite="mix", intensity=0.4)
    both = {"final": np.ones_like(image), "bloom": np.ones((16, 24, 4), np.float32)}
    expected = vjp(image, settings, mask=mask, renderer=renderer)[1](both)
    moved = {name: OnDevice(part) for name, part in both.items()}
    _, pullback = vjp(OnDevice(image), settings, mask=OnDevice(mask), renderer=renderer)
    equal_gradients(pullback(moved), expected)
    equal_gradients(pullback({**both, "bloom": OnDevice(both["bloom"].astype("u1"))}), expected)
    for device, place in (("host", np.ndarray), (None, np.ndarray), ("device", None)):
        pullback = vjp(image, settings, mask=mask, device=device, renderer=renderer)[1]
        equal_gradients(pullback(moved), expected, place or vkbloom.DeviceArray)
    # The image is not read: its derivative is 0, where the others are.
    _, pullback = vjp(OnDevice(image), settings, emission=OnDevice(image), renderer=renderer)
    found = pullback({"bloom": moved["bloom"]})["image"]
    assert isinstance(found, vkbloom.DeviceArray)
    assert not found.numpy().any()
    _, pullback = vjp(OnDevice(image), settings, renderer=renderer)
    wrong = image.copy()
    wrong[3, 4, 1] = np.nan
    refused: list[tuple[str, Any, type[Exception], str]] = [
        ("final", OnDevice(wrong), ValueError, "cotangents: 'final' has NaN or infinity"),
        ("final", OnDevice(wrong.astype("f2")), ValueError, "'final' has NaN or infinity"),
        ("final", OnDevice(image[1:]), ValueError, "the shape of 'final' is (15, 24, 4), not (16,"),
        ("final", OnDevice(image[0]), ValueError, "cotangents['final']: shape (24, 4) is not"),
        ("final", OnDevice(image, (2, 0)), ValueError, "cotangents['final']: it is on Stand-in 0"),
        ("final", OnDevice(image.astype("f8")), TypeError, "float64 is not one of"),
        ("final", OnDevice(image.astype("f2"), code=4), TypeError, "cotangents['final'].to(torch."),
        ("blom", OnDevice(image), ValueError, "unknown framebuffer 'blom'; available: glow"),
    ]
    for name, given, kind, part in refused:
        raises(kind, part, functools.partial(pullback, {name: given}))
    # An operator of PyTorch does not look at them, since the host does not wait. (The derivative by
    # a threshold without a knee is 0.)
    settings = settings.replace(knee=0.2)
    pulled = (check_inputs(OnDevice(image), core=renderer._core), {"final": wrong})
    for fields in ((), ("threshold", "intensity")):
        (derivatives,) = pull_each(renderer, settings, [pulled], fields, "cuda")
        assert not np.isfinite(np.asarray(derivatives["image"])[3, 4]).all()
        assert all(np.isnan(derivatives[name]) for name in fields)
    # NaN of the image is not the cotangent's.
    spoilt = vjp(wrong, settings, renderer=renderer)[1]({"final": image})
    equal_gradients(
        vjp(OnDevice(wrong), settings, renderer=renderer)[1]({"final": OnDevice(image)}), spoilt
    )


def raises(kind: type[Exception], part: str, call: Callable[[], object]) -> None:
    with pytest.raises(kind) as caught:
        call()
    assert part in str(caught.value), caught.value


def errors(renderer: Any) -> None:
    image = picture(24, 16)
    half = image.astype(np.float16)
    apply = renderer.apply
    wrong: list[tuple[Any, type[Exception], str]] = [
        (OnDevice(image, (2, 0)), ValueError, "Stand-in 0 (uuid:eeeeeeee-"),
        (OnDevice(image, (13, 1)), ValueError, "managed (unified) memory"),
        (OnDevice(half, code=4), TypeError, "image.to(torch.float32)"),
        (OnDevice(image.astype(np.complex64)), TypeError, "abs(image)"),
        (OnDevice(image.astype(np.float64)), TypeError, "float64 is not one of"),
        (OnDevice(image[:0]), ValueError, "sides of at least 1"),
        (OnDevice(image[..., 0]), ValueError, "is not (H, W, 3)"),
        (OnDevice(np.moveaxis(image, -1, 0)), ValueError, "image.permute(1, 2, 0)"),
        (OnDevice(image[None]), ValueError, "map(image)"),
    ]
    for given, kind, part in wrong:
        raises(kind, part, functools.partial(apply, given))
    wide = OnDevice(image)
    raises(ValueError, "emission", lambda: apply(wide, emission=OnDevice(image[1:])))
    raises(ValueError, "mask", lambda: apply(wide, mask=OnDevice(np.full((16, 24), 2, np.float32))))
    raises(ValueError, "it must have", lambda: apply(wide, out={"final": OnDevice(half)}))
    raises(ValueError, "C-contiguous", lambda: apply(wide, out={"final": OnDevice(image[:, ::-1])}))
    raises(ValueError, "device: 'gpu'", lambda: apply(wide, device="gpu"))
    # None of them has left the context in use or broken.
    same(apply(wide), apply(image))


def missing(renderer: Any) -> None:
    """With another UUID of the second GPU of the stand-in."""
    part = "which is not among CUDA's 2 GPUs. Open a renderer with"
    raises(ValueError, part, lambda: renderer.apply(OnDevice(picture(24, 16))))


def ranges(renderer: Any) -> None:
    """Images and framebuffers that no descriptor of the adapter covers."""
    image, levels = picture(600, 500, 3, "float32"), picture(600, 500, 3, "uint8")
    words = r": its pixels lie in .* MiB of memory, .* reaches 1 \(maxStorageBufferRange\); "
    for names, advice, given in (
        ("image", "make it contiguous", image),
        # Of four channels: in the dispatch's scratch memory, or of a bloom.
        ("image|glow", "(give it from the |use device=.)host", levels),
    ):
        with pytest.raises(ValueError, match=f"({names}){words}{advice}"):
            renderer.apply(OnDevice(given), Separable())
    same(renderer.apply(OnDevice(image[:9])), renderer.apply(image[:9]))


WORK = (
    *(
        layouts,
        streams,
        later,
        sequences,
        layers,
        places,
        capsules,
        ends,
        recycling,
        lifetime,
        errors,
    ),
    *(histories, geometries, copies, gradients, gradient_places),
)


# As the default, of levels that do not take most of the time.
LOW = vkbloom.BevyBloom(max_mip_dimension=16)


def use_low_levels() -> None:
    """Calls without settings use LOW."""
    apply, each = Renderer.apply, Renderer.map
    changed: Any = Renderer
    changed.apply = lambda self, image, settings=LOW, **more: apply(self, image, settings, **more)
    changed.map = lambda self, images, settings=LOW, **more: each(self, images, settings, **more)


def main(everything: Sequence[Callable[[Any], None]] = WORK) -> None:
    use_low_levels()
    wrong = {}
    chosen = [work for work in everything if work.__name__ in sys.argv[2:]]
    with Renderer(ADAPTER, validation=VALIDATION) as renderer:
        for work in chosen or everything:
            try:
                work(renderer)
            except Exception as error:
                import traceback

                wrong[work.__name__] = f"{type(error).__name__}: {error}\n{traceback.format_exc()}"
    print(json.dumps(wrong))


if __name__ == "__main__":
    main((*WORK, *(work for work in (missing, ranges) if work.__name__ in sys.argv)))
