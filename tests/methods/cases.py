"""The settings and formats with which all paths through the core are tested."""

from __future__ import annotations

from vkbloom import DualKawase, Pyramid, Separable, Settings, gaussian_weights, presets

DEFERRED = (0.175713, 0.121703, 0.065984, 0.028002, 0.0093)

# No colour of an 8-bit image has this luminance, since it is not a multiple of 1e-4 / 255. So
# rounding cannot move a pixel across the threshold.
HARD_THRESHOLD = 0.30001

METHODS: dict[str, Settings] = {
    "tutorial": Separable(),
    "outline": Separable(first_tap=0, texel="x", blur_strength=0.5),
    "fractional": Separable(blur_scale=1.7),
    "still": Separable(blur_scale=0.0),
    "deferred": Separable(weights=DEFERRED, loops=3, blur_scale=1.1),
    "layers": Separable(layers=((1.0, 1.0), (2.0, 0.5), (4.0, 0.25)), blur_strength=0.5),
    "loops-layers": Separable(layers=((1.0, 0.5), (2.5, 0.5)), loops=2, blur_strength=0.75),
    "one-weight": Separable(weights=(0.75,)),
    "longest": Separable(weights=gaussian_weights(20, 64), blur_strength=1.0),
    "direct": Separable(direct=True),
    "direct-loops-layers": Separable(
        direct=True, loops=2, layers=((1.0, 0.5), (1.5, 0.5)), blur_strength=0.75, texel="x"
    ),
    "half-size": Separable(bloom_scale=0.5),
    "double-size": Separable(bloom_scale=2.0, blur_scale=1.3),
    "fixed-size": Separable(bloom_size=(31, 23), blur_scale=0.7),
    "direct-half-size": Separable(bloom_scale=0.5, direct=True, weights=gaussian_weights(1.5)),
    "hard-threshold": Separable(threshold=HARD_THRESHOLD),
    "knee": Separable(threshold=0.3, knee=0.5, bloom_scale=0.5, intensity=0.5),
    "pyramid": Pyramid(),
    "pyramid-one-level": Pyramid(levels=1),
    "pyramid-radius": Pyramid(levels=4, radius=1.6),
    "pyramid-firefly": Pyramid(firefly_filter=True, threshold=0.2, knee=1.0),
    "pyramid-sixteen": Pyramid(levels=16, bloom_scale=0.5),
    "dual-kawase": DualKawase(),
    "dual-kawase-offset": DualKawase(levels=2, offset=2.3, threshold=HARD_THRESHOLD),
    "dual-kawase-deep": DualKawase(levels=7, bloom_size=(64, 48), intensity=0.3),
}

DTYPES = ("uint8", "float16", "float32")


def presets_of_low_levels(height: int) -> dict[str, Settings]:
    """Return the presets; levels whose height does not follow from the image's have this one.

    Of small images, levels of the engines' heights take seconds and show nothing more.
    """
    fields = {"bevy_natural": "max_mip_dimension", "photo": "max_mip_dimension"}
    fields |= {"filament": "resolution"}
    return {
        name: each.replace(**{fields[name]: height}) if name in fields else each
        for name, each in presets.items()
    }
