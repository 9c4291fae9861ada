"""Framebuffers that come back from a renderer: by name, with how they came about."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from vkbloom.checks import import_extra
from vkbloom.framebuffers import dimensions

if TYPE_CHECKING:
    from pathlib import Path

    import xarray

    from vkbloom.settings import Settings

__all__ = ["Frames", "dimensions"]

_IMAGE_DTYPES = (np.dtype(np.uint8), np.dtype(np.float16), np.dtype(np.float32))
_CHANNELS = ("r", "g", "b", "a")


class Frames(Mapping[str, NDArray[Any]]):
    """Framebuffers by name, in the order that the data flows, with how they came about.

    A read-only mapping: framebuffers cannot be added, replaced or removed. The arrays
    themselves are plain `numpy.ndarray` and belong to the caller. Two Frames are equal only
    if they are the same object; compare their arrays with `numpy.array_equal`.

    Parameters
    ----------
    arrays : mapping of str to ndarray
        Images of shape (H, W, 3) or (H, W, 4) and dtype uint8, float16 or float32; depth of
        shape (H, W) and dtype float32. Top row first. They are kept, not copied.
    timings : mapping of str to float
        Seconds on the device by pass name, for the passes that ran; NaN where the device's queue
        has no timestamps.
    settings : Settings
        What the frames were made with.
    info : mapping of str to object
        "adapter", "driver", "version", and how many "nan" and "inf" the input held.

    Raises
    ------
    TypeError
        If a framebuffer is not an ndarray or its name not a str.
    ValueError
        If a name is not an identifier, or an array's shape or dtype is not one of the above.
    """

    def __init__(
        self,
        arrays: Mapping[str, NDArray[Any]],
        *,
        timings: Mapping[str, float],
        settings: Settings,
        info: Mapping[str, Any],
    ) -> None:
        self._arrays = {name: _checked(name, array) for name, array in arrays.items()}
        self._timings = {name: float(seconds) for name, seconds in timings.items()}
        self._settings = settings
        self._info = dict(info)

    @property
    def timings(self) -> Mapping[str, float]:
        """Seconds on the device by pass name, for the passes that ran; read-only.

        NaN where the device's queue has no timestamps.
        """
        return MappingProxyType(self._timings)

    @property
    def settings(self) -> Settings:
        """The settings that the frames were made with."""
        return self._settings

    @property
    def info(self) -> dict[str, Any]:
        """Adapter, driver and version, and how many "nan" and "inf" the input held."""
        return self._info

    def __getitem__(self, name: str) -> NDArray[Any]:
        try:
            return self._arrays[name]
        except KeyError:
            held = ", ".join(self._arrays) or "nothing"
            raise KeyError(f"no framebuffer {name!r}; there are: {held}") from None

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
        """Return the framebuffers as one Dataset, a variable each.

        Returns
        -------
        xarray.Dataset
            Dimensions as `dimensions` gives them; channels carry the coordinates "r", "g",
            "b" and, where there is one, "a". The attributes hold `info` and, as JSON text,
            the settings and the timings: text and numbers only, as netCDF and zarr want
            them. The variables share memory with the framebuffers.

        Raises
        ------
        ModuleNotFoundError
            If xarray is missing: ``pip install vkbloom[grid]``.
        """
        import json  # noqa: PLC0415  costs start-up time

        xr = import_extra("xarray", "grid", "Frames.to_xarray")
        dims = dimensions(self)
        channels = {
            dims[name][2]: list(_CHANNELS[: array.shape[2]])
            for name, array in self.items()
            if array.ndim == 3
        }
        dataset: xarray.Dataset = xr.Dataset(
            {name: (dims[name], array) for name, array in self.items()},
            coords=channels,
            attrs={
                **{k: v if isinstance(v, int | float) else str(v) for k, v in self._info.items()},
                "settings": json.dumps(self._settings.to_dict()),
                "timings": json.dumps(self._timings),
            },
        )
        return dataset

    def save(self, path: str | os.PathLike[str]) -> list[Path]:
        """Write the framebuffers to image files and lose nothing on the way.

        ========================== ========================================================
        path                       files
        ========================== ========================================================
        ``out.exr``                one multi-part OpenEXR file, one part per framebuffer
        ``out.png``, ``out.tif``   ``out_<name>.png``; ``out.png`` if there is one only
        a folder, or no extension  ``<name>.png`` in that folder, which is made if missing
        ========================== ========================================================

        A framebuffer that the chosen format cannot hold as it is becomes an ``.exr`` of the
        same stem beside the others: float images and depth beside ``out.png``, for example.
        An alpha that is 1 everywhere is left out where the format has none. Formats that
        compress with loss (JPEG, WebP, GIF, Radiance HDR) keep their loss.

        In OpenEXR half stays half and float stays float; 8-bit values are stored as half
        value / 255, from which ``round(255 * value)`` gives the same levels again, with the
        attribute ``vkbloom:dtype`` telling what they were. Depth is a float channel ``Z``.
        The display window of all parts is that of `final` (without it, of the last image), as
        the parts of one file must share it. Values are stored as they are: no gamma, no
        multiplication by alpha.

        ``Software`` and ``ImageDescription`` (``Description`` in PNG) carry the version, the
        adapter and the settings, and ``vkbloom:<key>`` each entry of `info`, the settings
        and the timings (both as JSON), where the format stores such attributes.

        Parameters
        ----------
        path : str or path-like
            A file name with an extension that OpenImageIO writes, or a folder. What is
            already there is replaced, and links are written through. All files are written
            under temporary names first and renamed when all are complete.

        Returns
        -------
        list of Path
            The files written, in the order of the framebuffers.

        Raises
        ------
        ValueError
            If the extension is unknown, the name not UTF-8, or there is no framebuffer.
        OSError
            If a file cannot be written; it names the file, and no half file is left.
        ModuleNotFoundError
            If OpenImageIO is missing: ``pip install vkbloom[images]``.
        """
        from vkbloom.io import files  # noqa: PLC0415  costs start-up time

        return files.save(self, path)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read what `save` wrote.

        Parameters
        ----------
        path : str or path-like
            What `save` was given: a file name, or a folder.

        Returns
        -------
        Frames
            The framebuffers in the order and the dtypes that they had, with their settings,
            timings and info.

        Raises
        ------
        OSError
            There is no such file, or it cannot be opened; it names the file.
        ValueError
            A file is damaged, or holds no settings: `save` did not write it, or its format (all
            but OpenEXR and PNG) has no place for them. It names the file.
        ModuleNotFoundError
            If OpenImageIO is missing: ``pip install vkbloom[images]``.

        See Also
        --------
        save : The way there.
        """
        from vkbloom.io import files  # noqa: PLC0415  costs start-up time

        arrays, facts = files.load(path)
        return cls(arrays, **facts)

    def _repr_png_(self) -> bytes | None:
        """Return the picture of `pictures.leading_png`; None without framebuffers."""
        from vkbloom.views import pictures  # noqa: PLC0415  costs start-up time

        return pictures.leading_png(self) if self else None

    def _repr_html_(self) -> str:
        """Return the page of `pictures.contact_sheet_html`."""
        from vkbloom.views import pictures  # noqa: PLC0415  costs start-up time

        return pictures.contact_sheet_html(self)


def _checked(name: str, array: NDArray[Any]) -> NDArray[Any]:
    if not isinstance(name, str):
        raise TypeError(f"arrays: a framebuffer's name is a str, not {type(name).__name__}")
    if not name.isidentifier():
        raise ValueError(f"arrays: {name!r} cannot name a framebuffer; it must be an identifier")
    if not isinstance(array, np.ndarray):
        raise TypeError(f"arrays[{name!r}]: an ndarray is needed, not {type(array).__name__}")
    is_image = array.ndim == 3 and array.shape[2] in (3, 4) and array.dtype in _IMAGE_DTYPES
    is_depth = array.ndim == 2 and array.dtype == np.float32
    if not (is_image or is_depth) or array.size == 0:
        raise ValueError(
            f"arrays[{name!r}]: {array.dtype} of shape {array.shape} is neither an image, "
            "(H, W, 3) or (H, W, 4) of uint8, float16 or float32, nor depth, (H, W) of float32"
        )
    return np.asarray(array)
