"""The stages of glare against their reference, and what they add to the picture."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, cast

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.images import choose_given, hdr_picture, picture
from tests.tolerance import assert_close, tolerance
from vkbloom import (
    BevyBloom,
    Convolution,
    Dirt,
    FilamentBloom,
    Ghosts,
    GodotBloom,
    Halo,
    PlayCanvasBloom,
    Pyramid,
    Renderer,
    Scene,
    Separable,
    Settings,
    Streaks,
    UnrealBloom,
    glares,
    reference,
)

Image = NDArray[Any]

DIRT = np.random.default_rng(5).random((9, 12, 3))
TINTS = ((1.0, 0.5, 0.25), (0.0, 1.0, 0.0), (2.0, 0.0, 1.0))
SHORT = Streaks(directions=3, angle=20, fade=0.8, base=3, iterations=2)


class Case(NamedTuple):
    settings: Settings
    dtype: str = "float32"
    size: tuple[int, int] = (61, 47)
    given: tuple[str, ...] = ()


# Every stage and every field of it; every format; all composites; odd sizes.
CASES: dict[str, Case] = {
    "streaks": Case(Pyramid(glare=(SHORT,), threshold=0.3, knee=0.5)),
    "streaks-uint8": Case(Separable(glare=(SHORT,), threshold=0.30001), "uint8", (64, 48)),
    "streaks-float16": Case(
        Separable(glare=(SHORT,), composite="screen", intensity=0.1), "float16", (64, 48)
    ),
    "streaks-rg11b10": Case(Pyramid(glare=(SHORT,), format="rg11b10ufloat", composite="mix")),
    "streaks-large": Case(
        Pyramid(
            glare=(Streaks(directions=1, colour_shift=0.5, threshold=0.2, halvings=0, length=0.7),),
            bloom_scale=0.5,
            intensity=0.3,
            composite="mix",
        ),
        given=("mask",),
    ),
    "several": Case(
        Separable(
            glare=(SHORT, Streaks(directions=16, base=8, iterations=1, halvings=4, intensity=3)),
            bloom_size=(31, 23),
            alpha="max",
        ),
        given=("emission",),
    ),
    "alpha": Case(
        Pyramid(
            glare=(Streaks(threshold=0.1, halvings=2, iterations=2, colour_shift=0.3),),
            alpha="blur",
        )
    ),
    "ghosts": Case(
        Pyramid(
            glare=(
                Ghosts(scales=(-1, 2.5, 0.4), tints=TINTS, threshold=0.2, maximum=2, halvings=0),
            )
        )
    ),
    "ghosts-uint8": Case(
        Separable(glare=(Ghosts(aberration=0.02, falloff=25, radius=1, halvings=1),)), "uint8"
    ),
    "ghosts-float16": Case(
        Separable(glare=(Ghosts(falloff=0, vignette=0.7),), bloom_scale=0.5), "float16", (75, 32)
    ),
    "ghosts-alpha": Case(
        Pyramid(glare=(Ghosts(tints=TINTS, scales=(-2, 0, 1), threshold=0.1),), alpha="blur")
    ),
    "halo": Case(Pyramid(glare=(Halo(halvings=0, threshold=0.3, maximum=1.5),)), given=("mask",)),
    "halo-uint8": Case(
        Separable(glare=(Halo(radius=0.2, width=0.5, aberration=0.01, halvings=1),)), "uint8"
    ),
    "halo-alpha": Case(Pyramid(glare=(Halo(halvings=0),), alpha="blur"), "float32", (16, 33)),
    "all": Case(
        BevyBloom(
            glare=(SHORT, Ghosts(), Halo(), Ghosts(scales=(-1.5,), intensity=0.5)),
            threshold=0.5,
            max_mip_dimension=32,
            format="rgba32float",
        ),
        given=("mask", "emission"),
    ),
    "pyramid-scale": Case(Pyramid(glare=(SHORT,), scale_x=3, scale_y=0.5, firefly_filter=True)),
    "dirt": Case(
        Pyramid(glare=(SHORT, Dirt(image=DIRT, strength=3)), intensity=0.5), "float32", (64, 48)
    ),
    "dirt-uint8": Case(
        Separable(glare=(Dirt(image=DIRT[..., 0], mode="lerp", strength=0.7),)), "uint8"
    ),
    "dirt-alpha": Case(Pyramid(glare=(Dirt(image=DIRT), Halo()), alpha="blur"), given=("mask",)),
    "dirt-convolution": Case(
        Convolution(DIRT[:5, :3], glare=(Dirt(seed=4), Ghosts()), composite="mix")
    ),
    **{name: Case(Pyramid(threshold=0.5, glare=stages)) for name, stages in glares.items()},
    "one-pixel-flare": Case(Separable(glare=(Ghosts(), Halo(radius=0.01))), size=(1, 1)),
    "one-pixel": Case(Separable(glare=(SHORT,)), size=(1, 1)),
    "bevy": Case(
        BevyBloom(
            glare=(SHORT,), threshold=0.5, knee=0.2, max_mip_dimension=32, format="rgba32float"
        )
    ),
    "filament": Case(
        FilamentBloom(glare=(SHORT,), resolution=32, format="rgba32float"), given=("mask",)
    ),
    "godot": Case(GodotBloom(glare=(SHORT,), composite="soft_light", format="rgba32float")),
    # The mask has the size of the image, and not of the buffers.
    "godot-mix": Case(
        GodotBloom(glare=(SHORT,), composite="mix", format="rgba32float", bloom_scale=0.6),
        given=("mask",),
    ),
    # The threshold of these methods is counted otherwise in the core.
    "unreal": Case(UnrealBloom(glare=(SHORT,), threshold=0.4, format="rgba32float")),
    "playcanvas": Case(PlayCanvasBloom(glare=(SHORT,), threshold=0.4, format="rgba32float")),
    "no-bloom": Case(Pyramid(glare=(SHORT,), bloom=False)),
    "no-intensity": Case(Pyramid(glare=(SHORT,), intensity=0)),
}


def source_of(case: Case) -> Image:
    """Return a picture of four channels whose alpha is not 1."""
    width, height = case.size
    image = hdr_picture(width, height, 3, case.dtype)
    return np.concatenate([image, picture(width, height, 1, case.dtype, seed=7)], axis=2)


@pytest.mark.parametrize("name", CASES)
def test_stages(renderer: Renderer, name: str) -> None:
    """All framebuffers agree with the reference."""
    case = CASES[name]
    image = source_of(case)
    given = choose_given(case.given, image)
    frames = renderer.apply(image, case.settings, **given)
    expected = reference.apply(image, case.settings, **given)
    assert list(frames) == list(expected)
    is_coarse = case.settings.format == "rg11b10ufloat"
    for framebuffer in frames:
        if is_coarse and framebuffer not in ("glow", "streaks"):
            continue
        limit = tolerance(
            frames[framebuffer].dtype, expected[framebuffer], stages_of_8_bits=2, stages=8
        )
        assert_close(framebuffer, frames[framebuffer], expected[framebuffer], limit)


def test_change_of_glare_runs_only_dependent_passes(new_renderer: Callable[[], Renderer]) -> None:
    """A stage's intensity runs only the sum; a field of it only the stage."""
    own = new_renderer()
    image = hdr_picture(64, 48, 3, "float32")
    settings = Separable(glare=(SHORT, Streaks(directions=1, base=2, iterations=1)))
    own.apply(image, settings)
    dim = Separable(glare=(SHORT, Streaks(directions=1, base=2, iterations=1, intensity=0.5)))
    assert list(own.apply(image, dim).timings) == ["light", "final"]
    turned = Separable(glare=(SHORT, Streaks(directions=1, base=2, iterations=1, angle=90)))
    ran = list(own.apply(image, turned).timings)
    assert "streaks_1" in ran
    assert not {"streaks_0", "bloom", "glow"} & set(ran)
    assert list(own.apply(image, turned.replace(exposure=1)).timings) == ["final"]


