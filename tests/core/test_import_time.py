"""The modules that ``import vkbloom`` loads: none, so that the command line can answer Ctrl-C; the
first use of a renderer loads only those that a program needs to render one frame."""

from __future__ import annotations

import pytest

import vkbloom
from tests.processes import output

# NumPy loads some of the standard library itself, differently by version.
LATE = (
    "vkbloom._cli",
    "vkbloom._doctor",
    "vkbloom._explorer",
    "vkbloom._glare.dirt",
    "vkbloom._glare.flares",
    "vkbloom._glare.streaks",
    "vkbloom._grid",
    "vkbloom._io",
    "vkbloom._methods.bevy",
    "vkbloom._methods.convolution",
    "vkbloom._methods.pygfx",
    "vkbloom._presets.named_glares",
    "vkbloom._presets.named_settings",
    "vkbloom.plans",
    "vkbloom.psf",
    "vkbloom.reference",
    "vkbloom._scene",
    "vkbloom.testing",
    "vkbloom._views",
    "hashlib",
    "html",
    "importlib.metadata",
    "json",
    "pathlib",
    "shutil",
    "tempfile",
)


def loaded(code: str) -> set[str]:
    code += "; import sys; print(*sys.modules)"
    return set(output("-c", code).split())


def test_the_import_loads_what_is_needed() -> None:
    late = {"numpy", "click", "rich", "tqdm", "OpenImageIO", "pygltflib"}
    assert not late & loaded("import vkbloom._cli")
    code = "import vkbloom; vkbloom.Renderer, vkbloom.Pyramid"
    added = loaded(code) - loaded("import numpy, numpy.typing, dataclasses")
    assert "vkbloom._renderer.renderer" in added
    assert sorted(added & set(LATE)) == []


@pytest.mark.parametrize("name", [*vkbloom.__all__, "__version__"])
def test_every_public_name_is_there_after_the_import(name: str) -> None:
    assert getattr(vkbloom, name) is not None


def test_late_modules_are_there_at_the_first_use() -> None:
    code = "import vkbloom; vkbloom.reference.apply; vkbloom.Scene; vkbloom.testing.stability"
    assert "vkbloom.testing._moving_light" in loaded(code)
