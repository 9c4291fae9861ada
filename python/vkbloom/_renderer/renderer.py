"""The renderer: scenes and settings in, framebuffers out."""

from __future__ import annotations

import atexit
import contextlib
import itertools
import math
import os
import re
import weakref
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Sized
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple, NoReturn, cast

import numpy as np
from numpy.typing import NDArray

from vkbloom import _core
from vkbloom._argument_types import check_arguments
from vkbloom._array_cache import ArrayCache, shared_cache
from vkbloom._framebuffers import check_framebuffers
from vkbloom._numbers import check_size, check_time
from vkbloom._public import public
from vkbloom._renderer import requests
from vkbloom._renderer.adapter import bundled_driver, bundled_hash, from_core
from vkbloom._renderer.adapter_choice import choose_adapter
from vkbloom._renderer.batches import Batches
from vkbloom._renderer.device_arrays import (
    Destination,
    Device,
    DeviceArray,
    ImportedArray,
    fill,
    likeness,
    on_cuda,
)
from vkbloom._renderer.frames import Frames
from vkbloom._renderer.image import Image
from vkbloom._renderer.new_arrays import new_arrays, new_memory
from vkbloom._renderer.sources import (
    NO_GEOMETRY,
    SCENE_SIZE,
    Geometry,
    Inputs,
    any_source,
    batch_sources,
    check_inputs,
    image_source,
    is_image,
    scene_source,
    take_batch,
)
from vkbloom._renderer.state import Continued, State, advance_moment, read_kept
from vkbloom._settings.antialiasing import Antialiasing, check_antialiasing, check_use
from vkbloom._settings.exposed import ExposedSettings, expose
from vkbloom._settings.exposure import Exposure, check_exposure, check_seconds
from vkbloom._settings.settings import Settings, Shading, check_settings
from vkbloom._spelling import describe_unknown
from vkbloom._version import installed_version

if TYPE_CHECKING:
    from vkbloom._renderer.plans import Plan
    from vkbloom._scene import Scene

# Stands for images that are not known yet. Larger ones have more levels, of the same names but for
# the number.
_ANY_IMAGE = np.zeros((64, 64, 4), np.float32)
_NUMBER = re.compile(r"\d+")

#: The renderers of this process by their numbers, which are never used again: operators of PyTorch
#: take numbers only.
RENDERERS: Final[weakref.WeakValueDictionary[int, Renderer]] = weakref.WeakValueDictionary()
_numbers = itertools.count(1)
#: Plans that a renderer keeps: three for each size of a training loop over ten that learns fields.
_KEPT_PLANS: Final = 32


@atexit.register
def _end_instances() -> None:
    """Let the driver write what it has compiled: it does so in threads, which end at exit."""
    with contextlib.suppress(_core.Error):  # There is no core.
        _core.end_instances()


#: What adjoint passes compute: derivatives by images, or sums of derivatives by fields.
DerivativeKind = Literal["images", "sums", "all", "weights"]


class Taken(NamedTuple):
    """What the forward pass of an operator of PyTorch leaves to the backward pass.

    - `key`: What identifies the tensors of the call.
    - `images`: The copy of its images.
    - `settings`: Those of the call, with the values of tensors.
    """

    key: tuple[Any, ...]
    images: ImportedArray
    settings: Settings


def _frame_seconds() -> float:
    """Return how long the device may take for a frame before it counts as lost."""
    text = os.environ.get("VKBLOOM_TIMEOUT") or "300"
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not seconds > 0:
        raise ValueError(f"VKBLOOM_TIMEOUT: {text!r} is not a number of seconds above 0")
    return seconds


def _check_out(array: object, name: str, shape: tuple[int, ...], dtype: str) -> NDArray[Any]:
    if not isinstance(array, np.ndarray):
        raise TypeError(f"out: {name} must be an array, not {type(array).__name__}")
    if array.shape != shape or array.dtype != np.dtype(dtype):
        raise ValueError(
            f"out: {name} has shape {array.shape} and dtype {array.dtype}, "
            f"it must have {shape} and {dtype}"
        )
    if not array.flags.c_contiguous or not array.flags.writeable:
        raise ValueError(f"out: {name} must be C-contiguous and writeable")
    return array


def _arrays_for(
    core: _core.Renderer,
    plan: _core.Plan,
    out: Mapping[str, Any] | None,
    destination: Destination,
) -> tuple[NDArray[Any] | _core.Exported, ...]:
    """Return the arrays to fill: those of `out`, and new ones.

    Arrays of `out` that are on the device are filled later, from new ones that are there.
    """
    if out is None:
        return new_arrays(core, plan, destination)
    names = [name for name, _, _ in plan.outputs]
    for name in out:
        if name not in names:
            raise ValueError(f"out: {name!r} is not among the framebuffers: {', '.join(names)}")
    given: dict[str, NDArray[Any]] = {}
    for name, shape, dtype in plan.outputs:
        if name not in out or on_cuda(out[name]):
            continue
        array = _check_out(out[name], name, shape, dtype)
        for other, taken in given.items():
            # The arrays are contiguous, so it is sufficient to compare their bounds.
            if np.may_share_memory(array, taken):
                raise ValueError(f"out: {other} and {name} must not share memory")
        given[name] = array
    return tuple(
        given[name]
        if name in given
        else new_memory(core, shape, dtype, "cuda" if name in out else destination)
        for name, shape, dtype in plan.outputs
    )