def test_change_of_dirt_runs_only_dependent_passes(new_renderer: Callable[[], Renderer]) -> None:
    """A picture is sent to the device once; in a batch each request has its own."""
    own = new_renderer()
    image = hdr_picture(64, 48, 3, "float32")
    settings = Pyramid(levels=2, glare=(Dirt(image=DIRT),))
    own.apply(image, settings)
    weak = own.apply(image, settings.replace(**{"glare.0.strength": 0.5}))
    assert list(weak.timings) == ["dirty_light", "final"]
    sequence = [settings.replace(**{"glare.0.image": DIRT * share}) for share in (1, 0.5, 0.25)]
    for frames, one in zip(own.sweep(image, sequence), sequence, strict=True):
        np.testing.assert_allclose(
            frames["final"], reference.apply(image, one)["final"], atol=1e-4, rtol=1e-4
        )


def test_fields_of_stages() -> None:
    settings = Pyramid(glare=(Streaks(), Halo()))
    changed = settings.replace(**{"glare.1.radius": 0.2, "glare.0.fade": 0.5, "levels": 3})
    assert changed == Pyramid(levels=3, glare=(Streaks(fade=0.5), Halo(radius=0.2)))
    assert changed.value_of("glare.1.radius") == 0.2
    assert changed.value_of("levels") == 3


