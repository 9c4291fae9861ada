"""vkbloom: measure bloom.

A complete Vulkan bloom pipeline that returns each of its framebuffers as a NumPy array. It runs on
a GPU, or on a CPU with Mesa's lavapipe.

Examples
--------
>>> image = np.zeros((16, 16, 4), np.uint8)
>>> image[8, 8] = 255
>>> with vkbloom.Renderer("software") as renderer:
...     frames = renderer.apply(image, vkbloom.Separable())
>>> list(frames)
['glow', 'blur_vertical', 'bloom', 'final']
>>> frames["final"].shape
(16, 16, 4)
"""

from __future__ import annotations

from typing import Any

import lazy_loader

try:
    from vkbloom import _core
except ImportError as error:
    from vkbloom._no_core import stand_in

    # (Of the package, since other modules import it from here.)
    _core = stand_in(error)
else:
    from vkbloom import _errors
    from vkbloom._spelling import describe_unknown

    _core.connect(_errors, describe_unknown)
# These supply the registries of methods, glare, exposures, anti-aliasing, presets, point spreads.
from vkbloom import _antialiasing, _exposure, _glare, _methods, _presets, psf  # noqa: F401
from vkbloom._version import installed_version

_attribute, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return installed_version()
    return _attribute(name)