def _sources(
    images: Iterable[Any], core: _core.Renderer, geometries: Iterator[Geometry]
) -> Iterator[_core.Source]:
    """Yield the Source of each image; a batch on the device without geometry is copied at once."""
    if on_cuda(images) and geometries is _NO_GEOMETRIES:
        yield from batch_sources(take_batch(images, core))
        return
    # Not by enumerate(), which keeps a reference to the image.
    numbers = itertools.count()
    for image in images:
        name = f"images[{next(numbers)}]"
        source = image_source(image, core=core, name=name, geometry=next(geometries))
        # The iterable may overwrite the array when it yields the next image.
        del image
        yield source
        del source


_NO_GEOMETRIES: Final = itertools.repeat(NO_GEOMETRY)


def _geometries(taa: object, motion: Any, depth: Any) -> Iterator[Geometry]:
    """Return an iterator of what belongs to each image of a sequence."""
    for name, given in (("motion", motion), ("depth", depth)):
        if given is not None and not isinstance(given, Iterable) and not on_cuda(given):
            raise TypeError(
                f"{name}: {type(given).__name__} is not an iterable with an array for each image"
            )
    if motion is None and depth is None:
        return _NO_GEOMETRIES
    check_use(taa, motion=motion, depth=depth)
    return _each_geometry(motion, depth)


def _each_geometry(motion: Any, depth: Any) -> Iterator[Geometry]:
    motions, depths = (
        itertools.repeat(None) if given is None else iter(given) for given in (motion, depth)
    )
    for number in itertools.count():
        parts = []
        for name, given in (("motion", motions), ("depth", depths)):
            try:
                parts.append(next(given))
            except StopIteration:
                raise ValueError(f"{name}: {number} arrays are fewer than the images") from None
        yield Geometry(*parts)


def _pair(
    sources: Iterable[_core.Source],
    settings: Settings | Sequence[Settings],
    steps: Iterator[float | None] | None = None,
    first: int = 0,
) -> Iterator[requests.Request]:
    """Yield each source with its settings. Errors are raised in order.

    - `steps`: The seconds before each image, if they differ; None: `DEFAULT_SECONDS`.
    - `first`: The number of the first image in its sequence.
    """
    count = 0
    state: dict[Any, Any] = {}
    for source in sources:
        if not isinstance(settings, Sequence):
            chosen = settings
        elif count < len(settings):
            chosen = settings[count]
        else:
            raise ValueError(f"settings: {len(settings)} Settings are fewer than the images")
        chosen = chosen._in_sequence(first + count, state)
        if steps is not None:
            chosen = chosen._after(_take_step(steps, count))
        request = requests.Request(source, chosen)
        del source
        yield request
        del request
        count += 1
    if isinstance(settings, Sequence) and count < len(settings):
        raise ValueError(f"settings: {len(settings)} Settings are more than the {count} images")


def _take_step(steps: Iterator[float | None], count: int) -> float:
    """Return the seconds before an image; `count`: how many images there were before."""
    for seconds in steps:
        return check_seconds(f"dt[{count}]", seconds)
    raise ValueError(f"dt: {count} steps of time are fewer than the images")


def _as_state(state: Mapping[str, Any] | None) -> State:
    return state if isinstance(state, State) else State(state or {})


