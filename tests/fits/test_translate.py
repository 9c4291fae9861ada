"""Translations of one method into another, and pyramids for point-spread functions."""

from __future__ import annotations

import functools
import importlib
import inspect
import itertools
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.exhaustive import some
from tests.kinds import METHODS, fields_of
from vkbloom import DualKawase, Pyramid, Renderer, Separable, Settings, UrpBloom, psf, reference
from vkbloom._cli import fields, search
from vkbloom._fit.space import variation_of
from vkbloom._fit.translating import describe_difference, lights

SIZE = (96, 64)
#: Of ten methods.
PRESETS = (
    *("unity_urp", "unreal", "kino", "bevy_natural", "filament", "threejs_unreal", "tutorial"),
    *("jimenez2014", "dual_kawase", "godot_4_6"),
)


Call = Callable[..., Any]


@pytest.fixture
def translated(renderer: Renderer) -> Call:
    """Translate at a small size with the shared renderer."""
    return functools.partial(vkbloom.translate, size=SIZE, renderer=renderer)


@pytest.mark.parametrize("kind", METHODS.values())
def test_every_method_says_what_its_users_turn(kind: type[Settings]) -> None:
    """Beside the intensity: without them a translation would vary that alone."""
    assert "_knobs" in vars(kind), f"{kind.__name__}: _knobs is missing"
    fields = fields_of(kind)
    for name in kind._knobs:
        assert name in fields, f"{kind.__name__}: _knobs has {name!r}, which is no field"
        assert variation_of(fields[name]), f"{kind.__name__}: {name} of _knobs cannot vary"


class TestTranslate:
    def test_method_is_translated_into_itself(self, translated: Call) -> None:
        truth = Separable(blur_scale=1.8, blur_strength=1.2, intensity=0.4, tonemap="aces")
        found = translated(truth, Separable(encoding="srgb"), max_calls=120)
        assert found.vary == ("blur_scale", "blur_strength", "intensity")
        assert found.settings.to_dict()["blur_scale"] == pytest.approx(1.8, rel=0.01)
        assert found.loss < 0.01
        # The look of `to` stays, and is not compared.
        assert (found.settings.tonemap, found.settings.encoding) == ("none", "srgb")
        assert found.frames.settings.encoding == "none"

    def test_another_method(self, translated: Call) -> None:
        found = translated(DualKawase(levels=2, intensity=0.5), Pyramid, max_calls=150)
        assert isinstance(found.settings, Pyramid)
        assert found.settings.levels <= 4
        assert found.loss < 0.5 * found.start_loss

    def test_thresholds_count(self, translated: Call) -> None:
        found = translated(
            UrpBloom(threshold=2.5, scatter=0.5),
            UrpBloom(),
            vary=["threshold", "scatter"],
            max_calls=150,
        )
        assert found.settings.threshold == pytest.approx(2.5, rel=0.01)

    def test_a_function_such_as_a_program(self, renderer: Renderer, translated: Call) -> None:
        """What it makes of the picture is the target: there is nothing else to know of it."""
        seen = []

        def bloom(image: Any) -> Any:
            seen.append(image.shape)
            return reference.apply(image, Separable(blur_scale=1.8, intensity=0.4))["final"]

        found = translated(bloom, Separable(), max_calls=120)
        assert seen == [(64, 96, 3)]
        assert found.settings.to_dict()["blur_scale"] == pytest.approx(1.8, rel=0.01)
        assert found.loss < 0.02

    def test_the_verdict_follows_the_loss(self, translated: Call) -> None:
        """Between ten presets: never that there is no bloom, and what differs in numbers."""
        losses: dict[str, list[float]] = {"good": [], "fair": [], "poor": []}
        for pair in some(itertools.permutations(PRESETS, 2), 18):
            found = translated(*pair, max_calls=6)
            assert found.words.startswith(f"{found.verdict}: "), found
            assert "no bloom" not in found.words
            assert re.search(r"halo|lights", found.cause), found.cause
            for number in re.findall(r"\d[\d.]*", found.words):
                assert len(re.sub(r"^0\.0*|\.", "", number)) <= 4, found.words
            losses[found.verdict].append(found.loss)
        # One page, since its intervals take many renders.
        assert found.words in found._repr_html_()
        assert max(losses["good"]) <= 0.1 < min(losses["fair"])
        assert max(losses["fair"]) <= 0.3 < min(losses["poor"])

    @pytest.mark.parametrize(
        ("loss", "limits"), [("relative", (0.05, 0.2)), ("l2", (0.05, 0.2)), ("flip", (0.05, 0.2))]
    )
    def test_verdicts_by_other_losses(
        self, translated: Call, loss: Any, limits: tuple[float, float]
    ) -> None:
        for found in (
            translated("kino", other, loss=loss, max_calls=calls)
            for other, calls in (("kino", 3), ("tutorial", 8), ("threejs_unreal", 1))
        ):
            target = found.target
            share = {
                "relative": found.loss,
                "l2": found.loss / np.sqrt(np.mean(target**2)),
                "flip": 1 - found.explained,
            }[loss]
            verdict = ("good", "fair", "poor")[sum(share > limit for limit in limits)]
            assert found.verdict == verdict, found

    @pytest.mark.parametrize(
        ("halo", "at_lights", "said"),
        [
            (1.3, 1 / 6, "halo within 30 %, 6 times too weak at the lights"),
            (4, 1, "halo 4 times too strong, within 0 % at the lights"),
            (1 / 2.5, -0.5, "halo 2.5 times too weak, lights within 60 %"),
            (1, 3, "halo within 0 %, 3 times too strong at the lights"),
        ],
    )
    def test_what_differs(self, halo: float, at_lights: float, said: str) -> None:
        plain = np.zeros((8, 8, 3))
        plain[4, 4] = 3
        target = plain + 0.5
        target[4, 4] = 4
        result = np.full_like(plain, 0.5 * halo)
        result[4, 4] = 3 + at_lights
        assert describe_difference(target, result, plain) == said

    def test_the_usual_size_is_the_same_everywhere(self) -> None:
        (option,) = (one for one in search.translate.params if one.name == "size")
        usual = inspect.signature(vkbloom.translate).parameters["size"].default
        assert fields.SIZE.convert(str(option.default), None, None) == usual == (640, 360)

    def test_picture(self) -> None:
        image = lights((320, 180))
        assert sorted(set(image.ravel().tolist())) == [0, 0.5, 1.5, 6, 40]
        assert [int((image[..., 0] == value).sum()) for value in (0.5, 40)] == [36, 36]
        assert int((lights((1920, 1080))[..., 0] == 6).sum()) == 36**2


