"""Tables of point-spread functions."""

from __future__ import annotations

import numpy as np
from cells import shown_presets, table

import vkbloom
from vkbloom import psf

# Pixels per degree of 1920 pixels in 50 degrees.
SCALE = 1920 / 50
PRESET_SIZE = (512, 512)
SHOWN: dict[str, tuple[psf.PSF, str]] = {
    "spencer photopic": (psf.spencer(), "day"),
    "spencer mesopic": (psf.spencer("mesopic"), "dusk"),
    "spencer scotopic": (psf.spencer("scotopic"), "night"),
    "cie_general 35": (psf.cie_general(age=35), "0.1 to 100 degrees, scattered light alone"),
    "cie_total 20": (psf.cie_total(age=20), "the whole eye"),
    "cie_total 80": (psf.cie_total(age=80), "the whole eye"),
    "harvey_shack": (psf.harvey_shack(), "scattered light of 14 surfaces"),
    "airy f/8": (psf.airy(), "one wavelength"),
    "iris 5 blades f/8": (psf.aperture(psf.iris(blades=5)), "up to 281 pixels from the point"),
    "iris 6 blades f/8": (psf.aperture(psf.iris(blades=6)), "up to 281 pixels from the point"),
    "fog_glow 256": (psf.fog_glow(256), "Blender before 4.4"),
    "gaussian 8": (psf.gaussian(8), ""),
}
FIGURES = ["energy", "share of the peak pixel", "within 10 pixels", "within 100 pixels"]


def functions(_: vkbloom.Renderer, quick: bool) -> str:
    """Return the figures of each function, of green."""
    rows = []
    for name, (one, note) in [*SHOWN.items()][: 2 if quick else None]:
        unit = SCALE if one.unit == "degree" else 1.0
        rows.append([f"`{name}`", *_figures(one, one.array((1, 1), SCALE)[0, 0, 1], unit), note])
    return table(["function", *FIGURES, ""], rows)


def _figures(one: psf.PSF, peak: float, unit: float) -> list[str]:
    energy = one.energy()[1]
    near, far = one.encircled_energy(np.array([10.0, 100.0]) / unit)[:, 1] / energy
    return [f"{energy:.4g}", f"{peak / energy:.3g}", f"{near:.4g}", f"{far:.4g}"]


def pyramids(renderer: vkbloom.Renderer, quick: bool) -> str:
    """Return how near a pyramid comes to each function, by its number of levels."""
    counts = (2, 4, 6, 8)
    rows = []
    for name, (one, _) in [*SHOWN.items()][: 1 if quick else None]:
        found = [
            vkbloom.fit_pyramid(
                one, count, pixels_per_degree=SCALE, direct=True, loss="log", renderer=renderer
            )
            for count in counts
        ]
        stays = 1 - found[-1].settings.intensity
        rows.append([f"`{name}`", *(f"{fit.loss:.2g}" for fit in found), f"{stays:.2f}"])
    return table(["function", *(f"{count} levels" for count in counts), "stays"], rows)


def of_presets(_: vkbloom.Renderer, quick: bool) -> str:
    """Return the figures of each preset's point spread, without its threshold."""
    rows = []
    for name in shown_presets():
        linear = vkbloom.presets[name].replace(threshold=None)
        size = (64, 64) if quick else PRESET_SIZE
        # Bevy's prefilter makes 0.0001 of black.
        black = vkbloom.reference.blur(np.zeros((*size, 3)), linear, format="rgba32float")
        spread = psf.measured(linear, size).native_array() - black
        # KinoBloom removes a single pixel as a firefly. Stars take away more light than they add.
        if spread.sum() > 0:
            one = psf.samples(spread)
            rows.append([f"`{name}`", *_figures(one, one.array(size)[..., 1].max(), 1.0)])
    return table(["preset", *FIGURES], rows)
