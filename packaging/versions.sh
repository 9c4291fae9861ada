# What the wheels are made of, at exact versions; sourced by the scripts beside it.
LLVM=16
MESA=25.0.7
MESA_SHA256=592272df3cf01e85e7db300c449df5061092574d099da275d19e97ef0510f8a6
# Debian 12's source package of glslang.
GLSLANG=12.0.0
GLSLANG_SHA256=7cb45842ec1d4b6ea775d624c3d2d8ba9450aa416b0482b0cc7e4fdd399c3d75
# Debian 12's package of spirv-opt, which makes the SPIR-V of the source distribution with glslang.
SPIRV_TOOLS=2023.1
# Debian 12's source package of Python, for the headers and to run the build.
PYTHON=3.11.2
# Debian 13's source package of Python, without the GIL.
PYTHON_FREE_THREADED=3.13.5
# The newest glibc that the core, and the driver and the compiler, may need; it names their wheels.
CORE_GLIBC=2_28
DRIVER_GLIBC=2_31
# cyclonedx-python-lib, which validates the SBOMs.
CYCLONEDX=11.12.0
# Timestamps inside the archives, so that two builds give the same bytes.
SOURCE_DATE_EPOCH=1700000000
export SOURCE_DATE_EPOCH
