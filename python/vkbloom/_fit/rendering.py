"""Renders of an image in floats, also after the renderer of a fit was closed."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from vkbloom._fit.losses import light
from vkbloom._gradients.passes import in_floats
from vkbloom._locks import cached_property
from vkbloom._renderer.default import default_renderer
from vkbloom._renderer.image import Image
from vkbloom._renderer.renderer import Renderer
from vkbloom._renderer.sources import uploaded_inputs
from vkbloom._settings.settings import Settings, check_settings


class Rendering:
    """One framebuffer of one image by its settings, in floats that no store rounds.

    `pixels`: The image as an array, which is copied; None: that of `uploaded`, which is read from
    its renderer when it is needed. A closed renderer is replaced by the default one.
    """

    def __init__(
        self, renderer: Renderer, uploaded: Image, pixels: NDArray[Any] | None, framebuffer: str
    ) -> None:
        self._renderer: Renderer | None = renderer
        self._uploaded: Image | None = uploaded
        self._given = None if pixels is None else {"image": np.array(pixels)}
        self._framebuffer = framebuffer
        self._handle: tuple[Renderer, Image] | None = None

    def __call__(self, settings: Settings) -> NDArray[np.float64]:
        """Return the light of the framebuffer."""
        renderer, image = self._on_device()
        floats = in_floats(settings)
        return light(
            renderer.apply(image, floats, framebuffers=[self._framebuffer])[self._framebuffer]
        )

    def _on_device(self) -> tuple[Renderer, Image]:
        renderer, uploaded = self._renderer, self._uploaded
        is_open = renderer is not None and not renderer.closed
        if is_open and uploaded is not None and uploaded.dtype != np.uint8:
            return cast("Renderer", renderer), uploaded
        if self._handle is None or self._handle[0].closed:
            arrays = self._arrays
            renderer = renderer if renderer is not None and is_open else default_renderer()
            pixels = arrays.pop("image")
            self._handle = renderer, renderer.upload(pixels, **arrays)
        return self._handle

    @property
    def _arrays(self) -> dict[str, Any]:
        """The image, and its mask and emission, where levels of 8 bits are floats."""
        arrays = dict(self._inputs)
        for name, array in arrays.items():
            if name != "mask" and np.asarray(array).dtype == np.uint8:
                arrays[name] = np.asarray(array, np.float32) / 255
        return arrays

    @cached_property
    def _inputs(self) -> dict[str, Any]:
        if self._given is not None:
            return self._given
        renderer, uploaded = self._renderer, self._uploaded
        if renderer is None or renderer.closed or uploaded is None:
            raise ValueError(
                "image: the renderer that had the uploaded image is closed; ask for intervals "
                "before, or give the array to fit"
            )
        alone = check_settings(None).replace(bloom=False)
        inputs = uploaded_inputs(
            uploaded, lambda: renderer.apply(uploaded, alone, framebuffers="final")["final"]
        )
        return dict(inputs.on_host())

    def __getstate__(self) -> dict[str, Any]:
        try:
            given = self._inputs
        except ValueError:
            given = None
        nothing = {"_renderer": None, "_uploaded": None, "_handle": None}
        return {**nothing, "_given": given, "_framebuffer": self._framebuffer}
