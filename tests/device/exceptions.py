"""What a driver cannot do as the tests have it, with its cause, in one table."""

from __future__ import annotations

import os
from typing import Final

_INFINITY: Final = "SwiftShader stores infinity in float16 images as NaN"
_WORDS: Final = "SwiftShader lacks what images as words need (device.c: has_words)"
_POWER: Final = "SwiftShader's pow(0, x) is 4e-18 with gamma22, and 2e-10 off with PQ"
_SIDES: Final = "SwiftShader's images have at most 8192 pixels a side"

#: By a part of the manifest's path: names of tests, or of all parameters of one.
EXCEPTIONS: Final[dict[str, dict[str, str]]] = {
    "swiftshader": {
        "test_values_that_are_not_finite[fragment-float16]": _INFINITY,
        "test_values_that_are_not_finite[cpu-float16]": _INFINITY,
        "test_values_that_are_not_finite[gpu-float16]": _INFINITY,
        "NaN and infinity: pyramid, float16": _INFINITY,
        "test_nan_and_infinity_stay_in_final": _INFINITY,
        "test_no_bloom_is_the_identity_of_every_half_float": _INFINITY,
        "test_the_command": _INFINITY,
        "test_levels_of_very_wide_frames": _SIDES,
        "test_lines_that_shared_memory_cannot_hold": _SIDES,
        **{
            f"test_huge_colours[{tonemap}-{encoding}]": _POWER
            for tonemap in ("none", "exponential", "agx")
            for encoding in ("gamma22", "pq")
        },
        "test_one_pass_stands_for_all_of_a_final[cpu]": _WORDS,
        "test_sequence_runs_shared_passes_once[cpu]": _WORDS,
        "test_sequence_runs_no_pass_of_other_settings[cpu]": _WORDS,
        "test_a_cpu_enlarges_in_strips_that_have_each_rows_taps_once": _WORDS,
        "test_small_images_are_convolved_in_more_stages_of_smaller_pipelines": _WORDS,
    }
}


def reason_against(test: str) -> str | None:
    """Return why a test cannot hold on the driver that the environment names; None: it can."""
    manifests = os.environ.get("VK_DRIVER_FILES", "")
    for driver, tests in EXCEPTIONS.items():
        if driver in manifests:
            return tests.get(test) or tests.get(test.partition("[")[0])
    return None
