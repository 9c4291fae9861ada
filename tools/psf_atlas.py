#!/usr/bin/env python3
"""Draw the atlas of point-spread functions, docs/psf_atlas.md and its pictures.

Each function as a picture of six decades in a logarithmic scale; all radial profiles on double
logarithmic axes; encircled energies and modulation transfer functions; a table of figures.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from numpy.typing import NDArray

import vkbloom
from vkbloom import psf

mpl.use("agg")

# Pixels per degree of 1920 pixels in 50 degrees.
SCALE = 1920 / 50
SIDE = 255
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


def draw_pictures(path: Path) -> None:
    """Write one picture of all functions, each with its own peak as white."""
    figure, places = plt.subplots(3, 4, figsize=(12, 9.6), layout="constrained")
    for place, (name, (one, _)) in zip(places.flat, SHOWN.items(), strict=True):
        values = one.array((SIDE, SIDE), SCALE)
        decades = 1 + np.log10(np.maximum(values / values.max(), 1e-6)) / 6
        place.imshow(np.clip(decades, 0, 1))
        place.set_title(name, fontsize=10)
        place.set_axis_off()
    figure.savefig(path, dpi=70)
    plt.close(figure)


def of_presets() -> dict[str, psf.PSF]:
    """Return the point spread of each preset, without its threshold; none where it is 0."""
    found: dict[str, psf.PSF] = {}
    for name, settings in vkbloom.presets.items():
        linear = settings.replace(threshold=None)
        # Bevy's prefilter makes 0.0001 of black.
        black = vkbloom.reference.blur(np.zeros((*PRESET_SIZE, 3)), linear, format="rgba32float")
        spread = psf.measured(linear, PRESET_SIZE).own_array() - black
        if spread.max() > 0:
            found[name] = psf.samples(spread)
    return found


def draw_curves(shown: dict[str, psf.PSF], radii: NDArray[np.float64], path: Path) -> None:
    """Write radial profiles, encircled energies and transfer functions, of green."""
    figure, (profile, energy, transfer) = plt.subplots(1, 3, figsize=(15, 6), layout="constrained")
    cycles = np.linspace(0, 0.5, 60)
    for number, (name, one) in enumerate(shown.items()):
        style = {"color": mpl.colormaps["tab20"](number), "label": name}
        # Rings of pixels, in pixels of the picture.
        unit = SCALE if one.unit == "degree" else 1.0
        inside = one.encircled_energy(radii / unit)[:, 1]
        rings = np.diff(inside) / (np.pi * np.diff(radii**2))
        middle = np.sqrt(radii[1:] * radii[:-1])
        lit = rings > 1e-14
        profile.loglog(middle[lit], rings[lit], **style)
        energy.semilogx(radii, inside, **style)
        transfer.plot(cycles, one.mtf(cycles * unit)[:, 1], **style)
    profile.set(xlabel="pixels", ylabel="energy per pixel", title="radial profile")
    energy.set(xlabel="pixels", title="encircled energy")
    transfer.set(xlabel="cycles per pixel", title="modulation transfer function")
    for axes in (profile, energy, transfer):
        axes.grid(alpha=0.3)
    profile.legend(fontsize=8)
    figure.savefig(path, dpi=70)
    plt.close(figure)


def table() -> str:
    """Return the figures of each function as a table in Markdown."""
    rows = [
        "| function | energy | share of the peak pixel | within 10 pixels | within 100 pixels | |",
        "|---|---|---|---|---|---|",
    ]
    for name, (one, note) in SHOWN.items():
        unit = SCALE if one.unit == "degree" else 1.0
        energy = one.energy()[1]
        peak = one.array((1, 1), SCALE)[0, 0, 1]
        near, far = one.encircled_energy(np.array([10.0, 100.0]) / unit)[:, 1]
        rows.append(
            f"| `{name}` | {energy:.4g} | {peak / energy:.3g} | {near / energy:.4g} | "
            f"{far / energy:.4g} | {note} |"
        )
    return "\n".join(rows)


def preset_table(shown: dict[str, psf.PSF]) -> str:
    """Return the figures of each preset's point spread as a table in Markdown."""
    rows = [
        "| preset | energy | share of the peak pixel | within 10 pixels | within 100 pixels |",
        "|---|---|---|---|---|",
    ]
    for name, one in shown.items():
        energy = one.energy()[1]
        peak = one.array(PRESET_SIZE)[..., 1].max()
        near, far = one.encircled_energy([10.0, 100.0])[:, 1] / energy
        rows.append(f"| `{name}` | {energy:.4g} | {peak / energy:.3g} | {near:.4g} | {far:.4g} |")
    return "\n".join(rows)


