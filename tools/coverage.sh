#!/bin/sh
# Line and branch coverage of csrc by the tests that use the core, by the fault walk, and by the walk
# over Python's allocations.
# PYTHON: an interpreter with the test requirements installed. STRIDE: walk one of this many fault
# points (8). Arguments go to pytest. Prints a table of the files, and writes the lines that were not
# reached to build/coverage/uncovered.txt.
set -eu

cd "$(dirname "$0")/.."
PYTHON=${PYTHON:-python3}
if [ $# = 0 ]; then
    set -- tests/core tests/device tests/methods tests/custom tests/scene
    for name in core/faults core/frames core/mutations methods/dither \
        methods/properties methods/reference scene/gltf scene/gltf_textures; do
        set -- "$@" "--ignore=tests/${name%/*}/test_${name#*/}.py"
    done
fi
folder=$PWD/build/coverage
rm -rf "$folder"
mkdir -p "$folder/tree"
cp -r csrc shaders python setup.py pyproject.toml README.md docs examples tests tools "$folder/tree/"
rm -f "$folder"/tree/python/vkbloom/_core*.so
test -d ../shared && ln -sfn "$(cd .. && pwd)/shared" "$folder/shared"
cd "$folder/tree"
CFLAGS=-O0 VKBLOOM_CFLAGS="-DVKBLOOM_FAULTS --coverage" VKBLOOM_LDFLAGS="--coverage" \
    "$PYTHON" setup.py --quiet build_ext --inplace

export PYTHONPATH="$PWD/python"
set +e
VKBLOOM_CACHE_DIR="" "$PYTHON" -m tests.core.fault_walk "${STRIDE:-8}" >"$folder/walk.txt"
walked=$?
VKBLOOM_CACHE_DIR="" "$PYTHON" -m tests.core.memory_walk
walked=$((walked + $?))
"$PYTHON" -m pytest -q -p no:cacheprovider -m "not slow" \
    --deselect tests/core/test_faults.py::test_released_core_has_no_fault_injection "$@"
tested=$?
set -e
"$PYTHON" tools/coverage_report.py . "$folder/uncovered.txt"
exit $((walked + tested))
