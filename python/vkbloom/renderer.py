"""The renderer: scenes and settings in, framebuffers out."""

from __future__ import annotations

import contextlib
import math
import os
from collections import abc
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from vkbloom import _core, requests
from vkbloom.adapter import AdapterInfo
from vkbloom.checks import check_attachments, check_image, check_size, check_time
from vkbloom.frames import Frames
from vkbloom.settings import SHADINGS, Settings, Shading, check_settings
from vkbloom.version import installed_version

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from types import TracebackType

    import xarray
    from numpy.typing import NDArray

    from vkbloom.scene import Mesh, Scene
    from vkbloom.scene.textures import Texture


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


def _allocator(
    core: _core.Renderer,
    out: Mapping[str, NDArray[Any]] | None,
) -> Callable[[str, tuple[int, ...], str], NDArray[Any]]:
    """Return what gives the core its arrays: those of `out` where they fit, else new ones."""
    if out is not None and not isinstance(out, abc.Mapping):
        raise TypeError(f"out: a mapping of names to arrays is needed, not {type(out).__name__}")
    given: dict[str, NDArray[Any]] = {}

    def allocate(name: str, shape: tuple[int, ...], dtype: str) -> NDArray[Any]:
        if out is None or name not in out:
            return core.new_array(np.empty, shape, dtype)
        array = out[name]
        if not isinstance(array, np.ndarray):
            raise TypeError(f"out: {name} must be an array, not {type(array).__name__}")
        if array.shape != shape or array.dtype != np.dtype(dtype):
            raise ValueError(
                f"out: {name} has shape {array.shape} and dtype {array.dtype}, "
                f"it must have {shape} and {dtype}"
            )
        if not array.flags.c_contiguous or not array.flags.writeable:
            raise ValueError(f"out: {name} must be C-contiguous and writeable")
        for other, taken in given.items():
            # Of contiguous arrays the bounds say it all.
            if np.may_share_memory(array, taken):
                raise ValueError(f"out: {other} and {name} must not share memory")
        given[name] = array
        return array

    return allocate


def _check_filled(out: Mapping[str, NDArray[Any]] | None, arrays: Mapping[str, object]) -> None:
    """Raise ValueError where `out` names what was not among the framebuffers of the call."""
    for name in out or ():
        if name not in arrays:
            raise ValueError(f"out: {name!r} is not among the framebuffers: {', '.join(arrays)}")