def test_grid(renderer: Renderer) -> None:
    image = hdr_picture(32, 24, 3, "float32")
    settings = Pyramid(levels=2, glare=(SHORT, Halo()))
    axes = {"glare.0.intensity": [0.5, 2.0], "glare.1.radius": [0.1, 0.3]}
    found = vkbloom.grid(image, settings, axes=axes, framebuffers="final", renderer=renderer)
    assert found["final"].dims[:2] == tuple(axes)
    assert found["glare.0.intensity"].attrs["description"].startswith("Factor of the stage")
    for place in ((0, 0), (1, 1)):
        at = {name: values[i] for (name, values), i in zip(axes.items(), place, strict=True)}
        expected = renderer.apply(image, settings.replace(**at))["final"]
        np.testing.assert_array_equal(found["final"].values[place], expected)


def test_the_picture_of_dirt() -> None:
    dirt = Dirt(seed=3)
    assert dirt.pixels.shape == (270, 480)
    assert 0 <= dirt.pixels.min() < 0.2
    assert 0.9 < dirt.pixels.max() <= 1
    assert (Dirt(seed=4).pixels != dirt.pixels).any()
    given = Pyramid(glare=(Dirt(image=DIRT),))
    assert given == Pyramid(glare=(Dirt(image=DIRT.tolist()),))
    assert Settings.from_json(given.to_json()) == given
    assert hash(Settings.from_json(given.to_json())) == hash(given)


def test_scenes(renderer: Renderer, scene: Scene) -> None:
    """Both shadings have glare."""
    for shading in ("forward", "deferred"):
        plain = renderer.render(scene, Pyramid(), (160, 90), shading=cast("Any", shading))
        settings = Pyramid(glare=(Streaks(directions=1, intensity=4),))
        frames = renderer.render(scene, settings, (160, 90), shading=cast("Any", shading))
        assert frames["streaks"][..., :3].max() > 0
        assert (frames["final"] != plain["final"]).any()


def test_settings() -> None:
    settings = Pyramid(glare=(SHORT, Ghosts(tints=TINTS[:1]), Halo()))
    assert settings.glare[0] == SHORT
    assert Pyramid(glare=cast("Any", "three_lensflare")).glare == glares["three_lensflare"]
    assert Ghosts.from_dict(settings.glare[1].to_dict()) == settings.glare[1]
    settings = Pyramid(glare=(SHORT,))
    assert settings == Pyramid(glare=cast("Any", [SHORT]))
    assert hash(settings) == hash(Pyramid(glare=cast("Any", SHORT.to_dict())))
    assert settings != Pyramid()
    again: Settings = Settings.from_json(settings.to_json())
    assert again == settings
    assert hash(again) == hash(settings)
    assert repr(Streaks(directions=cast("Any", np.int64(4)))).startswith("Streaks(intensity=1.0")


def test_stages_read_all_light_where_a_threshold_is_below_0(renderer: Renderer) -> None:
    """Unreal's may be: then negative light passes it, too."""
    image = 4 * np.random.default_rng(0).random((33, 41, 3), np.float32) ** 3 - 1
    settings = UnrealBloom(threshold=-0.5, glare=(Streaks(threshold=0.1),), format="rgba32float")
    expected = reference.apply(image, settings)["final"]
    found = renderer.apply(image, settings)["final"]
    assert np.allclose(found, expected, rtol=0, atol=5e-5)
