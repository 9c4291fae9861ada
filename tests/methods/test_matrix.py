"""Every method and preset in every variant, dtype and kind of size, against the reference."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from tests import variants
from tests.conftest import SANITIZED
from tests.exhaustive import EXHAUSTIVE, by_turns
from tests.images import DTYPES, choose_given, hdr_picture, make_cut_out
from tests.methods.cases import GIVEN, METHODS, OTHERS, WHOLE, presets_of_low_levels
from tests.tolerance import assert_matches_reference
from tests.variants import VARIANTS
from vkbloom import (
    BlenderGlare,
    Convolution,
    Dirt,
    Ghosts,
    Halation,
    Halo,
    PygfxBloom,
    Pyramid,
    Renderer,
    Separable,
    Settings,
    Streaks,
    ThreeBloom,
    UrpBloom,
)

# Of the convolutions one: they have the same passes.
PRESETS = {
    name: one
    for name, one in presets_of_low_levels(64).items()
    if name == "camera_lens" or not isinstance(one, Convolution)
}
# Of these the bits are compared alone: test_glare.py and test_rg11b10.py have references.
STREAKS = Streaks(angle=20, base=3, iterations=2, threshold=0.1, halvings=1)
DIRT = Dirt(image=np.random.default_rng(5).random((9, 12, 3)))
BITS: dict[str, Settings] = {
    "flares": Separable(glare=(Ghosts(aberration=0.02), Halo(), DIRT)),
    "streaks": Pyramid(levels=2, alpha="blur", glare=(STREAKS,)),
    "encoded": PygfxBloom(format="rgba8unorm-srgb"),
    # (Dithering makes two levels of a value that differs in its last bit.)
    "dithered": WHOLE["dithered"],
}
CASES: dict[str, tuple[Settings, tuple[str, ...]]] = {
    **{name: (one, ()) for name, one in (METHODS | WHOLE | OTHERS | PRESETS | BITS).items()},
    **GIVEN,
}
# Sides that are multiples of the variants' strips and tiles, and some that are not; levels of
# exactly half the size, and others; less than a kernel.
SIZES = ((97, 61), (72, 64), (1, 1), (64, 48), (7, 1), (260, 24), (1, 9), (13, 7))
# These have all three variants, the others two by turns: methods have each in some size, presets
# in one of their two rows. By turns are all under the sanitizers, since a method's plans in the two
# others differ in few rows.
COMPLETE = set() if SANITIZED else {*WHOLE, *BITS, *itertools.islice(GIVEN, 4)}
if EXHAUSTIVE:
    COMPLETE = {*CASES}


def has_equal_bits(settings: Settings) -> bool:
    """Whether variants add in one order: not in blurs into another size, transforms, sun beams."""
    if isinstance(settings, Separable):
        is_resized = settings.bloom_size is not None or settings.bloom_scale != 1
        return not is_resized and min(settings.weights) >= 0
    is_transformed = (
        isinstance(settings, Convolution | Halation) or settings == PRESETS["blender_fog_glow"]
    )
    if isinstance(settings, BlenderGlare) and settings.type == "sun_beams":
        return False
    return not is_transformed and not isinstance(settings, UrpBloom | ThreeBloom)


@pytest.fixture(scope="module")
def opened() -> Iterator[dict[str, Renderer]]:
    """A renderer for each column of the table of variants."""
    renderers = {variant: variants.open_variant(variant) for variant in VARIANTS}
    yield renderers
    for renderer in renderers.values():
        renderer.close()


# Every case in one size and dtype by turns; some in every other size, or in each of an exhaustive
# run, and there in one variant. (Not under the sanitizers: other sizes reach no other code.)
ROWS = by_turns(
    [*CASES, *(name for name in PRESETS if "lens" not in name)],
    turns=itertools.product(SIZES, DTYPES),
)
IN_EACH_SIZE = [
    (name, (size, dtype))
    for number, (name, size, dtype) in enumerate(
        by_turns([*METHODS, "godot-linear", "godot-weights"], SIZES, turns=DTYPES)
    )
    if EXHAUSTIVE or (not SANITIZED and (number + number // len(SIZES)) % 2 == 0)
]


@pytest.mark.parametrize(
    ("name", "size", "dtype", "number"),
    [(name, *kind, number) for number, (name, kind) in enumerate([*ROWS, *IN_EACH_SIZE])],
)
def test_every_variant(
    opened: dict[str, Renderer], name: str, size: tuple[int, int], dtype: str, number: int
) -> None:
    """Against the reference and the bits of the others; `final` alone is the `final` of all."""
    settings, names = CASES[name]
    image = make_cut_out(*size, dtype)
    if settings.alpha == "keep":
        image = hdr_picture(*size, 3 + number // 2 % 2, dtype)
    given = choose_given(names, image)
    expected = opened["fragment"].apply(image, settings, **given)
    if name not in BITS:
        assert_matches_reference(expected, image, settings, **given)
    turn = number if number < len(CASES) else 1 + [*CASES].index(name)
    chosen = VARIANTS if name in COMPLETE else ("fragment", VARIANTS[1 + turn % 2])
    for variant in chosen if number < len(ROWS) else (VARIANTS[number % 3],):
        renderer, frames = opened[variant], expected
        if variant != "fragment":
            frames = renderer.apply(image, settings, **given)
            if has_equal_bits(settings):
                for framebuffer, values in expected.items():
                    assert_array_equal(frames[framebuffer], values, f"{variant}: {framebuffer}")
            else:
                assert_matches_reference(frames, image, settings, **given)
        # Another image in between, so that no result of the first call is cached.
        renderer.apply(image[::-1], settings, framebuffers=("final",), **given)
        alone = renderer.apply(image, settings, framebuffers=("final",), **given)
        assert_array_equal(alone["final"], frames["final"], f"{variant}: final alone")