def preset_section(docs: Path) -> str:
    """Draw the curves of the presets, and return their part of the page."""
    shown = of_presets()
    # Smaller rings would have a few pixels, or none.
    draw_curves(shown, np.geomspace(3, 400, 30), docs / "pictures" / "psf_presets.png")
    left_out = ", ".join(f"`{name}`" for name in vkbloom.presets if name not in shown)
    return (
        "## Presets\n\n"
        f"The point is one pixel of 1 in the middle of {PRESET_SIZE[0]} x {PRESET_SIZE[1]} pixels. "
        "The presets have no threshold here. Methods\nthat are not linear spread brighter pixels "
        "differently. The energy is that of the bloom, before the composite.\n"
        f"{left_out} is missing, because it removes a single pixel as a firefly.\n\n"
        "![Radial profiles, encircled energies, transfer functions of presets]"
        "(pictures/psf_presets.png)\n\n"
        f"{preset_table(shown)}\n"
    )


def fit_table() -> str:
    """Return how near a pyramid comes to each function, by its number of levels."""
    counts = (2, 4, 6, 8)
    rows = [
        f"| function | {' | '.join(f'{count} levels' for count in counts)} | stays |",
        f"|---|{'---|' * len(counts)}---|",
    ]
    with vkbloom.Renderer("software") as renderer:
        for name, (one, _) in SHOWN.items():
            found = [
                vkbloom.fit_pyramid(
                    one, count, pixels_per_degree=SCALE, direct=True, loss="log", renderer=renderer
                )
                for count in counts
            ]
            cells = [f"{result.loss:.2g}" for result in found]
            stays = 1 - found[-1].settings.intensity
            rows.append(f"| `{name}` | {' | '.join(cells)} | {stays:.2f} |")
    return "\n".join(rows)


def main() -> None:
    """Write the page and its pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("docs", nargs="?", type=Path, default=Path("docs"))
    docs = parser.parse_args().docs
    draw_pictures(docs / "pictures" / "psf_atlas.jpg")
    functions = {name: one for name, (one, _) in SHOWN.items()}
    draw_curves(functions, np.geomspace(0.5, 2000, 80), docs / "pictures" / "psf_curves.png")
    (docs / "psf_atlas.md").write_text(
        "# Atlas of point-spread functions\n\n"
        "<!-- Made by tools/psf_atlas.py. -->\n\n"
        "The functions of [`vkbloom.psf`](psf.md) on a frame of 1920 pixels that spans 50 degrees: "
        f"{SCALE:g}\npixels per degree. Formulas and sources are in the docstrings.\n\n"
        "![Pictures of the functions](pictures/psf_atlas.jpg)\n\n"
        f"{SIDE} x {SIDE} pixels around the point. White is a channel's largest value, black is a "
        "millionth of it or less.\n\n"
        "![Radial profiles, encircled energies, transfer functions](pictures/psf_curves.png)\n\n"
        "The curves and the table are of the green channel.\n\n"
        f"{table()}\n\n"
        "## Approximation by a pyramid\n\n"
        "[`vkbloom.fit_pyramid`](fits.md) approximates each function on 512 x 512 pixels. "
        "The figures are the residuals by\nnumber of levels: the root mean square of the "
        "difference of logarithms, in decades, over all pixels of at least 1e-4\nof the peak. "
        "The last column is the share of light that 8 levels do not blur.\n\n"
        f"{fit_table()}\n\n{preset_section(docs)}"
    )


if __name__ == "__main__":
    main()
