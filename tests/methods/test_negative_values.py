"""What each preset makes of negative values: as docs/presets.md says, on the device, too."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np
import pytest
from numpy.typing import NDArray

from tests import tolerance
from tests.methods.cases import presets_of_low_levels
from vkbloom import Convolution, Renderer, Settings, presets, reference

SIZE: Final = (64, 48)
LOW: Final = presets_of_low_levels(64)
ROWS: Final = {
    name.strip(" `"): [cell.strip() for cell in cells[:2]]
    for line in Path("docs/presets.md").read_text(encoding="utf-8").splitlines()
    if len(cells := line.split("|")[1:-1]) == 4 and cells[1].strip() in ("kept", "removed")
    for name in cells[3].split(",")
}
#: 3 x 3 pixels of one bright channel and two negative ones, in a black frame.
COLOURED: Final = np.zeros((SIZE[1], SIZE[0], 3), np.float32)
COLOURED[24:27, 30:33] = 40, -3, -0.5


def settings_of(name: str) -> Settings:
    """Return a preset with a threshold that the test images pass, in exact formats."""
    settings = LOW[name].replace(format="rgba32float")
    free = settings.threshold is None or settings.threshold < 0
    return settings if free else settings.replace(threshold=0.25)


def bloom(settings: Settings, image: NDArray[np.float32]) -> NDArray[np.float64]:
    made: NDArray[np.float64] = reference.apply(image, settings)["bloom"][..., :3]
    return made


def test_every_preset_has_a_row() -> None:
    assert sorted(ROWS) == sorted(presets)


@pytest.mark.parametrize("name", presets)
def test_the_bloom_of_a_dark_frame(name: str) -> None:
    made = bloom(LOW[name].replace(format="rgba32float"), np.full_like(COLOURED, -0.5))
    said = ROWS[name][0]
    if said == "negative":
        assert (made < 0).all()
    else:
        np.testing.assert_allclose(made, float(said), rtol=1e-6, atol=0)


@pytest.mark.parametrize("name", presets)
def test_negative_parts(name: str) -> None:
    """A value at the poles of the sources' weights makes no infinity."""
    made = bloom(settings_of(name), COLOURED)
    assert made[..., 0].max() > 0
    # (Blender's saturation is a difference, which is rounded.)
    assert {"kept": made.min() < -1e-3, "removed": made.min() >= -1e-15}[ROWS[name][1]]
    for value in (-1.0, -4.0, -12.0):
        image = COLOURED.copy()
        image[::2, ::2] = value
        assert np.isfinite(bloom(settings_of(name), image)).all()


# Of the convolutions one: they have the same passes.
@pytest.mark.parametrize(
    "name",
    [
        name
        for name in presets
        if name == "camera_lens" or not isinstance(presets[name], Convolution)
    ],
)
def test_the_device_agrees(renderer: Renderer, name: str) -> None:
    random = np.random.default_rng(5)
    image = random.normal(0, 2, COLOURED.shape).astype(np.float32)
    image[10:20, 10:20] = -1
    settings = settings_of(name)
    frames = renderer.apply(image, settings)
    tolerance.assert_matches_reference(frames, image, settings)
    assert np.isfinite(frames["final"]).all()
