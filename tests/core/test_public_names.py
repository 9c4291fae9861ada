"""Public classes and functions name the module in which users find them."""

from __future__ import annotations

import inspect
import pickle
import subprocess
import sys
import typing
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.framebuffers import assert_same, make_mixed
from tests.kinds import METHODS, STAGES, fields_of
from vkbloom import psf, reference, testing

PUBLIC = [
    pytest.param(module, name, id=f"{module.__name__}.{name}")
    for module in (vkbloom, psf, reference, testing)
    for name in module.__all__
    if inspect.isclass(getattr(module, name)) or inspect.isroutine(getattr(module, name))
]


@pytest.mark.parametrize(("module", "name"), PUBLIC)
def test_a_public_name_says_where_users_find_it(module: ModuleType, name: str) -> None:
    thing = getattr(module, name)
    assert f"{thing.__module__}.{thing.__qualname__}" == f"{module.__name__}.{name}"
    assert pickle.loads(pickle.dumps(thing)) is thing
    assert Path(inspect.getsourcefile(inspect.unwrap(thing)) or "").is_relative_to(
        Path(vkbloom.__file__).parent
    )
    if isinstance(thing, type):
        assert not any(isinstance(hint, str) for hint in typing.get_type_hints(thing).values())


def test_a_class_has_its_name_without_the_package() -> None:
    """As in a worker that reads a pickle, or in a program that imports the module itself."""
    code = "from vkbloom._renderer.frames import Frames; print(Frames.__module__)"
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "vkbloom"


def fit_result() -> vkbloom.FitResult:
    frames, image = make_mixed(), np.zeros((4, 4, 3))
    return vkbloom.FitResult(
        settings=frames.settings,
        loss=0.0,
        start_loss=1.0,
        calls=1,
        history=np.zeros(1),
        framebuffer="final",
        loss_name="l2",
        vary=("intensity",),
        frames=frames,
        target=image,
        residual=image,
        plain=image,
        explained=1.0,
    )


# Reads pickles, writes them again.
AGAIN = """
import pickle, sys
objects = pickle.load(sys.stdin.buffer)
sys.stdout.buffer.write(pickle.dumps(objects))
"""


def test_objects_survive_another_process() -> None:
    records: list[Any] = [kind() for kind in METHODS.values()]
    records += [STAGES[name]() for name in STAGES if name != "dirt"]
    records += [getattr(psf, name)() for name in psf.__all__ if name in ("spencer", "fog_glow")]
    records += [vkbloom.Camera(), vkbloom.Convolution(psf.gaussian(2.0))]
    errors = [
        kind("text", "vkQueueSubmit", -4)
        for kind in vars(vkbloom._core).values()
        if isinstance(kind, type) and issubclass(kind, vkbloom.Error)
    ]
    sent: dict[str, Any] = {
        "records": records,
        "errors": errors,
        "frames": make_mixed(),
        "fit": fit_result(),
    }
    data = pickle.dumps(sent)
    assert b"vkbloom._methods" not in data
    returned = pickle.loads(
        subprocess.run(
            [sys.executable, "-c", AGAIN], input=data, stdout=subprocess.PIPE, check=True
        ).stdout
    )
    assert returned["records"] == records
    for one, error in zip(returned["errors"], errors, strict=True):
        # Dask makes exceptions of other processes so.
        assert type(error).__new__(type(error), "text").args == ("text",)
        assert (type(one), one.args, vars(one)) == (type(error), error.args, vars(error))
    assert_same(returned["frames"], sent["frames"])
    assert_same(returned["fit"].frames, sent["fit"].frames)


def test_a_users_class_keeps_its_module() -> None:
    class Mine(vkbloom.Separable):
        pass

    assert Mine.__module__ == __name__
    assert {info.owner for info in fields_of(Mine).values()} == {Mine}
