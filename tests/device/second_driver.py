"""A part of all workloads on the driver that the environment names; prints the wrong ones as JSON.

A case of 48 of the self-test and of scenes with textures, by turns with each set of variants,
under validation. The driver compiles for most of the time; `make test-devices` runs all.
"""

from __future__ import annotations

import json
from functools import partial

from tests.device.exceptions import reason_against
from tests.exhaustive import EXHAUSTIVE
from tests.images import picture
from tests.scene.parts import Texture
from tests.screens import CAMERA, panel
from tests.variants import VARIANTS, open_variant
from vkbloom import Scene
from vkbloom._doctor.cases import FRAME, Case, cases, compare_scene
from vkbloom._doctor.self_test import judge


def scenes() -> list[Case]:
    texture = Texture((picture(6, 5, 4, "float16"),))
    lamp = panel(FRAME, texture, texture, radiance=(1.0, 0.5, 2.0))
    named = {
        "textures": Scene(lamp, panel(FRAME, texture), camera=CAMERA),
        "emission": Scene(lamp, camera=CAMERA),
    }
    formats = ("rgba8unorm", "rgba16float", "rgba32float")
    return [
        Case("scenes", f"{name}, {format}", partial(compare_scene, scene, "forward", format))
        for name, scene in named.items()
        for format in formats
    ]


def some_of(every: list[Case], turn: int) -> list[Case]:
    """Return every 48th case, and those that drivers have failed.

    Derivatives divide by 0 where a driver lets them. (lavapipe leaves out products with a constant
    0.) Transforms find places by the rounding of sums, whose order a driver may change.
    """
    failed = [case for case in every if case.name.endswith("a lamp") or case.name == "45 x 77"]
    return [*every[turn :: 16 * len(VARIANTS)], *failed]


def main() -> None:
    wrong: dict[str, str] = {}
    every = [*(case for case in cases() if case.variant == "auto"), *scenes()]
    for turn, variant in enumerate(VARIANTS):
        with open_variant(variant, "software", validation=True) as renderer:
            for case in every if EXHAUSTIVE else some_of(every, turn):
                name = f"{case.group}: {case.name}"
                found = judge(case, renderer)["wrong"]
                if found and not reason_against(name):
                    wrong[f"{name}, {variant}"] = found
            about = renderer.info.name
    print(json.dumps({"adapter": about, "wrong": wrong}))


if __name__ == "__main__":
    main()
