#!/bin/sh
# Builds the core's wheel with what this system has, with its SBOM where that is Debian, and renders
# with it in a fresh environment: nothing of the working tree is imported. Arguments: the Python
# that builds, with setuptools; "twice": builds in a second folder, too, and compares the wheels.
set -eu
python=$(realpath -s "$1")
cd "$(dirname "$0")/.."
. packaging/versions.sh
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
built() {
    mkdir "$work/$1"
    git ls-files -z --cached --others --exclude-standard | tar -c --null -T - | tar -x -C "$work/$1"
    options="-ffile-prefix-map=$work/$1=."
    # Two builds that are compared compile everything; for one, the shaders' modules and the objects
    # that are there do.
    if test -z "${2:-}"; then
        mkdir -p "$work/$1/build"
        for made in spirv objects; do
            test ! -d "build/$made" || cp -rp "build/$made" "$work/$1/build/"
        done
        options=${VKBLOOM_CFLAGS:-}
    fi
    cd "$work/$1"
    VKBLOOM_CFLAGS=$options VKBLOOM_LDFLAGS="-Wl,--strip-all,-Map=build/core.map" \
        "$python" -m pip --quiet wheel --no-deps --no-build-isolation --wheel-dir dist .
    test -z "$(command -v dpkg-query)" ||
        "$python" packaging/sbom.py add dist/*.whl vkbloom/_core.abi3.so build/core.map \
            --symbols build/objects/csrc/*/*.o --source volk - /usr/include/volk.h \
            --source Vulkan-Headers - /usr/include/vulkan/vulkan_core.h
    cd - >/dev/null
}
built one "${2:-}"
if test "${2:-}" = twice; then
    built another twice
    cmp "$work"/one/dist/*.whl "$work"/another/dist/*.whl
    echo "two builds are equal: $(sha256sum "$work"/one/dist/*.whl | cut -d ' ' -f 1)"
fi
"$python" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet "$work"/one/dist/vkbloom-*.whl
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
