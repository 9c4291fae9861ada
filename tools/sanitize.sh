#!/bin/sh
# Runs the tests with a core built with the address, undefined-behaviour and leak sanitizers.
# PYTHON: an interpreter with the test requirements installed. Arguments go to pytest. Without
# arguments, it runs the tests that use the core.
set -eu

cd "$(dirname "$0")/.."
# The files left out test only Python, or the core in other processes. Large images take minutes here
# and reach no other code of the core.
if [ $# = 0 ]; then
    set -- -k "not 333x and not 1920 and not count_of_a_point"
    for name in faults frames mutations; do
        set -- "$@" "--ignore=tests/core/test_$name.py"
    done
    for name in forms hdr_images reference; do
        set -- "$@" "--ignore=tests/methods/test_$name.py"
    done
    for name in assets gltf gltf_textures scene skybox; do
        set -- "$@" "--ignore=tests/scene/test_$name.py"
    done
    for name in grid_cluster grid_order grid_reductions grid_store grid_views; do
        set -- "$@" "--ignore=tests/grid/test_$name.py"
    done
    for name in comparison guide laws plugin report; do
        set -- "$@" "--ignore=tests/plugin/test_$name.py"
    done
    for name in bench cli docs explorer io views; do
        set -- "$@" "--ignore=tests/$name"
    done
fi
folder=$PWD/build/sanitize
mkdir -p "$folder"

# A separate tree, so that the sanitized core does not replace the one in use.
rm -rf "$folder/tree" "$folder/log"
mkdir -p "$folder/tree" "$folder/log"
cp -r csrc shaders python setup.py pyproject.toml README.md tests tools examples "$folder/tree/"
rm -f "$folder"/tree/python/vkbloom/_core*.so
test -d ../shared && ln -sfn "$(cd .. && pwd)/shared" "$folder/shared"
cd "$folder/tree"
VKBLOOM_CFLAGS="-fsanitize=address,undefined -fno-sanitize-recover=undefined \
    -fno-omit-frame-pointer -g -O1 -Wall -Wextra -Werror" \
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