class Renderer:
    """A device and its pipeline, in this process until it is closed.

    Parameters
    ----------
    adapter : str
        "auto" (discrete, integrated, virtual, cpu, in that order), "software", "hardware", or a
        part of an adapter's name, in any case. The environment variable VKBLOOM_ADAPTER replaces
        "auto".
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
        forms = os.environ.get("VKBLOOM_FORM") or "auto"
        from vkbloom.io import pipeline_cache  # noqa: PLC0415  costs start-up time

        self._core = _core.Renderer(
            adapter, bool(validation), forms, _frame_seconds(), pipeline_cache.read
        )
        *fields, self._driver_uuid = self._core.info
        self.info = AdapterInfo(*fields)
        self._made_by = {
            "adapter": self.info.name,
            "driver": self.info.driver_info or self.info.driver,
            "version": installed_version(),
        }
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
        size: tuple[int, int] = (1280, 720),
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
        arguments = _render_arguments(scene, size, shading, time, attachments)
        return self._run_one(self._core.render(*arguments), settings, out)

    def apply(
        self,
        image: NDArray[Any],
        settings: Settings | None = None,
        *,
        attachments: Literal["all"] | str | Sequence[str] = "all",
        out: Mapping[str, NDArray[Any]] | None = None,
    ) -> Frames:
        """Give an image bloom.

        Parameters
        ----------
        image : ndarray, shape (H, W, 3) or (H, W, 4)
            uint8 (read as value / 255), float16 or float32; any strides. RGB gets alpha 1; RGBA
            keeps its alpha, which the bloom never changes. NaN and infinity count as 0 in the
            bloom and stay where they are in ``final``.
        settings : Settings, optional
            By default ``Separable()``.
        attachments, out
            As for `render`.

        Returns
        -------
        Frames
            ``glow`` (what the threshold lets through), the blur's framebuffers
            (``blur_vertical``; or ``down_0``, ``down_1``, ... and ..., ``up_0``), ``bloom``, all
            (H, W, 4) in the format of the bloom buffers, and ``final``, which has the image's
            shape and dtype. With ``bloom=False`` there is ``final`` only. ``info`` counts the
            "nan" and "inf" of the image.

        Raises
        ------
        ValueError
            The image has another shape, masked values or more pixels than the adapter allows, an
            argument is out of range, an array of `out` does not fit, or the renderer is closed.
        TypeError
            The image has another dtype, or an argument another type.
        OutOfMemoryError, DeviceLostError, ValidationError, Error
            The device failed. After any but a lost device the renderer can be used again.

        Notes
        -----
        The same image again, to the byte, is not sent to the device again, and passes run only
        when what they read or their settings changed.
        """
        settings = check_settings(settings)
        batch = self._core.apply(check_image(image), check_attachments(attachments))
        return self._run_one(batch, settings, out)

    def apply_many(
        self,
        image: NDArray[Any],
        settings_seq: Iterable[Settings],
        *,
        attachments: Literal["all"] | str | Sequence[str] = "all",
    ) -> Iterator[Frames]:
        """Give an image bloom with one settings after the other.

        Parameters
        ----------
        image
            As for `apply`; it must not change before the last frame is taken.
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
        image = check_image(image)
        names = check_attachments(attachments)
        return self._run_many(lambda: self._core.apply(image, names), settings_seq)

    def render_many(
        self,
        scene: Scene,
        settings_seq: Iterable[Settings],
        size: tuple[int, int] = (1280, 720),
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
        arguments = _render_arguments(scene, size, shading, time, attachments)
        return self._run_many(lambda: self._core.render(*arguments), settings_seq)

    def grid(
        self,
        source: Scene | NDArray[Any] | Sequence[NDArray[Any]] | Mapping[str, NDArray[Any]],
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
        source : Scene, ndarray, or list or mapping of ndarray
            Several images add the dimension "image" before all others; a mapping's keys label
            them. They must have one shape and dtype.
        settings : Settings, optional
            What the axes vary; by default ``Separable()``.
        axes : mapping of str to sequence
            Values by settings field, or by "time" for a scene.
        size : (int, int), optional
            Width and height of a scene's frames, by default (1280, 720).
        shading, time
            Of a scene, as for `render`.
        attachments : "all" or sequence of str
            The framebuffers to keep. Their shape and dtype must be the same at all points.
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
            different shapes along an axis.
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

    def _survey_apply(
        self, image: NDArray[Any], settings: Settings
    ) -> dict[str, tuple[tuple[int, ...], np.dtype[Any]]]:
        """Return shape and dtype of all framebuffers that `apply` would give, without rendering."""
        return _surveyed(self._core.apply(image, None), settings)

    def _survey_render(
        self, scene: Scene, settings: Settings, size: tuple[int, int], shading: Shading
    ) -> dict[str, tuple[tuple[int, ...], np.dtype[Any]]]:
        """Return shape and dtype of all framebuffers that `render` would give, likewise."""
        arguments = _render_arguments(scene, size, shading, 0.0, "all")
        return _surveyed(self._core.render(*arguments), settings)

    def _run_one(
        self,
        batch: _core.Batch,
        settings: Settings,
        out: Mapping[str, NDArray[Any]] | None,
    ) -> Frames:
        batch.add(settings, _allocator(self._core, out))
        batch.submit()
        (result,) = batch.collect()
        _check_filled(out, result[0])
        return self._frames(settings, result)

    def _run_many(
        self, open_batch: Callable[[], _core.Batch], settings_seq: Iterable[Settings]
    ) -> Iterator[Frames]:
        # No generator itself: the arguments are checked at the call, not with the first frame.
        if not isinstance(settings_seq, abc.Iterable):
            raise TypeError(f"settings_seq: several Settings are needed, not {settings_seq!r}")
        checked = map(check_settings, settings_seq)
        results = requests.run(checked, open_batch, _allocator(self._core, None))
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


def _surveyed(
    batch: _core.Batch, settings: Settings
) -> dict[str, tuple[tuple[int, ...], np.dtype[Any]]]:
    """Return what a batch asks arrays for; it is not submitted, so that the device does nothing."""
    found: dict[str, tuple[tuple[int, ...], np.dtype[Any]]] = {}

    def allocate(name: str, shape: tuple[int, ...], dtype: str) -> NDArray[Any]:
        found[name] = (shape, np.dtype(dtype))
        # Memory that nobody touches costs nothing.
        return np.empty(shape, dtype)

    batch.add(settings, allocate)
    return found


def _render_arguments(
    scene: Scene,
    size: tuple[int, int],
    shading: Shading,
    time: float,
    attachments: str | Sequence[str],
) -> tuple[Any, ...]:
    """Return what the core renders, checked."""
    if shading not in SHADINGS:
        raise ValueError(f"shading: {shading!r} is not one of {', '.join(SHADINGS)}")
    turns = check_time(time)
    from vkbloom.scene import Scene  # noqa: PLC0415  loading scenes costs start-up time

    if not isinstance(scene, Scene):
        raise TypeError(f"scene: a Scene is needed, not {scene!r}")
    camera = scene.camera
    return (
        _scene_arrays(scene),
        (camera.position, camera.rotation, camera.fov, camera.near, camera.far),
        check_size("size", size),
        shading,
        # Whole turns change nothing; without them large times keep their precision.
        math.fmod(turns, 1.0),
        scene.glow_intensity,
        check_attachments(attachments),
    )


def _scene_arrays(scene: Scene) -> Any:
    """Return the scene as the core takes it."""
    # Textures by what they are, not by what they hold: each goes to the device once.
    numbers: dict[Texture, int] = {}
    body = _mesh_arrays(scene.body, numbers)
    glow = None if scene.glow is None else _mesh_arrays(scene.glow, numbers)
    sky = () if scene.skybox is None else scene.skybox.levels
    textures = tuple(
        (
            texture.levels,
            *texture.address_mode,
            texture.mag_filter,
            texture.min_filter,
            texture.mipmap_filter,
        )
        for texture in numbers
    )
    return scene.contents_serial, body, glow, sky, textures


def _mesh_arrays(mesh: Mesh, numbers: dict[Texture, int]) -> Any:
    """Return a mesh as the core takes it; textures get the next numbers."""
    surfaces = tuple(
        (
            surface.index_count,
            *(
                numbers.setdefault(texture, len(numbers))
                for texture in (surface.base, surface.emission)
            ),
        )
        for surface in mesh.surfaces
    )
    return mesh.vertices, mesh.indices, mesh.emission, mesh.texcoords, surfaces
