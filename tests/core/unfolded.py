"""Compares pipelines whose constants the driver folds with those of the core, bit by bit.

``python -m tests.core.unfolded``, over a core built with VKBLOOM_FAULTS. Prints as JSON how many
arrays were compared, and the names of those that differ.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from typing import Any, Final, TypeAlias

import numpy as np

import vkbloom
from tests.exhaustive import EXHAUSTIVE
from tests.images import random_image
from tests.methods.test_adjoint_passes import CASES as DERIVATIVES
from tests.methods.test_matrix import CASES as FORWARDS
from tests.variants import VARIANTS, opened
from vkbloom import Renderer, Scene, Settings, _core
from vkbloom._renderer.sources import Inputs

SIZE: Final = (11, 14)
COUNT: Final = 8
#: The size of cases, by name.
SIZES: Final = {"high": (4000, 2)}
Case: TypeAlias = tuple[str, Settings, bool]


def shaders(renderer: Renderer, case: Case) -> set[tuple[str, str]]:
    """Return the shaders of a case, each with its method: constants differ between methods."""
    name, settings, backwards = case
    image = image_of(name, settings)
    if not backwards:
        passes = renderer.plan(image, settings).passes
        passes += renderer.plan(image, settings, framebuffers=("final",)).passes
        return {(settings.method, one.shader) for one in passes}
    single = settings.replace(format="rgba32float")
    plan = renderer._core.plan(Inputs(image).source((image,)), single, None, ("final",), False)
    return {(settings.method, shader) for _, shader, *_ in plan.passes}


def image_of(name: str, settings: Settings) -> Any:
    channels = 3 if settings.alpha == "keep" else 4
    return random_image(*SIZES.get(name, SIZE), channels=channels, seed=1).astype(np.float32)


def chosen(renderer: Renderer) -> list[Case]:
    """Return cases of different shaders and methods, those with the most first."""
    every: list[Case] = [
        *((name, settings, False) for name, (settings, _) in FORWARDS.items()),
        *((name, settings, True) for name, settings in DERIVATIVES.items()),
    ]
    if EXHAUSTIVE:
        return every
    # Those of the first eight are a third of all pairs of a shader and a method.
    left = {case[0] + str(case[2]): (case, shaders(renderer, case)) for case in every}
    found: list[Case] = []
    while len(found) < COUNT:
        case, covered = max(left.values(), key=lambda one: len(one[1]))
        found.append(case)
        left = {name: (one, names - covered) for name, (one, names) in left.items()}
    return found


def arrays(renderer: Renderer, cases: Iterable[Case]) -> Iterator[tuple[str, Any]]:
    for name, array in renderer.render(Scene.ufo(), None, (64, 36), time=0.2).items():
        yield f"forward frame: {name}", array
    for name, settings, backwards in cases:
        image = image_of(name, settings)
        if not backwards:
            for framebuffer, array in renderer.apply(image, settings).items():
                yield f"{name}: {framebuffer}", array
            # Another image in between, so that no result of the first call is cached.
            renderer.apply(image[::-1], settings, framebuffers=("final",))
            yield f"{name}: final alone", renderer.apply(image, settings)["final"]
            continue
        frames, pullback = vkbloom.vjp(image, settings, renderer=renderer)
        yield f"{name}: by the image", pullback({"final": 1 + frames["final"]})["image"]


def main() -> None:
    compared, different = 0, []
    for variant in VARIANTS if EXHAUSTIVE else ("auto",):
        found = []
        for by_driver in (False, True):
            _core.fold_by_driver(by_driver)
            with opened(variant, "software", validation=by_driver) as renderer:
                cases = chosen(renderer)
                found.append(dict(arrays(renderer, cases)))
        compared += len(found[0])
        different += [
            f"{variant}: {name}"
            for name, array in found[0].items()
            if not np.array_equal(array, found[1][name], equal_nan=True)
        ]
    print(json.dumps({"compared": compared, "different": different}))


if __name__ == "__main__":
    main()
