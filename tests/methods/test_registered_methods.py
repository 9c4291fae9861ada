"""A method that is registered at run time is everywhere where the methods of the package are."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any, ClassVar, Literal

import click
import numpy as np
import pytest
from click.testing import CliRunner

import vkbloom
from vkbloom import Settings, psf, reference
from vkbloom._cli import fields
from vkbloom._cli.program import program
from vkbloom._cli.settings_options import settings_options
from vkbloom._explorer.controls import as_code, controls, settings_from
from vkbloom._settings.fields import fields_of, number_field
from vkbloom._settings.registry import METHODS


@dataclasses.dataclass(frozen=True, kw_only=True)
class HazeBloom(Settings):
    """A share of the light, unchanged.

    Parameters
    ----------
    haze : float
        Share of the light, 0 to 3. The rest is lost.
    radius : float
        In pixels, 5 to 50.
    shape : {"round", "square"}
        Shape of the haze.
    """

    method: ClassVar[str] = "haze"

    haze: float = number_field(default=0.5, range=(0, 3), slider=(0, 1))
    # The radius of Pyramid has the range 0 to 16.
    radius: float = number_field(default=7.0, range=(5, 50), unit="pixel")
    shape: Literal["round", "square"] = "round"


def passes(source: Any, settings: HazeBloom) -> dict[str, Any]:
    return {"bloom": settings.haze * source.image}


def gain(settings: HazeBloom, size: tuple[int, int]) -> float:
    return settings.haze


@pytest.fixture
def _registered() -> Iterator[None]:
    METHODS.register(HazeBloom, SimpleNamespace(passes=passes, gain=gain))
    yield
    METHODS.unregister("haze")


@click.command(cls=fields.Command)
@settings_options
def chosen(settings: Settings) -> Settings:
    return settings


def settings_of(*arguments: str) -> Any:
    return chosen.main(list(arguments), standalone_mode=False)


def printed(*arguments: str) -> str:
    return CliRunner().invoke(program, arguments).output


@pytest.mark.usefixtures("_registered")
class TestRegistered:
    def test_the_command_line_has_its_options(self) -> None:
        expected = HazeBloom(haze=2, shape="square", threshold=1)
        options = ("--method", "haze", "--haze", "2", "--shape", "square", "--threshold", "1")
        assert settings_of(*options) == expected
        assert settings_of("--method", "haze", "--radius", "20") == HazeBloom(radius=20)
        with pytest.raises(click.UsageError, match=r"radius: 2\.0 is out of range, 5 to 50"):
            settings_of("--method", "haze", "--radius", "2")
        with pytest.raises(click.UsageError, match="has no --haze; give --method haze"):
            settings_of("--haze", "1")
        for command in ("apply", "render", "explore", "grid", "fit"):
            assert "haze" in printed(command, "--help").split()
            text = printed(command, "--method", "haze", "--help")
            assert "Settings of the method haze:\n  --haze FLOAT" in text

    def test_the_explorer_has_its_controls(self) -> None:
        method = json.loads(json.dumps(controls()))["methods"]["haze"]
        assert method["defaults"] == HazeBloom().to_dict()
        found = {field["name"]: field for field in method["fields"]}
        assert found["haze"] == {
            "name": "haze",
            "help": "Share of the light, 0 to 3",
            "kind": "number",
            "optional": False,
            "integer": False,
            "low": 0,
            "high": 3,
            "from": 0,
            "to": 1,
            "step": 0.005,
            "first": True,
        }
        assert (found["radius"]["low"], found["radius"]["high"]) == (5, 50)
        assert found["shape"]["choices"] == ["round", "square"]
        assert settings_from({"method": "haze", "haze": 1}) == HazeBloom(haze=1)

    def test_code_makes_it_again(self) -> None:
        settings = HazeBloom(haze=2.0, threshold=1.0)
        assert eval(as_code(settings), {"HazeBloom": HazeBloom}) == settings

    def test_the_reference_computes_it(self) -> None:
        image = np.full((4, 6, 3), 0.25)
        np.testing.assert_allclose(reference.apply(image, HazeBloom())["bloom"][..., :3], 0.125)
        assert reference.gain(HazeBloom(haze=2)) == 2
        np.testing.assert_allclose(psf.measured(HazeBloom(), (8, 8)).energy(), 0.5)

    def test_a_newer_class_takes_its_place(self) -> None:
        newer = dataclasses.make_dataclass(
            "Newer", [], bases=(HazeBloom,), frozen=True, kw_only=True
        )
        METHODS.register(newer)
        assert METHODS["haze"] is newer
        with pytest.raises(ValueError, match="method: 'haze' has no reference in NumPy"):
            reference.gain(newer())


def test_nothing_is_left_of_it() -> None:
    METHODS.register(HazeBloom)
    assert list(METHODS)[-1] == "haze"
    METHODS.unregister("haze")
    METHODS.unregister("haze")
    assert "haze" not in METHODS
    assert not hasattr(vkbloom, "HazeBloom")
    assert "haze" not in controls()["methods"]
    assert "haze" not in printed("apply", "--help")
    with pytest.raises(ValueError, match="method: 'haze' is not one of separable"):
        Settings.from_dict({"method": "haze"})
    with pytest.raises(click.UsageError, match="unknown method 'haze'; available: separable"):
        settings_of("--method", "haze")


def test_methods_of_the_package_are_kept() -> None:
    class Own(HazeBloom):
        method: ClassVar[str] = "pyramid"

    with pytest.raises(ValueError, match="method: 'pyramid' is a method of vkbloom"):
        METHODS.register(Own)
    METHODS.unregister("pyramid")
    assert METHODS["pyramid"] is vkbloom.Pyramid


@pytest.mark.parametrize("kind", METHODS.values())
def test_choices_are_names_of_the_core(kind: type[Settings]) -> None:
    for name, info in fields_of(kind).items():
        if name in vkbloom._core.CHOICES:
            assert set(info.choices) <= set(vkbloom._core.CHOICES[name])
