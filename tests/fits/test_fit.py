"""Fits: what is found, what it costs, and what is refused."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.refusals import assert_refused, rows
from tests.srgb import decode_srgb, encode_srgb
from vkbloom import (
    DualKawase,
    FitResult,
    KinoBloom,
    Pyramid,
    Renderer,
    Separable,
    Settings,
    reference,
)
from vkbloom._fit.losses import Measure, light
from vkbloom._fit.space import VariedField, space_of

Image = NDArray[Any]


def lamps(width: int = 64, height: int = 48) -> Image:
    """A picture with light of all brightnesses, and some lamps."""
    generator = np.random.default_rng(3)
    image = generator.random((height, width, 3)) ** 8 * 4
    for _ in range(8):
        y, x = generator.integers(0, height - 4), generator.integers(0, width - 4)
        image[y : y + 3, x : x + 3] += generator.random(3) * 8
    return image.astype(np.float32)


IMAGE = lamps()


Call = Callable[..., Any]


@pytest.fixture(scope="module")
def fit(renderer: Renderer) -> Call:
    """Fit with the shared renderer."""
    return functools.partial(vkbloom.fit, renderer=renderer)


def target_of(settings: Settings, framebuffer: str = "bloom", image: Image = IMAGE) -> Image:
    return reference.apply(image, settings)[framebuffer]


def refusal(settings: Settings) -> str:
    """Return what the settings say of a knee, "" where they have one."""
    try:
        settings.replace(knee=0.5)
    except ValueError as error:
        return str(error)
    return ""


class TestFound:
    @pytest.mark.parametrize(
        ("start", "changes", "framebuffer"),
        [
            (Separable(), {"blur_scale": 2.2, "blur_strength": 0.7}, "bloom"),
            (Pyramid(levels=4), {"threshold": 1.3, "knee": 0.4, "radius": 1.2}, "bloom"),
            # Under a radius of 4.42 two radii have the same level and step at this height.
            (KinoBloom(), {"threshold": 1.1, "intensity": 0.3, "radius": 4.9}, "final"),
        ],
    )
    def test_numbers(
        self, fit: Call, start: Settings, changes: dict[str, float], framebuffer: str
    ) -> None:
        target = target_of(start.replace(**changes), framebuffer)
        found = fit(IMAGE, target, start, list(changes), framebuffer=framebuffer)
        for name, value in changes.items():
            assert getattr(found.settings, name) == pytest.approx(value, rel=0.01), found
        # Half floats of the engines' buffers.
        assert found.loss < 1e-3
        assert found.start_loss > 0.05
        assert found.settings.replace(**{name: getattr(start, name) for name in changes}) == start

    def test_numbers_by_derivatives(self, fit: Call) -> None:
        start = Separable(tonemap="exponential")
        changes = {"blur_scale": 1.7, "intensity": 0.6, "exposure": 0.4}
        target = target_of(start.replace(**changes), "final")
        found = fit(IMAGE, target, start, list(changes), gradient=True)
        assert found.loss < 1e-4
        assert found.calls <= 30
        for name, value in changes.items():
            assert getattr(found.settings, name) == pytest.approx(value, rel=0.01)

    def test_integers_flags_and_choices(self, fit: Call) -> None:
        truth = Pyramid(levels=3, firefly_filter=True, composite="screen", intensity=0.5)
        found = fit(
            IMAGE,
            target_of(truth, "final"),
            Pyramid(),
            ("levels", "firefly_filter", "composite", "intensity"),
            framebuffer="final",
        )
        assert found.settings.replace(intensity=0.5) == truth
        assert found.settings.intensity == pytest.approx(0.5, rel=1e-3)

    def test_candidates_side_by_side(self, fit: Call) -> None:
        found = fit(
            IMAGE,
            target_of(DualKawase(levels=3, threshold=0.8, knee=0.5)),
            [Separable(knee=0.5), DualKawase(levels=3, knee=0.5)],
            ["threshold"],
            max_calls=30,
            framebuffer="bloom",
        )
        assert [one.settings.method for one in found] == ["dual_kawase", "separable"]
        assert found[0].loss < 0.01 < found[1].loss
        assert found[0].settings.threshold == pytest.approx(0.8, rel=0.01)
        assert all(one.calls <= 30 for one in found)

    @pytest.mark.parametrize(
        "loss", ["l2", "log", "flip", lambda a, b: float(np.abs(a - b).mean())]
    )
    def test_losses(self, fit: Call, loss: Any) -> None:
        found = fit(
            IMAGE[:32, :32],
            target_of(Separable(blur_scale=1.7), image=IMAGE[:32, :32]),
            Separable(),
            "blur_scale",
            loss=loss,
            max_calls=60,
            framebuffer="bloom",
        )
        assert found.settings.to_dict()["blur_scale"] == pytest.approx(1.7, rel=0.01)
        assert found.loss < 1e-3 < found.start_loss
        assert found.loss_name == (loss if isinstance(loss, str) else "<lambda>")

    def test_coarse_to_fine(
        self, renderer: Renderer, fit: Call, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        image = lamps(800, 96)
        sizes = []
        truth = Separable(blur_scale=2.4, threshold=1.2, knee=0.5)
        target = target_of(truth, image=image)
        apply = renderer.apply

        def watch(image: vkbloom.Image, *arguments: Any, **options: Any) -> Any:
            sizes.append(image.shape[1])
            return apply(image, *arguments, **options)

        monkeypatch.setattr(renderer, "apply", watch)
        found = fit(
            image,
            target,
            Separable(threshold=0.5, knee=0.5),
            ["blur_scale", "threshold"],
            framebuffer="bloom",
        )
        assert found.settings.to_dict()["blur_scale"] == pytest.approx(2.4, rel=0.01)
        assert found.settings.threshold == pytest.approx(1.2, rel=0.01)
        # Reduced four times, then as it is, and the frames of the result.
        assert sizes == sorted(sizes)
        assert set(sizes) == {200, 800}
        assert len(sizes) == found.calls + 1


@pytest.fixture(scope="module")
def found(renderer: Renderer, fit: Call) -> Any:
    target = target_of(Pyramid(levels=3, radius=1.4))
    image = renderer.upload(IMAGE)
    return fit(image, target, Pyramid(levels=3), ["radius"], framebuffer="bloom")


class TestResult:
    def test_every_preset(self, renderer: Renderer) -> None:
        """Each varies those fields that it has; a field that none has is an error."""
        image = lamps(24, 16)
        given: Any = {"renderer": renderer, "max_calls": 3}
        target = target_of(vkbloom.presets["kino"], "final", image)
        found = vkbloom.fit(image, target, "all", ["threshold", "intensity"], **given)
        assert [one.loss for one in found] == sorted(one.loss for one in found)
        assert len(found) == len(vkbloom.presets)
        assert found[0].settings.method == "kino"
        varied = {one.settings.method: one.vary for one in found}
        assert varied["hdrp"] == ("intensity",)
        assert varied["kino"] == ("threshold", "intensity")

    def test_figures(self, found: FitResult, renderer: Renderer) -> None:
        assert len(found.history) == found.calls
        assert found.history[0] == found.start_loss
        assert found.history.min() == found.loss
        np.testing.assert_array_equal(
            found.frames["bloom"], renderer.apply(IMAGE, found.settings)["bloom"]
        )
        np.testing.assert_allclose(found.residual, light(found.frames["bloom"]) - found.target)
        assert np.linalg.norm(found.residual) / np.linalg.norm(found.target) == pytest.approx(
            found.loss
        )
        assert repr(found).startswith("<vkbloom.FitResult of pyramid: radius=1.4; loss ")

    def test_report(self, found: FitResult) -> None:
        page = found._repr_html_()
        assert page.count("data:image/png;base64,") == 3
        for text in ("target", "difference", "radius=1.4"):
            assert text in page
        assert "nan" not in page.partition("<code")[0].replace("nance", "")


class TestVerdict:
    """A result says whether it is good, and why not."""

    @pytest.fixture
    def truth(self) -> Image:
        return target_of(Pyramid(levels=3, threshold=1.2, knee=0.5, intensity=0.4), "final")

    def fit(self, fit: Call, target: Image, start: Settings | None = None) -> Any:
        return fit(
            IMAGE,
            target,
            start or Pyramid(levels=3, threshold=1.0, knee=0.5),
            ["threshold", "intensity"],
            max_calls=60,
        )

    def test_good(self, fit: Call, truth: Image) -> None:
        found = self.fit(fit, truth)
        assert (found.framebuffer, found.verdict, found.cause) == ("final", "good", "")
        assert repr(found).endswith("; good>")

    @pytest.mark.parametrize(
        ("change", "words"),
        [
            (lambda truth: np.minimum(truth, 1), "the target is clipped at 1 ("),
            (
                lambda truth: np.maximum(truth, 0) ** (1 / 2.2),
                "has another encoding: about the power of 0.4",
            ),
            (
                lambda _: target_of(KinoBloom(threshold=0.5, intensity=0.5, radius=2.0), "final"),
                "the method pyramid does not reach it",
            ),
        ],
    )
    def test_causes(self, fit: Call, truth: Image, change: Any, words: str) -> None:
        found = self.fit(fit, change(truth))
        assert found.verdict == "poor"
        assert words in found.cause
        assert found.cause in found._repr_html_()

    @pytest.mark.parametrize("kind", ["float32", "uint8", "decoded"])
    @pytest.mark.parametrize("change", ["equal", "another picture", "mirrored", "brighter"])
    def test_no_bloom(self, fit: Call, change: str, kind: str) -> None:
        image: Image = lamps() / 12
        target = {
            "equal": image,
            "another picture": np.roll(image, 20, axis=1)[::-1],
            "mirrored": image[:, ::-1],
            "brighter": 1.1 * image,
        }[change]
        if kind != "float32":
            image, target = (np.rint(255 * np.minimum(one, 1)) for one in (image, target))
            image, target = (one.astype(np.uint8) for one in (image, target))
        if kind == "decoded":
            image, target = (decode_srgb(one / 255).astype(np.float32) for one in (image, target))
        start = Pyramid(levels=3, threshold=0.1, knee=0.5)
        found = fit(image, target, start, ["threshold", "intensity"], max_calls=40)
        assert found.verdict == "poor"
        assert found.cause.startswith("no bloom was found"), found.cause

    def test_a_faint_bloom_is_judged_by_its_own_size(self, fit: Call) -> None:
        """A loss that is small beside the picture may be all of the bloom."""
        truth = Pyramid(levels=3, threshold=1.2, knee=0.5, intensity=0.002)
        target = target_of(truth, "final")
        wrong = fit(IMAGE, target, KinoBloom(), ["radius"], max_calls=5)
        assert wrong.verdict == "poor"
        start = Pyramid(levels=3, threshold=1.0, knee=0.5)
        found = fit(IMAGE, target, start, ["threshold", "intensity"])
        assert (found.verdict, found.explained > 0.95) == ("good", True)
        assert found.settings.intensity == pytest.approx(0.002, rel=0.05)


@pytest.mark.parametrize(("call", "error"), rows(__file__, "fits"))
def test_a_wrong_value_is_refused(renderer: Renderer, call: str, error: str) -> None:
    public: dict[str, Any] = {name: getattr(vkbloom, name) for name in vkbloom.__all__}
    names: dict[str, Any] = {
        name: functools.partial(public[name], renderer=renderer)
        for name in ("fit", "fit_pyramid", "translate")
    }
    more = {"renderer": renderer, "any_fit": vkbloom.fit, "psf": vkbloom.psf, "np": np}
    assert_refused(call, error, {**public, **names, **more, "image": IMAGE})


def test_a_black_target_has_an_absolute_loss(fit: Call) -> None:
    black = np.zeros_like(IMAGE)
    assert fit(IMAGE, black, Separable(), "loops", loss="l2", max_calls=1).calls == 1


class TestParts:
    @pytest.mark.parametrize("name", list(vkbloom.presets))
    def test_every_field_of_a_preset_has_a_place(self, name: str) -> None:
        settings = vkbloom.presets[name]
        with pytest.raises(ValueError, match="it can vary") as caught:
            space_of(settings, ["-"], {}, 9.0, 512)
        names = str(caught.value).partition("it can vary ")[2].split(", ")
        assert "intensity" in names
        for one in names:
            value = getattr(settings, one)
            if value is None or (one == "knee" and "no knee" in refusal(settings)):
                continue
            (axis,) = space_of(settings, [one], {}, 9.0, 512).axes
            assert axis.value(axis.coordinate(value)) == pytest.approx(value)
            # The ends are what the settings accept.
            ends = {settings.replace(**{one: axis.value(end)}) for end in (0.0, 1.0)}
            assert len(ends) == 2 or len(axis.choices) == 1

    def test_bounds_narrow_an_axis(self) -> None:
        (axis,) = space_of(Pyramid(), ["radius"], {"radius": (2, 3)}, 1.0, 48).axes
        assert (axis.value(0.0), axis.value(1.0)) == (2.0, 3.0)
        # The start is outside, and moves to the bound.
        assert axis.value(axis.coordinate(1.0)) == 2.0

    def test_slopes_of_losses_are_those_of_differences(self) -> None:
        generator = np.random.default_rng(0)
        a, b, direction = generator.random((3, 6, 5, 3))
        for loss in ("relative", "l2", "log"):
            measure = Measure(b, cast("Any", loss))
            ends = [measure.differences(a + step * direction) for step in (-1e-6, 1e-6)]
            assert np.linalg.norm(measure.differences(a)) == pytest.approx(measure(a))
            found = measure.scales(a) * direction
            np.testing.assert_allclose(found, (ends[1] - ends[0]) / 2e-6, atol=1e-8)
        assert Measure(b, "relative")(1.1 * b) == pytest.approx(0.1)
        assert Measure(b, "l2")(b + 0.3) == pytest.approx(0.3)
        assert Measure(b + 1, "log")(10 * (b + 1)) == pytest.approx(1.0)
        assert Measure(b, "l2")(np.full_like(b, 1e300)) == np.finfo(np.float64).max

    def test_slopes_of_axes_are_those_of_differences(self) -> None:
        for scale in (None, 0.5):
            axis = VariedField(name="threshold", kind="number", low=1.0, high=5.0, scale=scale)
            ends = [axis.value(0.3 + step) for step in (-1e-6, 1e-6)]
            assert axis.slope(0.3) == pytest.approx((ends[1] - ends[0]) / 2e-6)

    def test_targets_of_8_bits(self) -> None:
        """Framebuffers are clipped and rounded alike; saturated pixels have no difference."""
        levels = np.random.default_rng(0).integers(0, 256, (20, 30, 3)).astype(np.uint8)
        levels[:2] = 255
        decoded: Image = decode_srgb(levels / 255).astype(np.float32)
        for target, encode in ((levels, lambda one: one), (decoded, encode_srgb)):
            measure = Measure.of(target, "relative")
            values = light(target)
            assert measure(values + 1e-6) < 1e-6
            assert measure(np.where(values == 1, 7.0, values)) < 1e-6
            assert measure(np.where(levels[:, :, :1] == 255, 0.5, values)) < 1e-6
            held = 255 * encode(measure.as_target(np.full_like(values, 0.3)))
            np.testing.assert_allclose(held, np.rint(held), atol=1e-4)
            scales = measure.scales(np.full_like(values, 2.0))
            assert not scales.any()
        for other in (decoded * 1.1, decoded - 0.1, decoded**1.3):
            assert Measure.of(other, "relative").curve is None
        assert np.isfinite(Measure.of(np.ones_like(decoded), "relative")(0 * decoded))


def test_blas_computes_in_one_thread(fit: Call) -> None:
    """Threads of BLAS wait in a loop, and take the cores from a device that is a CPU."""
    threadpoolctl = pytest.importorskip("threadpoolctl")
    found: set[int] = set()

    def loss(a: Image, b: Image) -> float:
        found.update(one["num_threads"] for one in threadpoolctl.threadpool_info())
        return float(np.abs(a - b).sum())

    with threadpoolctl.threadpool_limits(2, user_api="blas"):
        target = target_of(Separable(blur_scale=2.0))
        fit(IMAGE, target, Separable(), ["blur_scale"], loss=loss, max_calls=3, framebuffer="bloom")
    assert found == {1}
