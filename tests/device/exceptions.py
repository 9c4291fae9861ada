"""What a driver cannot do as the tests have it, with its cause, in one table."""

from __future__ import annotations

import os
from itertools import product
from typing import Final

#: By a part of the manifest's path and by the cause: names of tests, or of all parameters of one.
EXCEPTIONS: Final[dict[str, dict[str, tuple[str, ...]]]] = {
    "swiftshader": {
        "it stores infinity in float16 images as NaN": (
            *("test_values_that_are_not_finite[fragment-float16]", "test_the_command"),
            *("test_values_that_are_not_finite[cpu-float16]", "test_specials_come_and_go[float16]"),
            *("test_values_that_are_not_finite[gpu-float16]", "NaN and infinity: pyramid, float16"),
            "test_nan_and_infinity_stay_in_final",
            "test_no_bloom_is_the_identity_of_every_half_float",
        ),
        "its images have at most 8192 pixels a side": (
            *("test_levels_of_very_wide_frames", "test_lines_that_shared_memory_cannot_hold"),
            *("test_wider_than_an_image_of_the_device", "test_in_place_or_copied_is_the_same"),
        ),
        "its pow(0, x) is 4e-18 with gamma22, and 2e-10 off with PQ": tuple(
            f"test_huge_colours[{tonemap}-{encoding}]"
            for tonemap, encoding in product(("none", "exponential", "agx"), ("gamma22", "pq"))
        ),
        "it lacks what images with linear texels need (device.c: has_linear_texels)": (
            "test_one_pass_stands_for_all_of_a_final[cpu]",
            "test_sequence_runs_shared_passes_once[cpu]",
            "test_sequence_runs_no_pass_of_other_settings[cpu]",
            "test_a_cpu_enlarges_in_strips_that_have_each_rows_taps_once",
            "test_small_images_are_convolved_in_more_stages_of_smaller_pipelines",
            *("test_which_images_are_read_in_place", "test_filters_have_variants[cpu]"),
            "test_a_complete_bloom_is_transposed_in_strips",
            "test_sweep_of_images_is_lazy_and_runs_what_changed",
        ),
        "its threads do not exist in a forked child, whose first frame waits for them": (
            *("test_a_forked_child_opens_its_own", "test_a_forked_process[close]"),
        ),
        "it opens in 600 MiB of address space": ("test_doctor_does_not_blame_the_driver",),
        "its JIT keeps a memfd open after vkDestroyDevice": ("test_points_of_every_workload",),
    }
}


def reason_against(test: str) -> str | None:
    """Return why a test cannot hold on the driver that the environment names; None: it can."""
    manifests = os.environ.get("VK_DRIVER_FILES", "")
    for driver, causes in EXCEPTIONS.items():
        for cause, tests in causes.items() if driver in manifests else ():
            if test in tests or test.partition("[")[0] in tests:
                return f"{driver}: {cause}"
    return None