@public("vkbloom")
class Renderer:
    """A device and its pipeline, in this process until it is closed.

    Parameters
    ----------
    adapter : str
        "auto" (discrete, integrated, virtual, cpu, in that order), "software", "hardware", a part
        of an adapter's name in any case, "uuid:" with a device's UUID or its beginning, or "pci:"
        with its address ("pci:0000:3b:00.0"). The environment variable VKBLOOM_ADAPTER replaces
        "auto". Where CUDA_VISIBLE_DEVICES is set, of NVIDIA's GPUs only the first one that it names
        is taken, unless `adapter` is a UUID or an address. "software" is the driver of the package
        ``vkbloom-lavapipe`` if it is installed, otherwise the system's. VKBLOOM_DRIVER selects
        another driver by the path of its library or manifest, or "system".
    validation : bool
        Enables the Khronos validation layer with synchronization validation. A call that causes
        messages raises `ValidationError` with the first one.

    Attributes
    ----------
    closed : bool
    info : AdapterInfo

    Raises
    ------
    AdapterNotFoundError
        No adapter fits. The message lists the adapters found, and what is missing or has to be
        installed.
    Error
        The device cannot be set up, or the validation layer is not installed.
    ValueError
        `adapter` is empty or the name of several equal GPUs, VKBLOOM_VARIANT or VKBLOOM_TIMEOUT is
        out of range, or VKBLOOM_VARIANT names variants that the adapter cannot run.

    Notes
    -----
    A renderer is a context manager, and any thread can use it. Calls release the GIL while the
    device works, and wait for each other. Framebuffers own their memory and stay valid when the
    renderer is closed.

    Calls raise TypeError for an argument of a wrong type, and ValueError for one that is out of
    range or does not fit the others, or if the renderer is closed. If the device fails, they raise
    `OutOfMemoryError`, `DeviceLostError`, `ValidationError` or another `Error`. The renderer can
    be used again unless the device is lost.

    Ctrl-C, or any exception from a signal handler, ends a waiting call. The renderer can be used
    again; closing it waits until the device has finished. A device that takes longer than 300 s for
    a frame counts as lost; the environment variable VKBLOOM_TIMEOUT replaces this number. After a
    fork, the parent's renderers raise ValueError in the child. The child can open its own renderer
    if the driver supports this. NVIDIA's driver does not: start processes with multiprocessing's
    method "spawn".

    Drivers limit the number of renderers that are open at once in a process: NVIDIA's driver 580
    refused 100. Any number can be opened one after the other.

    The first renderer, or the first call of `adapters`, opens the Vulkan loader for the life of the
    process. Drivers that are installed later, and variables such as VK_DRIVER_FILES that are set
    later, have an effect only in new processes.

    Examples
    --------
    >>> image = np.zeros((16, 16, 4), np.float32)
    >>> image[8, 8] = 10
    >>> with vkbloom.Renderer("software") as renderer:
    ...     frames = renderer.apply(image, vkbloom.Pyramid(levels=2, threshold=1.0))
    >>> frames["bloom"].shape
    (16, 16, 4)
    >>> renderer.closed
    True
    """

    @check_arguments
    def __init__(self, adapter: str = "auto", *, validation: bool = False) -> None:
        if not adapter:
            raise ValueError('adapter: "" is not a part of a name; use "auto" for the best adapter')
        if "\0" in adapter:
            raise ValueError("adapter: embedded null character")
        if adapter == "auto":
            adapter = os.environ.get("VKBLOOM_ADAPTER") or adapter
        from vkbloom._io.disk_cache import DiskCache  # noqa: PLC0415  costs start-up time

        self._pipelines = DiskCache("pipelines")
        self._core = _core.Renderer(
            *choose_adapter(adapter, bundled_driver()),
            bool(validation),
            os.environ.get("VKBLOOM_VARIANT") or "auto",
            _frame_seconds(),
            self._pipelines.read,
        )
        self._driver_uuid = self._core.info[5]
        self.info = from_core(self._core.info)
        self._made_by = {
            "adapter": self.info.name,
            "driver": self.info.driver_info or self.info.driver,
            "version": installed_version(),
        }
        if self.info.bundled and (sha256 := bundled_hash()):
            self._made_by["driver_sha256"] = sha256
        self._saved_pipelines = 0
        # The last plans, the latest first, each with its settings and what was wanted of it. Other
        # threads read the list, so it never changes.
        self._planned: tuple[tuple[Settings, Any, _core.Plan], ...] = ()
        self._taken: Taken | None = None
        self._pending = requests.PendingSubmissions()
        self._batches = Batches(self._core, self._pending)
        # What map has checked last.
        self._named: tuple[object, tuple[str, ...]] = None, ()
        # What was exposed last.
        self._exposed: Settings | None = None
        self._remember: ArrayCache | None = shared_cache()
        self._number = next(_numbers)
        RENDERERS[self._number] = self

    @property
    def closed(self) -> bool:
        """Whether `close` was called."""
        return self._core.closed

    def close(self) -> None:
        """Release the device and everything on it. May be called twice.

        States of frames stay valid: they are read from the device before.
        """
        if not self.closed:
            read_kept(self._core)
        self._release()

    def _release(self) -> None:
        self._planned = ()
        self._taken = None
        self._remember = None
        try:
            self._pending.wait()
        except ValueError:  # the device belongs to the process that this one was forked from
            self._pending.forget()
        finally:
            self._core.close()

    def __reduce__(self) -> NoReturn:
        # For copy.copy, copy.deepcopy and pickle: two objects would share one device.
        raise TypeError("a Renderer cannot be copied or pickled; create another one")

    def __enter__(self) -> Renderer:
        if self.closed:
            raise ValueError("the renderer is closed")
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<vkbloom.Renderer on {self.info.summary}{', closed' if self.closed else ''}>"

    @check_arguments
    def render(
        self,
        scene: Scene,
        settings: Settings | str | None = None,
        size: tuple[int, int] = SCENE_SIZE,
        *,
        shading: Shading = "forward",
        time: float = 0.0,
        framebuffers: Literal["all"] | str | Sequence[str] = "all",
        out: Mapping[str, Any] | None = None,
        device: Device | None = None,
        exposure: Exposure | str | None = None,
        taa: Antialiasing | str | None = None,
        dt: float | None = None,
        state: Mapping[str, Any] | None = None,
    ) -> Frames:
        """Render a scene with its bloom.

        Parameters
        ----------
        scene : Scene
        settings : Settings, optional
            Default: ``presets["tutorial"]``, which is ``Separable()``.
        size : (int, int)
            Width and height of the frame in pixels.
        shading : {"forward", "deferred"}
            Forward: the glow mesh is drawn into its own buffers, blurred, and added to the
            Phong-lit scene, all in 8 bits. Deferred: albedo, normal, position and brightness of the
            visible surfaces are drawn into a G-buffer of half floats. The scene is lit from it. The
            blurred image is the brightness: the emission of the body's materials plus the glow
            mesh's colour times the scene's `glow_intensity`.
        time : float
            Time of the animation in turns, any finite number. 0 and 1 give the same frame.
        framebuffers : "all" or sequence of str
            Names of the requested framebuffers. Other framebuffers are rendered only if a requested
            one depends on them. They are not read back.
        out : mapping of str to ndarray, optional
            Arrays to fill, by name. Arrays for the other framebuffers are allocated.
        device : {"host", "device"}, optional
            Where the framebuffers go: arrays of NumPy, or `DeviceArray` objects. Default: "device"
            if an array of the source is on the GPU, else "host".
        exposure, dt
            As for `apply`, with deferred shading: a forward scene has 8 bits. What is metered is
            ``scene``. `time` and `dt` are apart: a turn of the animation is no number of seconds.
        taa
            As for `apply`, with deferred shading, and with the scene's own motion and depth: from
            the time of the frame that `state` is of. The picture is moved by the engine's offset of
            its frame. ``scene`` is resolved, and the light that glows apart from it.
        state : mapping of str to ndarray, optional
            For settings whose passes read framebuffers of the call before: `Frames.state` of that
            call, or arrays by the names of these framebuffers, of their shapes and dtypes. Names
            that the settings do not read are handed on. What is missing is 0 in all channels, so
            that a call without a state begins anew. A call that fails has changed no state.

        Returns
        -------
        Frames
            Forward: ``glow`` (bloom buffer size, (H, W, 4)), ``glow_depth`` ((H, W) float32),
            ``blur_vertical``, ``bloom`` (at the frame's size), ``scene`` ((H, W, 4) uint8),
            ``depth`` ((H, W) float32) and ``final`` ((H, W, 4) uint8).

            Deferred, at the frame's size except for the blur: ``albedo``, ``normal``, ``position``
            (both in view space), ``brightness`` (all (H, W, 4) float16), ``depth``,
            ``blur_vertical``, ``bloom``, ``scene`` ((H, W, 4) float16, light plus brightness) and
            ``final`` ((H, W, 4) uint8). Pixels of the sky or of the empty background have a normal
            of 0, and their albedo is the colour.

            With ``direct=True`` there is no ``blur_vertical``. With ``bloom=False`` there are no
            bloom buffers, and the glow mesh is left out.

            With `taa` also ``motion``, (H, W, 4) float32: the motion in shares of width and height,
            the depth as the engine has it, and 1; ``history`` and ``resolved`` as of `apply`, and
            the same of the light that glows, ``history_glow`` and ``resolved_glow``.

        Notes
        -----
        A pass runs only if its inputs, its settings or its size have changed since its last run.
        The ``timings`` of the result name the passes that ran.
        """
        settings = self._expose(check_settings(settings), exposure, dt, taa)
        antialiasing = None if taa is None else check_antialiasing(taa)
        moment, before = advance_moment(antialiasing, check_time(time), _as_state(state))
        source = scene_source(scene, size, shading, time, moment=moment)
        names = check_framebuffers(framebuffers)
        return self._run_one(source, settings, names, out, device, state=before)

    @check_arguments
    def apply(
        self,
        image: NDArray[Any] | Image,
        settings: Settings | str | None = None,
        *,
        mask: NDArray[Any] | None = None,
        emission: NDArray[Any] | None = None,
        framebuffers: Literal["all"] | str | Sequence[str] = "all",
        out: Mapping[str, Any] | None = None,
        device: Device | None = None,
        exposure: Exposure | str | None = None,
        taa: Antialiasing | str | None = None,
        dt: float | None = None,
        motion: NDArray[Any] | None = None,
        depth: NDArray[Any] | None = None,
        state: Mapping[str, Any] | None = None,
    ) -> Frames:
        """Add bloom to an image.

        Parameters
        ----------
        image : ndarray, shape (H, W, 3) or (H, W, 4), or Image
            Linear light: uint8 (read as value / 255), float16 or float32; any strides. The levels
            of a photograph are not linear: read it with `vkbloom.read`. RGB gets alpha 1; the field
            `alpha` of the settings selects the treatment of an alpha. NaN and infinity count as 0
            in the bloom, and stay in ``final`` at their pixels. It may be an array on the GPU with
            `__dlpack__`, of which a copy is made there. An `Image` from `upload` is used
            with its mask and emission.
        settings : Settings, optional
            Default: ``presets["bevy_natural"]``.
        mask : ndarray, shape (H, W), optional
            The parts that glow, 0 to 1, with the image's size: uint8 (read as value / 255), bool,
            float16 or float32. It is reduced bilinearly like the image, and multiplies the
            thresholded image. Published methods read it at the pixel centres of the first image
            that they write after their threshold.
        emission : ndarray, optional
            An image of the same shape and dtype from which the bloom is made instead, like the glow
            mesh in a scene. It is added to the image in ``final``.
        framebuffers, out, device
            As for `render`. Arrays of `out` may be on the GPU.
        exposure : Exposure or str, optional
            How the exposure follows the light: an exposure, or the name of one of
            `vkbloom.exposures`. It is applied before or after the bloom, as its engine does. None:
            only the field `exposure` of the settings is applied, after the bloom.
        taa : Antialiasing or str, optional
            Temporal anti-aliasing: that of an engine, or the name of one of `vkbloom.antialiasing`.
            The image is mixed with the history before it is metered and the bloom is made of it;
            HDRP meters it before. An emission is not mixed.
        dt : float, optional
            Seconds since the frame before, 0 to 86400. Default: 1/60. It matters only with an
            exposure.
        motion : ndarray, shape (H, W, 2), optional
            For `taa`: where the surface of each pixel is minus where it was in the frame before, in
            shares of width and height, to the right and down; finite floats. Default: 0.
        depth : ndarray, shape (H, W), optional
            For `taa`: the depth buffer, as the engine has it; the class says whether near surfaces
            have large or small values. Pixels take the motion of the nearest one around them.
            Default: each pixel takes its own. Motion and depth may be on the GPU, as float16 or
            float32. They stay there, so that nothing checks their values: a motion that is not
            finite and a depth of NaN count as 0.
        state : mapping of str to ndarray, optional
            As for `render`. An exposure continues from its framebuffer ``exposure``, `taa` from
            ``history`` and ``history_motion``.

        Returns
        -------
        Frames
            ``glow`` (the thresholded image), the blur's framebuffers (``blur_vertical``; or
            ``down_0``, ``down_1``, ... and ..., ``up_0``), ``bloom``, all (H, W, 4) in the format
            of the bloom buffers, and ``final``, which has the image's shape and dtype. With
            ``bloom=False`` there is only ``final``. ``info`` has the numbers of "nan" and "inf" in
            the image and the emission.

            With an exposure also ``exposure``, (1, 1, 4) float32: what has been adapted to, the
            multiplier of the light that the bloom reads, that of the picture with its bloom, and 1.
            ``histogram``, (1, bins, 4) float32, has the weights of the bins in r, g and b, if the
            engine has a histogram. ``exposed``, float32 of the image's shape, is what the bloom
            reads, if the engine exposes it.

            With `taa` also ``history``, (H, W, 4) float32, what the next frame is mixed with, as
            the engine keeps it; ``resolved``, float32 of the image's shape, the light of that; and
            of Godot ``history_motion``. NaN and infinity count as 0 there, and stay at their pixels
            of ``resolved``.

        Notes
        -----
        An image with the same bytes as before is not uploaded again. Passes run only if their
        inputs or settings have changed. The same is true for mask and emission.

        On a CPU, passes read an image of 1 MiB or more where it is, if its layout allows this. Then
        nothing is kept of it. If the same array comes again, it is copied, all passes run once
        more, and from then on the paragraph above holds.

        The composite "mix" subtracts only the part of the scene s that is the source of the bloom.
        With a mask m the result is s + i (b - m s), with an emission s + i b.
        """
        settings = self._expose(check_settings(settings, of_image=True), exposure, dt, taa)
        check_use(taa, motion=motion, depth=depth)
        geometry = Geometry(motion, depth)
        self._pending.wait()
        source = image_source(image, mask, emission, self._core, geometry=geometry)
        names = check_framebuffers(framebuffers)
        return self._run_one(source, settings, names, out, device, state=state)

    @check_arguments
    def map(
        self,
        images: Iterable[NDArray[Any] | Image],
        settings: Settings | str | Sequence[Settings | str] | None = None,
        *,
        framebuffers: Literal["all"] | str | Sequence[str] = "all",
        device: Device | None = None,
        exposure: Exposure | str | None = None,
        taa: Antialiasing | str | None = None,
        dt: float | Iterable[float] | None = None,
        motion: Iterable[NDArray[Any] | None] | None = None,
        depth: Iterable[NDArray[Any] | None] | None = None,
        state: Mapping[str, Any] | None = None,
    ) -> Iterator[Frames]:
        """Add bloom to many images.

        Parameters
        ----------
        images : iterable of images
            Each as for `apply`, or a batch (N, H, W, C), which is copied at once if it is on the
            GPU. Shapes and dtypes may differ. Each image is copied before the next one is taken, so
            the iterable can fill one array repeatedly.
        settings : Settings or sequence of Settings, optional
            For all images, or one for each image. Default: ``presets["bevy_natural"]``.
        framebuffers, device
            As for `apply`.
        exposure, taa, dt
            As for `apply`; `dt` is the time before each image, the same of all or an iterable, of
            which an item is taken after each image.
        motion, depth : iterable of ndarray, optional
            As for `apply`, one for each image.
        state : mapping of str to ndarray, optional
            What the first image continues from, as for `apply`. Each other one continues from the
            image before, whatever settings either has; after an image of another size, what has
            other sizes begins anew. Memory that a custom method declares as STORAGE is no part of a
            state: it begins anew in each call of `map`.

        Yields
        ------
        Frames
            One for each image, in their order.

        Raises
        ------
        ValueError
            Raised by the call: the lengths of both sequences differ, or an argument is out of
            range. Raised by the iteration: an image is not valid for `apply`, or has no settings.

        Notes
        -----
        The device works on the next images while the caller uses a frame. So after the first frame,
        the number of images taken is up to two larger than the number of yielded frames. Of a batch
        on the GPU with one Settings, each pass runs for many images at once. Where settings read
        framebuffers of the image before, each of the frames has its state on the device: of a long
        sequence keep arrays, not all Frames. An error
        of an image or of the iterable is raised after the frames of all earlier images, and ends
        the iteration.

        Examples
        --------
        >>> images = (np.full((16, 24, 3), level, np.float32) for level in (0.25, 0.5, 1.0))
        >>> with vkbloom.Renderer("software") as renderer:
        ...     for frames in renderer.map(images, vkbloom.Pyramid(levels=2)):
        ...         print(frames["final"].max())
        0.5
        1.0
        2.0
        """
        given: Any = {"framebuffers": framebuffers, "device": device, "state": state}
        given |= {"taa": taa, "motion": motion, "depth": depth}
        return self._map(images, settings, exposure=exposure, dt=dt, **given)

    def _map(
        self,
        images: Iterable[Any],
        settings: Settings | str | Sequence[Settings | str] | None,
        *,
        framebuffers: Literal["all"] | str | Sequence[str],
        device: Device | None = None,
        exposure: Exposure | str | None = None,
        taa: Antialiasing | str | None = None,
        dt: float | Iterable[float | None] | None = None,
        motion: Iterable[NDArray[Any] | None] | None = None,
        depth: Iterable[NDArray[Any] | None] | None = None,
        state: Mapping[str, Any] | None = None,
        first: int = 0,
    ) -> Iterator[Frames]:
        """Return what `map` does; `first` is the number of the first image in its sequence."""
        names = check_framebuffers(framebuffers)
        is_one = isinstance(images, str | bytes) or (
            isinstance(images, np.ndarray) and images.ndim != 4
        )
        if (not isinstance(images, Iterable) and not on_cuda(images)) or is_one:
            raise TypeError(
                f"images: {type(images).__name__} is not an iterable of images; for one image, "
                "call apply or pass a list"
            )
        chosen: Settings | Sequence[Settings]
        if isinstance(settings, Sequence) and not isinstance(settings, str):
            chosen = [
                check_settings(item, f"settings[{number}]") for number, item in enumerate(settings)
            ]
            if isinstance(images, Sized) and len(images) != len(chosen):
                raise ValueError(
                    f"settings: {len(chosen)} Settings do not match the {len(images)} images"
                )
        else:
            chosen = check_settings(settings, of_image=True)
        steps: Iterator[float | None] | None = None
        if isinstance(dt, Iterable) and not isinstance(dt, str):
            steps, dt = iter(dt), None
        if isinstance(chosen, Sequence):
            chosen = [self._expose(item, exposure, dt, taa) for item in chosen]
        else:
            chosen = self._expose(chosen, exposure, dt, taa)
        geometries = _geometries(taa, motion, depth)
        if self.closed:
            raise ValueError("the renderer is closed")
        checked_settings, checked_names = self._named
        if names and not (checked_settings is chosen and checked_names == names):
            self._check_names(image_source(_ANY_IMAGE), chosen, names)
            self._named = chosen, names
        destination = self._choose_destination(device)
        begun = _as_state(state)
        is_same = steps is None and not isinstance(chosen, Sequence)
        is_batch = on_cuda(images) and geometries is _NO_GEOMETRIES
        if is_batch and device != "host" and is_same:
            return self._run_batch(images, cast("Settings", chosen), names, destination, begun)
        sources = _sources(images, self._core, geometries)
        sequence = requests.upload_each(self._core, _pair(sources, chosen, steps, first))
        return self._run_requests(sequence, names, destination, Continued(begun))

    @check_arguments
    def upload(
        self,
        image: NDArray[Any],
        *,
        mask: NDArray[Any] | None = None,
        emission: NDArray[Any] | None = None,
    ) -> Image:
        """Copy an image to the device, to use it in many calls.

        Parameters
        ----------
        image : ndarray
            As for `apply`. It may change as soon as this returns.
        mask, emission : ndarray, optional
            As for `apply`. They stay with the image.

        Returns
        -------
        Image
            This renderer accepts it in place of an array. Calls do not compare its bytes.
        """
        if isinstance(image, Image):
            raise TypeError("image: the image was uploaded already; pass it to apply")
        inputs = check_inputs(image, mask, emission, self._core)
        source = inputs.source()
        shape, dtype = source.kind
        if source.exported:
            # It is a copy already, but for what is on the host.
            inputs = inputs.freeze()
            return Image(inputs.source(), shape, np.dtype(dtype), inputs.by_name())
        uploaded = self._core.upload(source, None, False)
        # `vjp` reads the pixels of the image from the device.
        named = inputs.by_name()
        beside: dict[str, Any] = {
            name: np.array(named[name]) for name in ("mask", "emission") if name in named
        }
        return Image(uploaded, shape, np.dtype(dtype), beside)

    @check_arguments
    def sweep(
        self,
        source: Scene | NDArray[Any] | Image,
        settings: Iterable[Settings | str],
        *,
        size: tuple[int, int] | None = None,
        shading: Shading = "forward",
        time: float = 0.0,
        framebuffers: Literal["all"] | str | Sequence[str] = "all",
        device: Device | None = None,
        exposure: Exposure | str | None = None,
        taa: Antialiasing | str | None = None,
        dt: float | None = None,
        motion: NDArray[Any] | None = None,
        depth: NDArray[Any] | None = None,
        state: Mapping[str, Any] | None = None,
    ) -> Iterator[Frames]:
        """Render one scene, or add bloom to one image, with many settings.

        Parameters
        ----------
        source : Scene or an image
            As for `render` and `apply`. An array must not change before the last frame is taken.
        settings : iterable of Settings
            Names of presets are settings, too.
        size : (int, int), optional
            Width and height of a scene's frames. Default: (1280, 720). Not for an image.
        shading, time
            Of a scene, as for `render`.
        framebuffers, device, exposure, dt
            As for `apply`.
        taa, motion, depth
            As for `apply`, and `taa` as for `render` of a scene, which has a motion of its own.
        state : mapping of str to ndarray, optional
            What all frames continue from: each is the frame `dt` seconds after it, and none
            continues that of other settings. Only with an exposure or anti-aliasing.

        Yields
        ------
        Frames
            One for each of the settings, in their order; only the passes that a change of settings
            puts out of date run.

        Notes
        -----
        The device works on the next settings while the caller uses a frame. So after the first
        frame, settings are taken from the iterable before earlier frames are yielded. An error in
        settings is raised after the frames of all earlier settings. Names of framebuffers that none
        of the settings of a sequence has are raised by the call.
        """
        self._pending.wait()
        check_use(taa, motion=motion, depth=depth)
        check_seconds("dt", dt)
        if exposure is None and taa is None and state is not None:
            raise ValueError("state: only a stage in time continues one; give exposure or taa, too")
        antialiasing = None if taa is None or is_image(source) else check_antialiasing(taa)
        moment, before = advance_moment(antialiasing, check_time(time), _as_state(state))
        of_source: Any = {"geometry": Geometry(motion, depth), "moment": moment}
        frame_source = any_source(source, size, shading, time, self._core, **of_source)
        names = check_framebuffers(framebuffers)

        def expose_each(chosen: Settings) -> Settings:
            return self._expose(chosen, exposure, dt, taa)

        how: Any = {}
        if exposure is not None or taa is not None:
            how = {"prepare": expose_each, "before": Continued(before, is_chain=False)}
        return self._run_many(frame_source, settings, names, device, **how)

    @check_arguments
    def plan(
        self,
        source: Scene | NDArray[Any] | Image,
        settings: Settings | str | None = None,
        size: tuple[int, int] | None = None,
        *,
        shading: Shading = "forward",
        framebuffers: Literal["all"] | str | Sequence[str] = "all",
        exposure: Exposure | str | None = None,
        taa: Antialiasing | str | None = None,
    ) -> Plan:
        """Return the framebuffers and the passes of a call, without rendering.

        Parameters
        ----------
        source : Scene or an image
            As for `render` and `apply`.
        settings : Settings, optional
            Default: ``presets["bevy_natural"]`` for an image, ``presets["tutorial"]`` for a scene.
        size : (int, int), optional
            Width and height of a scene's frame. Default: (1280, 720). Not for an image.
        shading : {"forward", "deferred"}
            Of a scene.
        framebuffers, exposure, taa
            As for `apply`; of images without motion and depth.

        Returns
        -------
        Plan
            The framebuffers that the call would return, with shapes and dtypes, and its passes in
            the variants that this renderer's device would run.

        Notes
        -----
        This makes no device call and does not wait for other threads' calls. A plan does not depend
        on the pixels of an image or on a scene's time.
        """
        from vkbloom._renderer.plans import (  # noqa: PLC0415  costs start-up time
            Pass,
            Plan,
            framebuffers_of,
        )

        settings = check_settings(settings, of_image=is_image(source))
        names = check_framebuffers(framebuffers)
        given = likeness(source) if on_cuda(source) else source
        planned = any_source(given, size, shading, 0.0)
        kind: str = shading
        dtype = channels = None
        if is_image(source):
            (height, width, channels), name = planned.kind
            kind, dtype = "image", np.dtype(name)
        else:
            width, height = check_size("size", SCENE_SIZE if size is None else size)
        plan = self._core.plan(planned, self._expose(settings, exposure, None, taa), names)
        passes = tuple(
            Pass(name, shader, tuple(dict.fromkeys(reads)), writes, variant)
            for name, shader, reads, writes, variant, _ in plan.passes
        )
        return Plan(
            kind,
            (width, height),
            dtype,
            channels,
            isinstance(source, Image) and source.mask,
            isinstance(source, Image) and source.emission,
            settings,
            framebuffers_of(plan),
            passes,
        )

    def _expose(
        self,
        settings: Settings,
        exposure: Exposure | str | None,
        dt: float | None,
        taa: Antialiasing | str | None = None,
    ) -> Settings:
        """Return settings with the stages in time, which the rest of a renderer takes for settings.

        None: there is no such stage.
        """
        seconds = check_seconds("dt", dt)
        if exposure is None and taa is None:
            return settings
        checked = None if exposure is None else check_exposure(exposure)
        antialiasing = None if taa is None else check_antialiasing(taa)
        made = expose(settings, checked, seconds, antialiasing)
        # The same object as in the last call, since the last plan is kept for that.
        if made != self._exposed:
            self._exposed = made
        return self._exposed

    def _apply_inputs(
        self, inputs: Inputs, settings: Settings, names: tuple[str, ...] | None
    ) -> Frames:
        """As `apply`, of checked arguments."""
        return self._run_one(inputs.source(), settings, names, None, None, state=None)

    def _run_one(
        self,
        source: _core.Source,
        settings: Settings,
        names: tuple[str, ...] | None,
        out: Mapping[str, Any] | None,
        device: Device | None,
        *,
        state: Mapping[str, NDArray[Any]] | None,
    ) -> Frames:
        destination = self._choose_destination(device)(source)
        plan = self._plan_of(source, settings, names)
        before = _as_state(state)
        before.check(plan)
        arrays = _arrays_for(self._core, plan, out, destination)
        histories = before.histories(self._core, plan)
        submission = self._core.run(source, (plan,), (arrays,), True, None, histories)
        # While the device works: earlier submissions end before this one.
        self._pending.wait()
        after = before.advance(self._core, plan, submission)
        frames = self._frames(settings, requests.name_outputs(plan, arrays, destination), after)
        if not out and submission.ordered:
            pending = requests.PendingSubmission(submission)
            self._pending.add(pending)
            frames._finish_later(pending.of_request)
            self._save_pipelines()
            return frames
        (timings,), counts = submission.wait()
        for name, target in (out or {}).items():
            if on_cuda(target):
                fill(target, f"out: {name}", cast("DeviceArray", frames[name]), self._core)
        return self._finish(frames, timings, *counts)

    def _run_batch(
        self,
        images: Any,
        settings: Settings,
        names: tuple[str, ...] | None,
        destination: Callable[[_core.Source], Destination],
        state: State,
    ) -> Iterator[Frames]:
        self._pending.wait()
        batch = take_batch(images, self._core)

        def rest(first: int) -> Iterator[Frames]:
            sequence = _pair(batch_sources(batch, first), settings)
            return self._run_requests(sequence, names, destination, Continued(state))

        def plan_of(source: _core.Source) -> _core.Plan:
            return self._plan_of(source, settings, names)

        for frames in self._batches.run(batch, settings, plan_of, self._frames, rest):
            self._save_pipelines()
            yield frames

    def _choose_destination(self, device: Device | None) -> Callable[[_core.Source], Destination]:
        """Return where the framebuffers of a source go."""
        if device not in (None, "host", "device"):
            raise ValueError(f"device: {device!r} is not 'host' or 'device'")

        def destination(source: _core.Source) -> Destination:
            if device == "host" or (device is None and not source.exported):
                return "host"
            # The memory of a CPU adapter is the host's.
            return "cuda" if source.exported or self.info.type != "cpu" else "viewed"

        return destination

    def _plan_of(
        self, source: _core.Source, settings: Settings, names: tuple[str, ...] | None
    ) -> _core.Plan:
        """Return the last plan that fits, otherwise a new one.

        For small images, making a plan takes most of the time of a call.
        """
        return cast("_core.Plan", self._find_plan(source, settings, names))

    def _plan_derivatives(
        self,
        source: _core.Source,
        settings: Settings,
        cotangents: tuple[str, ...],
        results: DerivativeKind,
        sums: tuple[str, ...],
    ) -> _core.Plan | None:
        """Return the plan of derivatives, as `_plan_of` does, or None if a pass has none.

        `sums`: Those that are computed, where `results` has them (VKB_SUMS of the core).
        """
        return self._find_plan(source, settings, None, cotangents, results, sums)

    def _find_plan(
        self,
        source: _core.Source,
        settings: Settings,
        names: tuple[str, ...] | None,
        *derivatives: Any,
    ) -> _core.Plan | None:
        wanted = names, derivatives
        for index, (known, others, plan) in enumerate(self._planned):
            if known is settings and others == wanted and plan.is_of(source):
                if index > 0:
                    self._keep_plan(settings, wanted, plan)
                return plan
        made = self._core.plan(source, settings, names, *derivatives)
        if made is not None and not settings._has_state:
            self._keep_plan(settings, wanted, made)
        return made

    def _keep_plan(self, settings: Settings, wanted: Any, plan: _core.Plan) -> None:
        rest = [one for one in self._planned if one[2] is not plan]
        self._planned = ((settings, wanted, plan), *rest[: _KEPT_PLANS - 1])

    def _run_many(
        self,
        source: _core.Source,
        settings: Iterable[Settings | str],
        names: tuple[str, ...] | None,
        device: Device | None = None,
        *,
        prepare: Callable[[Settings], Settings] = lambda chosen: chosen,
        before: Continued | None = None,
    ) -> Iterator[Frames]:
        destination = self._choose_destination(device)
        # Not a generator, so that arguments are checked at the call and not with the first frame.
        if not isinstance(settings, Iterable) or isinstance(settings, str | bytes):
            raise TypeError(f"settings: {settings!r} is not an iterable of Settings")
        if self.closed:
            raise ValueError("the renderer is closed")
        if isinstance(settings, Sequence):
            settings = tuple(settings)
            if names:
                self._check_names(source, settings, names, prepare)
        return self._run_requests(
            (
                requests.Request(source, prepare(check_settings(item, f"settings[{number}]")))
                for number, item in enumerate(settings)
            ),
            names,
            destination,
            before,
        )

    def _check_names(
        self,
        source: _core.Source,
        settings: Settings | Sequence[Settings | str],
        names: tuple[str, ...] | None,
        prepare: Callable[[Settings], Settings] = lambda chosen: chosen,
    ) -> None:
        """Raise ValueError for framebuffers that none of the settings has, at any size."""
        known: dict[str, None] = {}
        for item in settings if isinstance(settings, Sequence) else [settings]:
            # An error of these settings is raised in their turn, after the frames of earlier ones.
            with contextlib.suppress(_core.Error, TypeError, ValueError):
                is_exposed = isinstance(item, ExposedSettings)
                chosen = cast("Settings", item) if is_exposed else prepare(check_settings(item))
                plan = self._core.plan(source, chosen, None)
                known.update((name, None) for name, _, _ in plan.outputs)
        kinds = {_NUMBER.sub("#", name) for name in known}
        for name in names or ():
            if known and _NUMBER.sub("#", name) not in kinds:
                raise ValueError(describe_unknown("framebuffers: unknown framebuffer", name, known))

    def _run_requests(
        self,
        sequence: Iterable[requests.Request],
        names: tuple[str, ...] | None,
        destination: Callable[[_core.Source], Destination] = lambda _: "host",
        before: Continued | None = None,
    ) -> Iterator[Frames]:
        self._pending.wait()
        results = requests.run(sequence, self._core, names, before=before, destination=destination)
        return (
            self._finish(self._frames(settings, arrays, after), *known)
            for settings, arrays, known, after in results
        )

    def _frames(
        self, settings: Settings, arrays: Mapping[str, NDArray[Any]], state: State | None = None
    ) -> Frames:
        exposed = settings if isinstance(settings, ExposedSettings) else None
        plain = exposed.settings if exposed else settings
        sizes = [arrays[name].shape[1::-1] for name in ("final", "bloom") if name in arrays]
        facts = plain._facts(sizes[0]) if sizes else {}
        frames = Frames(arrays, timings={}, settings=plain, info=self._made_by | facts)
        frames._is_exposed = exposed is not None and exposed.exposure is not None
        frames._exposed = exposed
        if state is not None:
            frames._state = state
        return frames

    def _finish(self, frames: Frames, timings: dict[str, float], nan: int, inf: int) -> Frames:
        self._save_pipelines()
        frames._finish(timings, nan, inf)
        return frames

    def _save_pipelines(self) -> None:
        """Write the driver's pipeline cache to disk if it has new pipelines."""
        count = self._core.pipeline_count
        if count != self._saved_pipelines:
            # Errors are ignored, since the cache only makes the next start faster. A ValueError
            # means that another thread has closed the renderer.
            with contextlib.suppress(_core.Error, ValueError):
                self._pipelines.write(self._driver_uuid, self._core.pipeline_cache())
                self._saved_pipelines = count
