"""How much light a bloom adds to a picture, and what to do if it is hardly any."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._io.picture import Highlights
from vkbloom._renderer.framebuffers import Framebuffers
from vkbloom._settings.settings import Settings

# The share of a picture's light that a bloom adds, of which less gets a note.
_MIN_SHARE: Final = 0.01
# What an expansion is raised to at first, and the factor of a later one.
_EXPANDED: Final = 8.0
_MORE: Final = 2.0


def faint_note(
    share: float | None,
    settings: Settings,
    *,
    highlights: Highlights | None,
    expand: float | None = None,
    option: str = "{}",
    stronger: str = "raise intensity",
) -> str:
    """Return a text if a bloom adds less than 1 % of a picture's light, with the remedies; else "".

    - `share`: As of `added_share`.
    - `highlights`: Those of the picture's file; clipped ones can be expanded, and are up to
      `expand`.
    - `option`: What is written for a setting, such as "--{}".
    - `stronger`: What is written for a stronger bloom.
    """
    if share is None or share >= _MIN_SHARE or not settings.bloom:
        return ""
    remedies = []
    if settings.threshold:
        remedies.append(f"lower {option.format('threshold')}")
    # (The composite "screen" needs colours up to 1: of expanded ones it makes white.)
    if highlights is Highlights.CLIPPED and settings.composite != "screen":
        larger = _EXPANDED if expand is None or expand == 1 else _MORE * expand
        remedies.append(f"{option.format('expand')} {larger:g}")
    elif not remedies or settings.composite == "screen":
        remedies.append(stronger)
    percent = f"{max(100 * share, 0):.2g}"
    return f"the bloom adds {percent} % of the picture's light: {', or '.join(remedies)}"


def added_share(
    image: NDArray[Any], frames: Framebuffers, light: float | None = None
) -> float | None:
    """Return the light that the bloom adds, divided by that of the image; None: it is not known.

    `light`: `light_of` the image, if it is known.
    """
    settings = frames.settings
    light = light_of(image) if light is None else light
    if light <= 0:
        return None
    is_linear = (settings.tonemap, settings.encoding, settings.exposure) == ("none", "none", 0)
    if settings.composite == "add" and is_linear and "final" in frames:
        return (light_of(frames["final"]) - light) / light
    if "bloom" not in frames:
        return None
    # Other composites take light, too: what counts is what they spread.
    bloom = frames["bloom"]
    if settings.composite == "screen":
        # It clamps.
        return light_of(np.clip(settings.intensity * bloom[:, :, :3], 0, 1)) / light
    return settings.intensity * light_of(bloom) / light


def light_of(image: NDArray[Any]) -> float:
    """Return the sum of the finite colours of an image."""
    colours = image[:, :, :3]
    with np.errstate(invalid="ignore", over="ignore"):
        total = float(np.sum(colours, dtype=np.float64))
    if np.isfinite(total):
        return total
    return float(np.sum(colours, dtype=np.float64, where=np.isfinite(colours)))
