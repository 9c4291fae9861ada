#!/bin/sh
# Makes all calls of the core in 16 threads (tests/core/all_calls.py) with a core that is built for
# ThreadSanitizer: run.sh [CALLS] (160). PYTHON: an interpreter with the test requirements.
set -eu

cd "$(dirname "$0")/../.."
PYTHON=$(realpath -s "${PYTHON:-python3}")
folder=$PWD/build/threads
rm -rf "$folder/package"
mkdir -p "$folder/package"
# A separate package, so that the sanitized core does not replace the one in use.
cp -r python/vkbloom "$folder/package/"
rm -f "$folder"/package/vkbloom/_core*.so
# (Not optimized: the compiler would take longer than that saves.)
VKBLOOM_CFLAGS="-fsanitize=thread -fno-omit-frame-pointer -g -O0" VKBLOOM_LDFLAGS=-fsanitize=thread \
    "$PYTHON" setup.py --quiet build_ext --build-temp "$folder/temp" --build-lib "$folder/package"
cat tools/threads/threads.supp tools/free_threaded/tsan.supp >"$folder/tsan.supp"
# Without randomized addresses, whose range may be larger than the sanitizer's.
env LD_PRELOAD="$(${CC:-cc} -print-file-name=libtsan.so)" \
    TSAN_OPTIONS="suppressions=$folder/tsan.supp:exitcode=66:history_size=4" \
    PYTHONPATH="$folder/package:$PWD" \
    setarch -R "$PYTHON" -m tests.core.all_calls "${1:-160}"
echo "ThreadSanitizer found nothing"
