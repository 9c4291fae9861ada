#!/bin/sh
# Runs the tests with a core built with the address, undefined-behaviour and leak sanitizers.
# PYTHON: an interpreter with the test requirements installed. Arguments go to pytest. Without
# arguments, it runs the tests that reach all of the core, in two processes.
set -eu

cd "$(dirname "$0")/.."
# A method, format or variant reaches no other code with a larger image, or where its values are
# compared with the reference: tests of these, of Python alone and of other processes are left out,
# and tests/tolerance.py compares no values. Each preset is in test_matrix.py.
if [ $# = 0 ]; then
    # In this order, the longest first: at the end both processes have work.
    set -- tests/methods/test_matrix.py tests/core/test_threads.py tests/methods/test_variants.py
    for name in plans readback interruption batches eviction adapters array_arguments array_memory \
        bundled_driver core_arguments graph refusals lifetime pipeline_cache settings; do
        set -- "$@" "tests/core/test_$name.py"
    done
    for name in apply_input dither rg11b10; do
        set -- "$@" "tests/methods/test_$name.py"
    done
    set -- "$@" tests/methods/test_custom_passes.py tests/custom/test_rendering.py
    for name in deferred render textures; do
        set -- "$@" "tests/scene/test_$name.py"
    done
    for name in apply_input.py::test_longest_sides rg11b10.py::test_every_method \
        variants.py::test_large variants.py::test_tiles[size0] variants.py::test_tiles[size2] \
        variants.py::test_the_forward_frame; do
        set -- "$@" --deselect "tests/methods/test_$name"
    done
    # First calls that only run Python.
    for name in presets glares to_xarray names; do
        set -- "$@" --deselect "tests/core/test_threads.py::test_first_calls_in_threads[$name]"
    done
    set -- "$@" -k "not count_of_a_point and not dry_run and not is_what_runs" -n 2 --dist loadfile \
        --no-loadscope-reorder
fi
folder=$PWD/build/sanitize
mkdir -p "$folder"

# A separate tree, so that the sanitized core does not replace the one in use.
rm -rf "$folder/tree" "$folder/log"
mkdir -p "$folder/tree" "$folder/log"
cp -rp csrc shaders python setup.py pyproject.toml README.md tests tools examples "$folder/tree/"
# The shaders' modules are the same ones. Those older than their sources are compiled again.
mkdir "$folder/tree/build"
test ! -d build/spirv || cp -rp build/spirv "$folder/tree/build/"
rm -f "$folder"/tree/python/vkbloom/_core*.so
test -d ../shared && ln -sfn "$(cd .. && pwd)/shared" "$folder/shared"
cd "$folder/tree"
# (Not optimized: the compiler would take longer than that saves in the tests.)
VKBLOOM_CFLAGS="-fsanitize=address,undefined -fno-sanitize-recover=undefined \
    -fno-omit-frame-pointer -g -O0 -Wall -Wextra -Werror" \
    VKBLOOM_LDFLAGS="-fsanitize=address,undefined" \
    "$PYTHON" setup.py --quiet build_ext --inplace

asan=$(${CC:-cc} -print-file-name=libasan.so)
# Preload libstdc++, since the sanitizer intercepts C++ exceptions, which Mesa's compiler throws.
stdcxx=$(${CC:-cc} -print-file-name=libstdc++.so.6)
# Python's allocator would hide leaks and report false ones. So use plain malloc, and a filter that
# searches the stacks for the core.
set +e
ASAN_OPTIONS="detect_leaks=1:exitcode=0:allocator_may_return_null=1:log_path=$folder/log/asan" \
    LSAN_OPTIONS="suppressions=$PWD/tools/leaks.supp:print_suppressions=0" \
    UBSAN_OPTIONS="print_stacktrace=1:halt_on_error=1:log_path=$folder/log/ubsan" \
    LD_PRELOAD="$asan $stdcxx" PYTHONMALLOC=malloc PYTHONPATH="$PWD/python" \
    VKBLOOM_SANITIZED=1 \
    "$PYTHON" -m pytest -p no:cacheprovider -m "not slow" "$@"
status=$?
set -e
"$PYTHON" tools/sanitizer_report.py "$folder/log"
exit $status
