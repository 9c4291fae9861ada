#!/bin/sh
# Builds the core's wheel with what this system has, from a source distribution and without glslang
# and spirv-opt, with its SBOM where the system is Debian, and renders with it in a fresh environment:
# nothing of the working tree is imported. Arguments: the Python
# that builds, with pip and setuptools; "twice": builds in a second folder, too, and compares the wheels.
set -eu
python=$(realpath -s "$1")
cd "$(dirname "$0")/.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/one/build" "$work/another/build"
# Two builds that are compared compile everything; for one, the shaders' modules and the objects that
# are there do.
if test "${2:-}" = twice; then
    unset VKBLOOM_CFLAGS
else
    export VKBLOOM_CFLAGS="${VKBLOOM_CFLAGS:-}"
    mkdir -p "$work/one/core/build"
    test ! -d build/spirv || cp -rp build/spirv "$work/one/build/"
    test ! -d build/objects || cp -rp build/objects "$work/one/core/build/"
fi
packaging/core_wheel.sh "$work/one" "$python"
if test "${2:-}" = twice; then
    packaging/core_wheel.sh "$work/another" "$python"
    cmp "$work"/one/dist/*.whl "$work"/another/dist/*.whl
    echo "two builds are equal: $(sha256sum "$work"/one/dist/*.whl | cut -d ' ' -f 1)"
fi
# (A pip of its own takes most of the time of a new environment.)
"$python" -m venv --without-pip "$work/venv"
"$python" -m pip --python "$work/venv/bin/python" install --quiet --no-compile \
    "$work"/one/dist/vkbloom-*.whl
cd "$work"
VKBLOOM_CACHE_DIR="$work/cache" venv/bin/python - <<END
import numpy as np
import vkbloom

image = np.random.default_rng(0).random((37, 53, 4), dtype=np.float32)
settings = vkbloom.Pyramid(threshold=0.5)
with vkbloom.Renderer("software") as renderer:
    bloom = renderer.apply(image, settings)["bloom"]
expected = vkbloom.reference.apply(image, settings)["bloom"]
assert "$work" in vkbloom.__file__, vkbloom.__file__
assert np.abs(bloom - expected).max() < 1e-4
print("the core's wheel renders in a fresh environment")
END