class TestPyramid:
    @pytest.mark.parametrize("loss", ["relative", "log"])
    def test_weights_are_found_again(self, renderer: Renderer, loss: Any) -> None:
        truth = Pyramid(levels=4, level_weights=(0.5, 0.0, 0.3, 0.1), format="rgba32float")
        spread = psf.measured(truth, size=(96, 96))
        found = vkbloom.fit_pyramid(spread, 4, size=(96, 96), loss=loss, renderer=renderer)
        np.testing.assert_allclose(
            found.settings.to_dict()["level_weights"], (0.5, 0, 0.3, 0.1), atol=1e-4
        )
        assert found.loss < 1e-3 < found.start_loss
        assert (found.calls, found.framebuffer) == (6, "bloom")
        assert "level_weights=" in repr(found)
        assert found._repr_html_().count("data:image/png") == 3

    def test_a_share_that_stays(self, renderer: Renderer) -> None:
        """The picture with its bloom is the convolution, of any image."""
        found = vkbloom.fit_pyramid(
            psf.spencer(),
            5,
            size=(96, 96),
            direct=True,
            loss="log",
            pixels_per_degree=20,
            renderer=renderer,
        )
        settings = found.settings
        assert settings.composite == "mix"
        assert 0 < settings.intensity < 1
        assert found.loss < 0.05
        image = np.zeros((96, 96, 3))
        image[48, 48] = 1
        final = reference.apply(image, settings)["final"]
        np.testing.assert_allclose(final, found.target + found.residual, atol=1e-5)

    def test_more_levels_are_never_worse(self, renderer: Renderer) -> None:
        losses = [
            vkbloom.fit_pyramid(psf.harvey_shack(), n, size=(96, 96), renderer=renderer).loss
            for n in (1, 3, 5)
        ]
        assert losses[0] > losses[1] > losses[2]


# Fits of two 8-bit screenshots: the settings of a bloom, or that there is none.


pytest.importorskip("skimage.data")
pytest.importorskip("PIL.Image")
pairs: Any = importlib.import_module("tools.tables.screenshots")


@pytest.mark.parametrize("bloom", some(pairs.BLOOMS, 2), ids=lambda one: "-".join(one[:2]))
def test_settings_are_found_or_the_verdict_is_poor(renderer: Renderer, bloom: Any) -> None:
    image, target = pairs.with_bloom(renderer, bloom)
    assert (target == 255).any(axis=2).mean() <= 0.05
    found = pairs.fit_preset(renderer, (image, target), bloom.preset)
    values = {name: getattr(found.settings, name) for name in ("threshold", "intensity")}
    known = {"threshold": bloom.threshold, "intensity": bloom.intensity}
    assert found.verdict == "poor" or values == pytest.approx(known, rel=0.1), found
