"""The framebuffers that a renderer returns: by name, with timings, settings and adapter."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from vkbloom._argument_types import check_arguments
from vkbloom._errors import Error
from vkbloom._extras import import_extra
from vkbloom._formats import IMAGE_DTYPES
from vkbloom._framebuffers import dimensions
from vkbloom._public import public
from vkbloom._renderer.device_arrays import DeviceArray, on_host
from vkbloom._renderer.framebuffers import Framebuffers
from vkbloom._renderer.state import State
from vkbloom._spelling import describe_unknown

if TYPE_CHECKING:
    from pathlib import Path

    import xarray

    from vkbloom._settings.exposed import ExposedSettings
    from vkbloom._settings.settings import Settings

_CHANNELS = ("r", "g", "b", "a")


@public("vkbloom")
class Frames(Framebuffers):
    """Framebuffers by name, in the order of the data flow, with timings, settings and adapter.

    A read-only mapping: framebuffers cannot be added, replaced or removed. The arrays are plain
    `numpy.ndarray`, or `DeviceArray` where they stay on the device, and belong to the caller. Two
    Frames are equal only if they are the same object; compare their arrays with
    `numpy.array_equal`.

    Parameters
    ----------
    arrays : mapping of str to ndarray
        Images of shape (H, W, 3) or (H, W, 4) and dtype uint8, float16 or float32; depth of
        shape (H, W) and dtype float32. Top row first. They are not copied.
    timings : mapping of str to float
        Seconds on the device by pass name, for the passes that ran; NaN if the device's queue has
        no timestamps.
    settings : Settings
        The settings of the request.
    info : mapping of str to object
        "adapter", "driver", "version", and the numbers of "nan" and "inf" values in the input;
        "driver_sha256", where the driver is that of ``vkbloom-lavapipe``; "psf_kernels" and
        "psf_error", where a `psf.Varying` is computed by so many kernels with this error.
    """

    def __init__(
        self,
        arrays: Mapping[str, NDArray[Any]],
        *,
        timings: Mapping[str, float],
        settings: Settings,
        info: Mapping[str, Any],
    ) -> None:
        self._arrays = {name: _check(name, array) for name, array in arrays.items()}
        self._timings = {name: float(seconds) for name, seconds in timings.items()}
        self._settings = settings
        self._info = dict(info)
        self._end: Callable[[], tuple[dict[str, float], int, int]] | None = None
        self._state = State()
        self._is_exposed = "exposure" in self._arrays
        self._exposed: ExposedSettings | None = None

    def _finish(self, timings: dict[str, float], nan: int, inf: int) -> None:
        """Add what is known when the device has finished."""
        self._timings = timings
        self._info |= {"nan": nan, "inf": inf}

    def _finish_later(self, end: Callable[[], tuple[dict[str, float], int, int]]) -> None:
        """Call `end`, which waits and returns the arguments of `_finish`, when they are read."""
        self._end = end

    def _complete(self) -> None:
        if (end := self._end) is not None:
            self._finish(*end())
            self._end = None

    def _on_host(self) -> Frames:
        """Return the same with arrays of NumPy: this object, if it has no others."""
        if not any(isinstance(array, DeviceArray) for array in self._arrays.values()):
            return self
        return self._with({name: on_host(array) for name, array in self._arrays.items()})

    def _with(
        self, arrays: Mapping[str, NDArray[Any]], timings: Mapping[str, float] | None = None
    ) -> Frames:
        """Return frames of the same call with other arrays."""
        times = self.timings if timings is None else timings
        made = Frames(arrays, timings=times, settings=self._settings, info=self.info)
        made._state, made._exposed = self._state, self._exposed
        made._is_exposed = self._is_exposed
        return made

    def _stages(self) -> dict[str, str]:
        if self._exposed is None:
            return super()._stages()
        import json  # noqa: PLC0415  costs start-up time

        # (It is not read if the renderer is closed.)
        before = None
        with contextlib.suppress(Error, ValueError):
            before = self._state.before()
        return {"stages": json.dumps(self._exposed.to_record(before))}

    @property
    def timings(self) -> Mapping[str, float]:
        """Seconds on the device by pass name, for the passes that ran; read-only.

        NaN if the device's queue has no timestamps. Of framebuffers on a GPU this waits until they
        are complete.
        """
        self._complete()
        return MappingProxyType(self._timings)

    @property
    def settings(self) -> Settings:
        """The settings of the request."""
        return self._settings

    @property
    def state(self) -> Mapping[str, NDArray[Any]]:
        """What a call continues from that is given this as `state`: framebuffers by name.

        Those whose content the method's passes read in the next frame, and what earlier calls have
        handed on that this one did not write. Empty for a method that reads none. It does not
        change, can be pickled, and is equal to another one whose arrays have the same bytes. Its
        images stay on the device until it is collected; an array is read from there when it is
        first taken, or when the renderer is closed.
        """
        return self._state

    @property
    def exposure(self) -> float:
        """The stops that ``final`` has, before its tone curve.

        The field `exposure` of the settings, plus those of an exposure that has been applied. It
        is infinite where an engine's multiplier is. It is read from the device when it is first
        asked for.
        """
        stops = self._settings.exposure
        if not self._is_exposed:
            return stops
        # (That of the state is on the device.)
        adapted = self["exposure"] if "exposure" in self._arrays else self._state["exposure"]
        before, after = np.asarray(adapted, np.float64)[0, 0, 1:3]
        with np.errstate(divide="ignore"):
            return stops + float(np.log2(before) + np.log2(after))

    @property
    def info(self) -> dict[str, Any]:
        """Adapter, driver and version, and the numbers of "nan" and "inf" values in the input.

        Of framebuffers on a GPU this waits until they are complete.
        """
        self._complete()
        return self._info

    def __getitem__(self, name: str) -> NDArray[Any]:
        try:
            return self._arrays[name]
        except KeyError:
            raise KeyError(describe_unknown("unknown framebuffer", name, self._arrays)) from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def __len__(self) -> int:
        return len(self._arrays)

    # Mapping compares values with ==, which is ambiguous for arrays.
    def __eq__(self, other: object) -> bool:
        return self is other

    def __hash__(self) -> int:
        return object.__hash__(self)

    def __repr__(self) -> str:
        column = max((len(name) for name in self), default=0)
        lines = [f"Frames on {self._info.get('adapter', 'an unnamed adapter')}"]
        lines += [
            f"  {name:{column}}  {array.dtype!s:7}  {array.shape}" for name, array in self.items()
        ]
        return "\n".join(lines)

    def to_xarray(self) -> xarray.Dataset:
        """Return the framebuffers as one Dataset with a variable for each.

        Framebuffers of the size of `final` (or, without it, of the last image) have the dimensions
        "y" and "x". Others have "<first>_y" and "<first>_x", where <first> is the first
        framebuffer of that size. The dimension of `final`'s channels is "channel", of another
        number of channels "<first>_channel".

        Returns
        -------
        xarray.Dataset
            The coordinates of channels are "r", "g", "b" and, if there is alpha, "a". The
            attributes contain `info`, and the settings and timings as JSON, because netCDF and
            Zarr store only text and numbers. The variables share memory with the framebuffers.
        """
        import json  # noqa: PLC0415  costs start-up time

        xr = import_extra("xarray", "grid", "Frames.to_xarray")
        dims = dimensions(self)
        host = self._on_host()
        channels = {
            dims[name][2]: list(_CHANNELS[: array.shape[2]])
            for name, array in self.items()
            if array.ndim == 3
        }
        dataset: xarray.Dataset = xr.Dataset(
            {name: (dims[name], array) for name, array in host.items()},
            coords=channels,
            attrs={
                **{k: v if isinstance(v, int | float) else str(v) for k, v in self.info.items()},
                "settings": json.dumps(self._settings.to_dict()),
                "timings": json.dumps(dict(self.timings)),
                **self._stages(),
            },
        )
        return dataset

    @check_arguments
    def save(self, path: str | os.PathLike[str]) -> list[Path]:
        """Write the framebuffers to image files without loss.

        ========================== ========================================================
        path                       files
        ========================== ========================================================
        ``out.exr``                one multi-part OpenEXR file, one part per framebuffer
        ``out.png``, ``out.tif``   ``out_<name>.png``; ``out.png`` if there is one only
        a folder, or no extension  ``<name>.png`` in that folder, which is created if missing
        ========================== ========================================================

        A framebuffer that the format cannot hold is written as ``.exr`` with the same stem: float
        images and depth beside ``out.png``, for example. If the format has no alpha, an alpha of
        1 everywhere is left out. JPEG, WebP, GIF and Radiance HDR compress with loss.

        In OpenEXR, half stays half and float stays float. 8-bit values are stored as half,
        value / 255, and the attribute ``vkbloom:dtype`` is "uint8"; ``round(255 * value)`` gives
        the original levels. Depth is a float channel ``Z``. All parts of a file must have the same
        display window, which is that of `final` (without it, of the last image). Values are stored
        without gamma and without multiplication by alpha.

        If the format has such attributes, ``Software`` and ``ImageDescription`` (``Description``
        in PNG) contain the version, the adapter and the settings, and ``vkbloom:<key>`` contains
        each entry of `info`, and the settings and timings as JSON. With an exposure,
        ``vkbloom:stages`` has it, its step of time, and what it continued, as JSON; the state is
        null if the renderer was closed. In TIFF and JPEG the ``ImageDescription`` contains all of
        it.

        Parameters
        ----------
        path : str or path-like
            A file name with an extension that OpenImageIO writes, or a folder. Existing files are
            replaced; symbolic links are followed. All files are written under temporary names and
            renamed when all are complete. Files of an earlier save to the same path that this one
            does not have are removed; in a folder, only those of a save that has a framebuffer of
            the same name.

        Returns
        -------
        list of Path
            The written files, in the order of the framebuffers.
        """
        from vkbloom._renderer import frame_files  # noqa: PLC0415  costs start-up time

        return frame_files.save(self._on_host(), path)

    @classmethod
    @check_arguments
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read framebuffers from files that `save` wrote.

        Parameters
        ----------
        path : str or path-like
            The argument of `save`: a file name, or a folder.

        Returns
        -------
        Frames
            The framebuffers in their original order and dtypes, with their settings, timings and
            info.

        Notes
        -----
        Other files in a folder are ignored, and so are files with other names that start the same.
        Files of two saves, and those of a save that was killed while it renamed its files, are a
        ValueError that names them.
        JPEG compresses with loss, so its values differ from the saved ones.
        """
        from vkbloom._renderer import frame_files  # noqa: PLC0415  costs start-up time

        arrays, facts = frame_files.load(path)
        return cls(arrays, **facts)

    def _repr_png_(self) -> bytes | None:
        """Return the picture of `contact_sheet.leading_png`; None without framebuffers."""
        from vkbloom._renderer import contact_sheet  # noqa: PLC0415  costs start-up time

        return contact_sheet.leading_png(self._on_host()) if self else None

    def _repr_html_(self) -> str:
        """Return the page of `contact_sheet.contact_sheet_html`."""
        from vkbloom._renderer import contact_sheet  # noqa: PLC0415  costs start-up time

        return contact_sheet.contact_sheet_html(self._on_host())


def _check(name: str, array: NDArray[Any]) -> NDArray[Any]:
    if not isinstance(name, str):
        raise TypeError(f"arrays: {name!r} is not a name; use a str")
    if not name.isidentifier():
        raise ValueError(f"arrays: {name!r} is not an identifier, as names of framebuffers must be")
    if isinstance(array, DeviceArray):
        return array
    if not isinstance(array, np.ndarray):
        raise TypeError(f"arrays[{name!r}]: {type(array).__name__} is not a NumPy array")
    is_image = array.ndim == 3 and array.shape[2] in (3, 4) and array.dtype in IMAGE_DTYPES
    is_depth = array.ndim == 2 and array.dtype == np.float32
    if not (is_image or is_depth) or array.size == 0:
        raise ValueError(
            f"arrays[{name!r}]: {array.dtype} of shape {array.shape} is neither an image, "
            "(H, W, 3) or (H, W, 4) of uint8, float16 or float32, nor depth, (H, W) of float32"
        )
    return np.asarray(array)
