"""The bundled driver and another LLVM in one process: llvmlite has its own, which numba uses.

packaging/try_wheels.sh runs this file alone, with both installed.
"""

from __future__ import annotations

import ctypes

import numpy as np
import pytest

from vkbloom import Pyramid, Renderer, reference

SQUARE = """
define double @square(double %x) {
    %y = fmul double %x, %x
    ret double %y
}
"""


def test_each_compiles_with_its_own_llvm() -> None:
    llvm = pytest.importorskip("llvmlite.binding")
    pytest.importorskip("vkbloom_lavapipe")
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()

    def square(value: float) -> float:
        machine = llvm.Target.from_default_triple().create_target_machine()
        engine = llvm.create_mcjit_compiler(llvm.parse_assembly(SQUARE), machine)
        engine.finalize_object()
        address = engine.get_function_address("square")
        compiled: float = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(address)(value)
        return compiled

    assert square(3) == 9
    image = np.random.default_rng(0).random((31, 47, 4), dtype=np.float32)
    # The settings of the second round are compiled after llvmlite has compiled again.
    for settings in (Pyramid(levels=3, threshold=0.5), Pyramid(levels=3, tonemap="aces")):
        with Renderer("software") as renderer:
            assert renderer.info.bundled
            final = renderer.apply(image, settings)["final"]
        np.testing.assert_allclose(final, reference.apply(image, settings)["final"], atol=1e-4)
        assert square(4) == 16
