# What the wheels are made of, at exact versions; sourced by the scripts beside it.
LLVM=16
MESA=25.0.7
MESA_SHA256=592272df3cf01e85e7db300c449df5061092574d099da275d19e97ef0510f8a6
# Debian 12's source package of Python, for the headers and to run the build.
PYTHON=3.11.2
# The glibc of the build root names the wheels: what they need is at most that.
PLATFORM=manylinux_2_31_x86_64
# Timestamps inside the archives, so that two builds give the same bytes.
SOURCE_DATE_EPOCH=1700000000
export SOURCE_DATE_EPOCH
