"""The benchmarks by id, and the function that runs them."""

from __future__ import annotations

import importlib
import inspect
import os
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Final

import vkbloom
from benchmarks.machine import describe
from benchmarks.plan import Plan
from benchmarks.results import Report, Section

__all__ = ["BENCHMARKS", "run"]

#: What each benchmark times, by its id. Each is a module of this package (with _ in place of -).
#: The paragraphs of its docstring, after the first, begin `Section.about`. Its function
#: ``run(plan, section)`` adds the rest.
BENCHMARKS: Final[Mapping[str, str]] = MappingProxyType(
    {
        "image": "an image's bloom, NumPy in and out, against image libraries",
        "pyramid": "a pyramid of five levels against pygfx and a Gaussian of the same spread",
        "forward": "the time that bloom adds to a forward frame, against the source's variant",
        "requests": "many requests with one image, against single calls",
        "cost": "cost against pixels, kernel length and levels",
        "startup": "import, renderer and first frame, in fresh processes",
        "convolution": "convolution with large kernels against SciPy's transforms",
        "convolution-gpu": "convolution at 4K and 1080p on a GPU, against torch.fft",
        "field": "a kernel that depends on the place against optiland and photutils",
        "adjoint": "derivatives by the image against the framebuffer and against PyTorch",
        "image-gpu": "an image's bloom at 4K on a GPU, against CUDA",
    }
)


def run(plan: Plan) -> Iterator[Report]:
    """Run the benchmarks of a plan.

    Parameters
    ----------
    plan : Plan

    Yields
    ------
    Report
        One after each benchmark, with all results so far. So nothing is lost if a later benchmark
        fails. The last report is complete.

    Raises
    ------
    ValueError
        `plan.only` names an unknown benchmark.
    AdapterNotFoundError, Error
        The adapter cannot be used.
    """
    for name in plan.only:
        if name not in BENCHMARKS:
            raise ValueError(f"only: {name!r} is not one of {', '.join(BENCHMARKS)}")
    # Otherwise OpenMP's idle threads, which torch uses, take time from the next contender. The
    # variable is read when the library is loaded.
    os.environ.setdefault("OMP_WAIT_POLICY", "passive")
    with vkbloom.Renderer(plan.adapter) as renderer:
        adapter = renderer.info
    machine = describe(plan, adapter)
    report = Report(machine, ())
    for name in plan.only or BENCHMARKS:
        plan.tell(name)
        module = importlib.import_module(f"benchmarks.{name.replace('-', '_')}")
        _, *about = (inspect.getdoc(module) or "").split("\n\n")
        section = Section(name, about=[" ".join(paragraph.split()) for paragraph in about])
        module.run(plan, section)
        # Several groups of contenders may have missed the same peer.
        section.missing = list(dict.fromkeys(section.missing))
        if plan.quick:
            # The figures of a quick run mean nothing.
            section.goals.clear()
        report = Report(machine, (*report.sections, section))
        yield report
