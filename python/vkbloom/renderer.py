"""The renderer: scenes and settings in, framebuffers out."""

from __future__ import annotations

import contextlib
import math
import os
from collections import abc
from typing import TYPE_CHECKING, Any, Literal, NoReturn, cast

import numpy as np

from vkbloom import _core, requests
from vkbloom.adapter import bundled_driver, bundled_hash, from_core
from vkbloom.checks import check_attachments, check_size
from vkbloom.frames import Frames
from vkbloom.image import Image
from vkbloom.plans import Pass, Plan, framebuffers
from vkbloom.settings import Settings, Shading, check_settings
from vkbloom.sources import image_kind, image_source, is_image, scene_source
from vkbloom.version import installed_version

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from types import TracebackType

    import xarray
    from numpy.typing import NDArray

    from vkbloom.scene import Scene

_SCENE_SIZE = (1280, 720)


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
    core: _core.Renderer, plan: _core.Plan, out: Mapping[str, NDArray[Any]] | None
) -> tuple[NDArray[Any], ...]:
    """Return the arrays to fill: those of `out`, and new ones."""
    if out is None:
        return requests.new_arrays(core, plan)
    if not isinstance(out, abc.Mapping):
        raise TypeError(f"out: a mapping of names to arrays is needed, not {type(out).__name__}")
    names = [name for name, _, _ in plan.outputs]
    for name in out:
        if name not in names:
            raise ValueError(f"out: {name!r} is not among the framebuffers: {', '.join(names)}")
    given: dict[str, NDArray[Any]] = {}
    for name, shape, dtype in plan.outputs:
        if name not in out:
            continue
        array = _check_out(out[name], name, shape, dtype)
        for other, taken in given.items():
            # Of contiguous arrays the bounds say it all.
            if np.may_share_memory(array, taken):
                raise ValueError(f"out: {other} and {name} must not share memory")
        given[name] = array
    return tuple(
        given[name] if name in given else requests.new_array(core, shape, dtype)
        for name, shape, dtype in plan.outputs
    )


def _paired(
    images: Iterable[NDArray[Any] | Image], settings: Settings | Sequence[Settings]
) -> Iterator[requests.Work]:
    """Yield each image with its settings; what is wrong comes in its turn."""
    count = 0
    for image in images:
        if isinstance(settings, Settings):
            one = settings
        elif count < len(settings):
            one = settings[count]
        else:
            raise ValueError(f"settings: {len(settings)} are fewer than the images")
        work = requests.Work(image_source(image), one)
        # The array is the caller's again while the next is asked for.
        del image
        yield work
        del work
        count += 1
    if not isinstance(settings, Settings) and count < len(settings):
        raise ValueError(f"settings: {len(settings)} are more than the {count} images")


