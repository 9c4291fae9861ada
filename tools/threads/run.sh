#!/bin/sh
# Runs threads.c, the core without Python, under ThreadSanitizer: run.sh [SECONDS] (60).
# PYTHON: an interpreter with setuptools.
set -eu

cd "$(dirname "$0")/../.."
PYTHON=${PYTHON:-python3}
folder=$PWD/build/threads
mkdir -p "$folder"
# Write the shaders as C, and find volk.
volk=$("$PYTHON" - <<'END'
import setuptools
setuptools.setup = lambda **_: None
import setup
setup.write_spirv(setup.processes())
print(setup.volk_folder())
END
)
sources=$(ls csrc/*/*.c | grep -v '^csrc/python/')
# Not optimized: the compiler takes most of the time.
# shellcheck disable=SC2086  # file names of this repository
${CC:-cc} -std=gnu11 -g -O0 -fno-omit-frame-pointer -Wall -Wextra -Werror -DVK_NO_PROTOTYPES \
    -fsanitize=thread -Icsrc -I. -Ibuild/spirv -I"$volk" \
    $sources build/spirv/spirv.c tools/threads/threads.c -o "$folder/threads" -lm -ldl -lpthread
exec env TSAN_OPTIONS="suppressions=$PWD/tools/threads/threads.supp:exitcode=66" \
    "$folder/threads" "${1:-60}"
