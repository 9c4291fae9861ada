"""The benchmarks by id, and the function that runs them."""

from __future__ import annotations

import importlib
import inspect
import os
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Final, NamedTuple

import vkbloom
from benchmarks.machine import describe
from benchmarks.plan import Plan
from benchmarks.results import Report, Section

__all__ = ["BENCHMARKS", "Benchmark", "run"]


class Benchmark(NamedTuple):
    """A benchmark: a module of this package with the name of its id (with _ in place of -).

    The paragraphs of the module's docstring, after the first, begin `Section.about`. Its function
    ``run(plan, section)`` adds the rest.

    - `what`: What it times.
    - `shown`: Patterns of the contenders that docs/performance.md shows; empty: all.
    """

    what: str
    shown: tuple[str, ...] = ()


#: All benchmarks by their ids.
BENCHMARKS: Final[Mapping[str, Benchmark]] = MappingProxyType(
    {
        "image": Benchmark(
            "an image's bloom, NumPy in and out, against image libraries",
            ("vkbloom", "vkbloom, the source's.*", "OpenCV", "SciPy", "scikit-image", "PyTorch"),
        ),
        "presets": Benchmark("each preset, the adapter's variant beside fragment"),
        "variants": Benchmark("each preset with and without each variant of its passes"),
        "pyramid": Benchmark("a pyramid of five levels against pygfx and a Gaussian of its spread"),
        "forward": Benchmark("the time that bloom adds to a forward frame, against fragment"),
        "requests": Benchmark("many requests with one image, against single calls"),
        "cost": Benchmark("cost against pixels, kernel length and levels"),
        "startup": Benchmark("import, renderer and first frame, in fresh processes"),
        "first-call": Benchmark("the first call of each preset, in fresh processes"),
        "memory": Benchmark("memory of a process and of its renderers"),
        "transfers": Benchmark("calls at 4K and 1080p against the bare transfers of their bytes"),
        "convolution": Benchmark("convolution with large kernels against transforms on the host"),
        "adjoint": Benchmark("derivatives of each preset by the image against the framebuffer"),
        "training": Benchmark("training steps by the wall clock, against PyTorch"),
        "image-gpu": Benchmark("an image's bloom at 4K on a GPU, against CUDA"),
        "convolution-gpu": Benchmark("convolution at 4K and 1080p on a GPU, against torch.fft"),
        "field": Benchmark("a kernel that depends on the place against optiland and photutils"),
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