class Renderer:
    """A device and its pipeline, in this process until it is closed.

    Parameters
    ----------
    adapter : str
        "auto" (discrete, integrated, virtual, cpu, in that order), "software", "hardware", or a
        part of an adapter's name, in any case. The environment variable VKBLOOM_ADAPTER replaces
        "auto". "software" is the driver of the package ``vkbloom-lavapipe`` where it is installed,
        else the system's; VKBLOOM_DRIVER names another driver's library or manifest, or "system".
    validation : bool
        Turns the Khronos validation layer on, with synchronization validation; its first message
        raises `ValidationError` from the call that caused it.

    Attributes
    ----------
    closed : bool
    info : AdapterInfo

    Raises
    ------
    AdapterNotFoundError
        No adapter fits; says what was found, what is missing and what to install.
    Error
        The device cannot be set up, or the validation layer is not installed.
    ValueError
        `adapter` is empty, VKBLOOM_FORM or VKBLOOM_TIMEOUT is out of range, or VKBLOOM_FORM names
        what the adapter cannot run.

    See Also
    --------
    adapters : Lists the adapters.
    Frames : What the calls return.

    Notes
    -----
    A context manager; usable from any thread. Calls release the GIL while the device works, and
    wait for each other. Framebuffers own their memory and outlive the renderer.

    Ctrl-C, or whatever else a signal's handler raises, ends a call that waits, and the renderer can
    be used again; closing waits for what the device is still at work on. A device that takes longer
    than 300 s for a frame counts as lost; the environment variable VKBLOOM_TIMEOUT replaces that
    number. After a fork the child opens a renderer of its own, where the driver can; its parent's
    raise ValueError. NVIDIA's driver cannot: start processes by multiprocessing's method "spawn".

    The first renderer, or list of `adapters`, opens the Vulkan loader for the life of the process:
    drivers that are installed later, and variables such as VK_DRIVER_FILES that are set later, are
    seen by new processes only.

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

    def __init__(self, adapter: str = "auto", *, validation: bool = False) -> None:
        if not isinstance(adapter, str):
            raise TypeError(f"adapter: a name is needed, not {adapter!r}")
        if not adapter:
            raise ValueError('adapter: "" is not a part of a name; "auto" takes the best adapter')
        if adapter == "auto":
            adapter = os.environ.get("VKBLOOM_ADAPTER") or adapter
        variants = os.environ.get("VKBLOOM_FORM") or "auto"
        from vkbloom.io import pipeline_cache  # noqa: PLC0415  costs start-up time

        self._core = _core.Renderer(
            adapter,
            bundled_driver(),
            bool(validation),
            variants,
            _frame_seconds(),
            pipeline_cache.read,
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

    @property
    def closed(self) -> bool:
        """Whether `close` was called."""
        return self._core.closed

    def close(self) -> None:
        """Give back all that the renderer holds of the device; may be called twice.

        Raises
        ------
        ValidationError
            With validation on: something was left behind.
        """
        self._core.close()

    def __reduce__(self) -> NoReturn:
        # Of copy.copy, copy.deepcopy and pickle: two would share what `close` closes.
        raise TypeError("a Renderer cannot be copied or pickled; create another one")

    def __enter__(self) -> Renderer:
        if self.closed:
            raise ValueError("the renderer is closed")
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<vkbloom.Renderer on {self.info.summary}{', closed' if self.closed else ''}>"

    def _repr_html_(self) -> str:
        """Return the table of `display.renderer_html`."""
        # Late: notebooks need it, and nothing else.
        from vkbloom.views import display  # noqa: PLC0415

        return display.renderer_html(self.info, closed=self.closed)

    def render(
        self,
        scene: Scene,
        settings: Settings | None = None,
        size: tuple[int, int] = _SCENE_SIZE,
        *,
        shading: Shading = "forward",
        time: float = 0.0,
        attachments: Literal["all"] | str | Sequence[str] = "all",
        out: Mapping[str, NDArray[Any]] | None = None,
    ) -> Frames:
        """Render a scene with its bloom.

        Parameters
        ----------
        scene : Scene
        settings : Settings, optional
            By default ``Separable()``, the forward system's.
        size : (int, int)
            Width and height of the frame in pixels.
        shading : {"forward", "deferred"}
            Forward: the glow mesh is drawn into buffers of its own, blurred and added to the
            Phong-lit scene, all in 8 bits. Deferred: albedo, normal, position and brightness of
            what is seen are drawn into a G-buffer of half floats; the scene is lit from it, and
            what is blurred is the brightness: what the body's materials emit plus the glow mesh's
            colour times the scene's `glow_intensity`.
        time : float
            Of the animation, in turns: 0 and 1 are the same place. Any finite number.
        attachments : "all" or sequence of str
            Names of the framebuffers wanted. What is not wanted is neither rendered for its own
            sake nor read back.
        out : mapping of str to ndarray, optional
            Arrays to fill in place, by name; what it lacks is allocated.

        Returns
        -------
        Frames
            Forward: ``glow`` (bloom buffer size, (H, W, 4)), ``glow_depth`` ((H, W) float32),
            ``blur_vertical``, ``bloom`` (at the frame's size), ``scene`` ((H, W, 4) uint8),
            ``depth`` ((H, W) float32) and ``final`` ((H, W, 4) uint8).

            Deferred, at the frame's size but for the blur's: ``albedo``, ``normal``, ``position``
            (both in view space), ``brightness`` (all (H, W, 4) float16), ``depth``,
            ``blur_vertical``, ``bloom``, ``scene`` ((H, W, 4) float16, light plus brightness) and
            ``final`` ((H, W, 4) uint8). Where the normal is 0 there is the sky, or nothing:
            its albedo is its colour.

            With ``direct=True`` there is no ``blur_vertical``. With ``bloom=False`` there are no
            bloom buffers, and the glow mesh is left out.

        Raises
        ------
        ValueError
            An argument is out of range, an array of `out` does not fit, or the renderer is closed.
        TypeError
            An argument has the wrong type.
        OutOfMemoryError, DeviceLostError, ValidationError, Error
            The device failed. After any but a lost device the renderer can be used again.

        Notes
        -----
        A pass runs only when what it reads, its settings or its size changed since it last ran;
        ``timings`` of the result names the passes that ran.
        """
        settings = check_settings(settings)
        source = scene_source(scene, size, shading, time)
        return self._run_one(source, settings, check_attachments(attachments), out)

    def apply(
        self,
        image: NDArray[Any] | Image,
        settings: Settings | None = None,
        *,
        mask: NDArray[Any] | None = None,
        emission: NDArray[Any] | None = None,
        attachments: Literal["all"] | str | Sequence[str] = "all",
        out: Mapping[str, NDArray[Any]] | None = None,
    ) -> Frames:
        """Give an image bloom.

        Parameters
        ----------
        image : ndarray, shape (H, W, 3) or (H, W, 4), or Image
            Linear light: uint8 (read as value / 255), float16 or float32; any strides. The levels
            of a photograph are not linear: read it with `vkbloom.read`. RGB gets alpha 1; what
            becomes of an alpha is the field `alpha` of the settings. NaN and infinity count as 0 in
            the bloom and stay where they are in ``final``. An `Image` of `upload` is used as it is,
            with its mask and emission.
        settings : Settings, optional
            By default ``Separable()``.
        mask : ndarray, shape (H, W), optional
            What may glow, 0 to 1, of the image's size: uint8 (read as value / 255), bool, float16
            or float32. It is reduced bilinearly like the image, and multiplies what the threshold
            lets through. Published methods read it at the pixel centres of the first image that
            they write after their threshold.
        emission : ndarray, optional
            An image of the same shape and dtype that takes the image's place as the source of the
            bloom, as the glow mesh does in a scene; ``final`` still starts from the image.
        attachments, out
            As for `render`.

        Returns
        -------
        Frames
            ``glow`` (what the threshold lets through), the blur's framebuffers
            (``blur_vertical``; or ``down_0``, ``down_1``, ... and ..., ``up_0``), ``bloom``, all
            (H, W, 4) in the format of the bloom buffers, and ``final``, which has the image's
            shape and dtype. With ``bloom=False`` there is ``final`` only. ``info`` counts the
            "nan" and "inf" of the image and the emission.

        Raises
        ------
        ValueError
            The image has another shape, masked values or more pixels than the adapter allows, the
            mask or the emission do not fit it, an argument is out of range, an array of `out` does
            not fit, or the renderer is closed.
        TypeError
            The image has another dtype, or an argument another type.
        OutOfMemoryError, DeviceLostError, ValidationError, Error
            The device failed. After any but a lost device the renderer can be used again.

        Notes
        -----
        The same image again, to the byte, is not sent to the device again, and passes run only
        when what they read or their settings changed. The same holds for mask and emission.

        With the composite "mix" a bloom takes from the scene s only what it came of: with a mask m
        the result is s + i (b - m s), with an emission s + i b.

        Examples
        --------
        Two lamps, of which one may glow.

        >>> image = np.zeros((32, 64, 3), np.float32)
        >>> image[16, 16] = image[16, 48] = 10
        >>> mask = np.zeros((32, 64), bool)
        >>> mask[:, :32] = True
        >>> with vkbloom.Renderer("software") as renderer:
        ...     glow = renderer.apply(image, vkbloom.Pyramid(threshold=1.0), mask=mask)["glow"]
        >>> glow[16, 16, 0].item(), glow[16, 48, 0].item()
        (10.0, 0.0)
        """
        settings = check_settings(settings)
        source = image_source(image, mask, emission)
        return self._run_one(source, settings, check_attachments(attachments), out)

    def apply_many(
        self,
        image: NDArray[Any] | Image,
        settings_seq: Iterable[Settings],
        *,
        attachments: Literal["all"] | str | Sequence[str] = "all",
    ) -> Iterator[Frames]:
        """Give an image bloom with one settings after the other.

        Parameters
        ----------
        image
            As for `apply`; an array must not change before the last frame is taken.
        settings_seq : iterable of Settings
        attachments
            As for `apply`.

        Yields
        ------
        Frames
            One for each of the settings, in their order; only the passes that a change of settings
            puts out of date run.

        Notes
        -----
        The device works on the next settings while a frame is used: after the first frame,
        settings are taken from their iterable before the frames that come before theirs.
        What a wrong one of them raises is raised in its turn, after the frames before it.
        """
        names = check_attachments(attachments)
        return self._run_many(image_source(image), settings_seq, names)

    def apply_each(
        self,
        images: Iterable[NDArray[Any] | Image],
        settings: Settings | Sequence[Settings] | None = None,
        *,
        attachments: Literal["all"] | str | Sequence[str] = "all",
    ) -> Iterator[Frames]:
        """Give one image after the other bloom.

        Parameters
        ----------
        images : iterable of images
            Each as for `apply`; shapes and dtypes may change from one to the next. Each is copied
            before the next is asked for, so that one array can be filled again and again.
        settings : Settings or sequence of Settings, optional
            For all images, or one for each of them; by default ``Separable()``.
        attachments
            As for `apply`.

        Yields
        ------
        Frames
            One for each image, in their order.

        Raises
        ------
        ValueError
            At the call: the lengths of both sequences differ, or an argument is out of range. At
            the turn of an image: it is one that `apply` refuses, or there is no settings for it.
        TypeError
            `images` is not iterable, or an argument has another type.

        See Also
        --------
        apply_many : One image with one settings after the other.
        upload : Keeps an image on the device.

        Notes
        -----
        The device works on the next images while a frame is used: after the first frame, at most
        two images are taken ahead of the frame that is given. What goes wrong with an image, or
        with the iterable, is raised in its turn, after the frames before it, and is the end.

        Examples
        --------
        >>> images = (np.full((16, 24, 3), level, np.float32) for level in (0.25, 0.5, 1.0))
        >>> with vkbloom.Renderer("software") as renderer:
        ...     for frames in renderer.apply_each(images, vkbloom.Pyramid(levels=2)):
        ...         print(frames["final"].max())
        0.5
        1.0
        2.0
        """
        names = check_attachments(attachments)
        if not isinstance(images, abc.Iterable) or isinstance(images, str | bytes | np.ndarray):
            raise TypeError(
                f"images: several images are needed, not {type(images).__name__}; of one image "
                "make a list, or call apply"
            )
        if settings is not None and not isinstance(settings, Settings):
            if not isinstance(settings, abc.Sequence):
                raise TypeError(f"settings: {settings!r} is not Settings, or a sequence of them")
            settings = [check_settings(one) for one in settings]
            if isinstance(images, abc.Sized) and len(images) != len(settings):
                raise ValueError(
                    f"settings: {len(settings)} are not as many as the {len(images)} images"
                )
        if self.closed:
            raise ValueError("the renderer is closed")
        work = requests.uploaded(self._core, _paired(images, settings or check_settings(None)))
        results = requests.run(work, self._core, names, alone=True)
        return (self._frames(one, result) for one, result in results)

    def upload(
        self,
        image: NDArray[Any],
        *,
        mask: NDArray[Any] | None = None,
        emission: NDArray[Any] | None = None,
    ) -> Image:
        """Copy an image to the device, where it stays for many calls.

        Parameters
        ----------
        image : ndarray
            As for `apply`. It may change as soon as this returns.
        mask, emission : ndarray, optional
            As for `apply`. They stay with the image.

        Returns
        -------
        Image
            Accepted by this renderer wherever an image is. Calls with it compare no bytes.

        Raises
        ------
        ValueError
            The image has another shape, or more pixels than the adapter allows, the mask or the
            emission do not fit it; or the renderer is closed.
        TypeError
            The image has another dtype.
        OutOfMemoryError, DeviceLostError, ValidationError, Error
            The device failed. After any but a lost device the renderer can be used again.

        See Also
        --------
        apply_each : One image after the other, copied while the device works on others.

        Examples
        --------
        >>> with vkbloom.Renderer("software") as renderer:
        ...     image = renderer.upload(np.full((90, 160, 4), 0.5, np.float32))
        ...     dark, bright = (
        ...         renderer.apply(image, vkbloom.Separable(exposure=exposure))["final"]
        ...         for exposure in (-1.0, 1.0)
        ...     )
        >>> bool((dark < bright).all(axis=(0, 1))[:3].all())
        True
        """
        if isinstance(image, Image):
            raise TypeError("image: it was uploaded already")
        shape, dtype = image_kind(image)
        height, width, channels = shape
        source = self._core.upload(image_source(image, mask, emission), None, False)
        return Image(
            source,
            (height, width, channels),
            dtype,
            mask=mask is not None,
            emission=emission is not None,
        )

    def render_many(
        self,
        scene: Scene,
        settings_seq: Iterable[Settings],
        size: tuple[int, int] = _SCENE_SIZE,
        *,
        shading: Shading = "forward",
        time: float = 0.0,
        attachments: Literal["all"] | str | Sequence[str] = "all",
    ) -> Iterator[Frames]:
        """Render a scene with one settings after the other.

        Parameters
        ----------
        scene, size, shading, time, attachments
            As for `render`.
        settings_seq : iterable of Settings

        Yields
        ------
        Frames
            One for each of the settings, in their order; only the passes that a change of settings
            puts out of date run.

        Notes
        -----
        As for `apply_many`.
        """
        names = check_attachments(attachments)
        return self._run_many(scene_source(scene, size, shading, time), settings_seq, names)

    def plan(
        self,
        source: Scene | NDArray[Any] | Image,
        settings: Settings | None = None,
        size: tuple[int, int] | None = None,
        *,
        shading: Shading = "forward",
        attachments: Literal["all"] | str | Sequence[str] = "all",
    ) -> Plan:
        """Tell what a call would do, without rendering anything.

        Parameters
        ----------
        source : Scene or an image
            As for `render` and `apply`.
        settings : Settings, optional
            By default ``Separable()``.
        size : (int, int), optional
            Width and height of a scene's frame, by default (1280, 720). An image has its own.
        shading : {"forward", "deferred"}
            Of a scene.
        attachments
            As for `render`.

        Returns
        -------
        Plan
            The framebuffers that the call would give, with shapes and dtypes, and its passes in
            the variants that this renderer's device would run.

        Raises
        ------
        ValueError
            An argument is out of range, or does not belong to the source; or the renderer is
            closed.
        TypeError
            An argument has the wrong type.
        Error
            The device cannot do what the settings ask for.

        See Also
        --------
        render, apply : Do it.

        Notes
        -----
        The device is not asked, and other threads' calls are not waited for. What the pixels of an
        image are, and a scene's time, changes no plan.

        Examples
        --------
        >>> import vkbloom
        >>> with vkbloom.Renderer() as renderer:
        ...     plan = renderer.plan(vkbloom.Scene.ufo(), vkbloom.Pyramid(levels=2), (640, 360))
        >>> {name: shape for name, (shape, _) in plan.outputs.items() if name.startswith("down")}
        {'down_0': (128, 128, 4), 'down_1': (64, 64, 4)}
        """
        settings = check_settings(settings)
        names = check_attachments(attachments)
        kind: str = shading
        dtype = channels = None
        if is_image(source):
            for name, is_given in (("size", size is not None), ("shading", shading != "forward")):
                if is_given:
                    raise ValueError(f"{name}: the source is not a scene; leave the argument out")
            kind, (shape, dtype) = "image", image_kind(source)
            height, width, channels = shape
            planned = image_source(source)
        else:
            width, height = check_size("size", _SCENE_SIZE if size is None else size)
            planned = scene_source(cast("Scene", source), (width, height), shading, 0.0)
        plan = self._core.plan(planned, settings, names)
        outputs = framebuffers(plan)
        passes = tuple(Pass(*row[:-1]) for row in plan.passes)
        return Plan(
            kind,
            (width, height),
            dtype,
            channels,
            isinstance(source, Image) and source.mask,
            isinstance(source, Image) and source.emission,
            settings,
            tuple(outputs),
            outputs,
            passes,
        )

    def grid(
        self,
        source: Scene
        | NDArray[Any]
        | Image
        | Sequence[NDArray[Any] | Image]
        | Mapping[str, NDArray[Any] | Image],
        settings: Settings | None = None,
        axes: Mapping[str, Iterable[Any]] | None = None,
        *,
        size: tuple[int, int] | None = None,
        shading: Shading = "forward",
        time: float = 0.0,
        attachments: Literal["all"] | str | Sequence[str] = ("final",),
        reduce: Mapping[str, Callable[[Frames], Any]] | None = None,
        progress: bool | None = None,
    ) -> xarray.Dataset:
        """Render every combination of some values.

        Parameters
        ----------
        source : Scene, image, or list or mapping of images
            Several images add the dimension "image" before all others; a mapping's keys label
            them. They must have one shape and dtype.
        settings : Settings, optional
            What the axes vary; by default ``Separable()``.
        axes : mapping of str to sequence
            Values by settings field, or by "time" for a scene. "preset" has names of
            `vkbloom.presets`, or "settings" a list of Settings, of any methods: these two exclude
            each other and the argument `settings`, and the other axes change each of them.
        size : (int, int), optional
            Width and height of a scene's frames, by default (1280, 720).
        shading, time
            Of a scene, as for `render`.
        attachments : "all" or sequence of str
            The framebuffers to keep. Their shape must be the same at all points, and all are of
            uint8 or all of floats, which become the largest of their dtypes.
        reduce : mapping of str to callable, optional
            Figures to keep, by name: each is called with the `Frames` of a point, and returns a
            number or a small array. `vkbloom.reductions` has ready ones. With ``attachments=()``
            no framebuffers are kept beside them. A callable gets the framebuffers that its
            attribute ``attachments`` names, or all where it has none.
        progress : bool, optional
            True: a progress bar in a terminal or a notebook, silent elsewhere. None: the same
            where tqdm is installed. False: silent.

        Returns
        -------
        xarray.Dataset
            One dimension an axis, in the order given, then "y", "x" and "channel"; one variable a
            framebuffer and a reduction. The attributes hold the remaining settings (as JSON), the
            adapter, the driver and the version, and how many passes ran ("passes_run") and how
            many more all points have, each pass of each by itself ("passes_saved").

        Raises
        ------
        ValueError
            An argument is out of range; or, before anything is rendered, a framebuffer has
            different shapes along an axis, or some point lacks it.
        MemoryError
            The result is larger than the memory that is left; nothing was rendered.
        TypeError
            An argument has the wrong type.
        ModuleNotFoundError
            xarray is missing.
        OutOfMemoryError, DeviceLostError, ValidationError, Error
            The device failed.

        Notes
        -----
        Points are visited in the order that runs the fewest passes, whatever the order of the
        axes. For grids that outgrow memory see `vkbloom.grid_to_zarr`.

        Examples
        --------
        >>> image = np.zeros((32, 48, 3), np.float32)
        >>> image[16, 24] = 50
        >>> with vkbloom.Renderer("software") as renderer:
        ...     grid = renderer.grid(
        ...         image, axes={"preset": ["kino", "filament"], "intensity": [0.5, 1.0]}
        ...     )
        >>> dict(grid.sizes)
        {'preset': 2, 'intensity': 2, 'y': 32, 'x': 48, 'channel': 3}
        >>> grid["final"].sel(preset="kino", intensity=0.5).shape
        (32, 48, 3)
        """
        from vkbloom.grid.memory import in_memory  # noqa: PLC0415  grids cost start-up time
        from vkbloom.grid.plan import ask  # noqa: PLC0415

        asked = ask(
            source,
            settings,
            axes,
            size=size,
            shading=shading,
            time=time,
            attachments=attachments,
            reduce=reduce,
        )
        return in_memory(asked, self, progress)

    def _run_one(
        self,
        source: _core.Source,
        settings: Settings,
        names: tuple[str, ...] | None,
        out: Mapping[str, NDArray[Any]] | None,
    ) -> Frames:
        plan = self._core.plan(source, settings, names)
        arrays = _arrays_for(self._core, plan, out)
        return self._frames(settings, requests.run_one(self._core, source, plan, arrays))

    def _run_many(
        self,
        source: _core.Source,
        settings_seq: Iterable[Settings],
        names: tuple[str, ...] | None,
    ) -> Iterator[Frames]:
        # No generator itself: the arguments are checked at the call, not with the first frame.
        if not isinstance(settings_seq, abc.Iterable):
            raise TypeError(f"settings_seq: several Settings are needed, not {settings_seq!r}")
        return self._run_work(
            (requests.Work(source, check_settings(one)) for one in settings_seq), names
        )

    def _run_work(
        self, sequence: Iterable[requests.Work], names: tuple[str, ...] | None
    ) -> Iterator[Frames]:
        results = requests.run(sequence, self._core, names)
        return (self._frames(settings, result) for settings, result in results)

    def _frames(self, settings: Settings, result: requests.Result) -> Frames:
        self._save_pipelines()
        arrays, timings, (nan, inf) = result
        info = {**self._made_by, "nan": nan, "inf": inf}
        return Frames(arrays, timings=timings, settings=settings, info=info)

    def _save_pipelines(self) -> None:
        """Keep the driver's pipeline cache on disk when new pipelines came into it."""
        count = self._core.pipeline_count
        if count != self._saved_pipelines:
            from vkbloom.io import pipeline_cache  # noqa: PLC0415  costs start-up time

            # Without the cache the next start is slower: no reason to lose a frame that is there.
            # A ValueError: another thread has closed the renderer.
            with contextlib.suppress(_core.Error, ValueError):
                pipeline_cache.write(self._driver_uuid, self._core.pipeline_cache())
                self._saved_pipelines = count
