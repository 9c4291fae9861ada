#!/bin/sh
# Makes all calls of the core in 16 threads under Python 3.13 without the GIL: run.sh [CALLS [TSAN_CALLS]]
# (10000 and 400), the second number under ThreadSanitizer, 0: not at all. Before them it makes first
# calls in 32 threads, in 50 processes each. Builds both Pythons first, in
# build/free_threaded, and there the wheel cp313t. PYTHON: an interpreter with pip 24 or later.
set -eu
cd "$(dirname "$0")/../.."
PYTHON=$(realpath -s "${PYTHON:-python3}")
folder=$PWD/build/free_threaded
calls=${1:-10000}
tsan_calls=${2:-400}
export PYTHONDONTWRITEBYTECODE=1

test -x "$folder/plain/bin/python3.13t" || tools/free_threaded/python.sh "$folder/plain"
test -d "$folder/venv" || "$folder/plain/bin/python3.13t" -m venv --without-pip "$folder/venv"
"$PYTHON" -m pip --python "$folder/venv/bin/python" install --quiet --only-binary=:all: \
    "numpy >= 2.2, < 2.5" "lazy_loader >= 0.4" pytest hypothesis "setuptools >= 77" wheel
rm -rf "$folder/package"
mkdir -p "$folder/package/build"
test ! -d build/spirv || cp -rp build/spirv "$folder/package/build/"
packaging/core_wheel.sh "$folder/package" "$PYTHON" "$folder/venv/bin/python"
"$PYTHON" packaging/sbom.py check "$folder"/package/dist/*.whl
"$PYTHON" -m pip --python "$folder/venv/bin/python" install --quiet --no-deps --force-reinstall \
    "$folder"/package/dist/*.whl
VKBLOOM_EXHAUSTIVE=1 "$folder/venv/bin/python" -m pytest -q -p no:cacheprovider tests/core/test_threads.py
"$folder/venv/bin/python" -m tests.core.all_calls "$calls"
test "$tsan_calls" != 0 || exit 0

if test ! -x "$folder/tsan/bin/python3.13t"; then
    mkdir -p "$folder/tsan"
    cp -r "$folder/plain/source" "$folder/tsan/"
    CFLAGS="-O1 -g" tools/free_threaded/python.sh "$folder/tsan" --with-thread-sanitizer
fi
# The same packages, but for the core.
site=$folder/venv/lib/python3.13t/site-packages
rm -rf "$folder/tsan/package"
mkdir -p "$folder/tsan/package"
cp -r "$site/vkbloom" "$folder/tsan/package/"
rm "$folder"/tsan/package/vkbloom/_core.*.so
VKBLOOM_CFLAGS="-fsanitize=thread -fno-omit-frame-pointer -g -O1" VKBLOOM_LDFLAGS=-fsanitize=thread \
    "$folder/venv/bin/python" setup.py --quiet build_ext \
    --build-temp "$folder/tsan/temp" --build-lib "$folder/tsan/package"
cat tools/threads/threads.supp tools/free_threaded/tsan.supp \
    "$folder/tsan/source/Tools/tsan/suppressions_free_threading.txt" >"$folder/tsan.supp"
env TSAN_OPTIONS="suppressions=$folder/tsan.supp:exitcode=66:history_size=4" \
    PYTHONPATH="$folder/tsan/package:$site" \
    "$folder/tsan/bin/python3.13t" -m tests.core.all_calls "$tsan_calls"
echo "ThreadSanitizer found nothing"
