#!/bin/sh
# Cross-builds the core's wheel for aarch64 Linux into dist/, and runs tests with it under qemu-user
# in a Debian 12 root for arm64, which is made once in build/aarch64: with Debian's own lavapipe.
# Needs no foreign binary format in the kernel: packages are unpacked, and QEMU is given the program.
# Arguments: the Python that builds, with setuptools; tests to run, by default tests/core/test_frames.py.
set -eu
python=$(realpath -s "$1")
shift
cd "$(dirname "$0")/.."
. packaging/versions.sh
. packaging/mirrors.sh
work=$PWD/build/aarch64
root=$work/root

missing=
for tool in mmdebstrap:mmdebstrap aarch64-linux-gnu-gcc:gcc-aarch64-linux-gnu \
    qemu-aarch64-static:qemu-user-static glslangValidator:glslang-tools; do
    test -n "$(command -v "${tool%%:*}")" || missing="$missing ${tool#*:}"
done
test "$(id -u)" = 0 || { echo "packaging/aarch64.sh needs to be run as root" >&2; exit 2; }
test -z "$missing" || { echo "packaging/aarch64.sh needs: apt install$missing" >&2; exit 2; }

mkdir -p "$work" dist
if test ! -d "$root"; then
    mmdebstrap --mode=root --arch=arm64 --variant=extract --quiet --skip=check/qemu \
        --include=python3,libpython3.11-dev,libvulkan-volk-dev,libvulkan-dev,mesa-vulkan-drivers,libvulkan1,vulkan-validationlayers \
        bookworm "$root.part" "deb $mirror bookworm main"
    mv "$root.part" "$root"
fi

# Debian's pyconfig.h includes that of the target's architecture; libc is the cross compiler's.
rm -rf "$work/source" "$work/include" "$work/sdk"
mkdir -p "$work/source" "$work/include" "$work/sdk/include"
ln -s "$root/usr/include/aarch64-linux-gnu" "$work/include/"
for headers in volk.h volk.c vulkan vk_video; do
    ln -s "$root/usr/include/$headers" "$work/sdk/include/"
done
git ls-files -z --cached --others --exclude-standard | tar -c --null -T - | tar -x -C "$work/source"
cd "$work/source"
CC=aarch64-linux-gnu-gcc LDSHARED="aarch64-linux-gnu-gcc -shared" \
    _PYTHON_HOST_PLATFORM=linux-aarch64 VULKAN_SDK="$work/sdk" \
    VKBLOOM_CFLAGS="-I$work/include -ffile-prefix-map=$work/source=." \
    VKBLOOM_LDFLAGS="-Wl,--strip-all,-Map=build/core.map" \
    "$python" -m pip --quiet wheel --no-deps --no-build-isolation --wheel-dir dist .
core=$(ls build/lib*/vkbloom/_core.abi3.so)
glibc=$(aarch64-linux-gnu-objdump -T "$core" | grep -o 'GLIBC_[0-9.]*' | sort -uV | tail -n 1)
platform=manylinux_$(echo "${glibc#GLIBC_}" | tr . _)_aarch64
"$python" -m wheel tags --remove --platform-tag "$platform" dist/*.whl
headers=$work/sdk/include
NM=aarch64-linux-gnu-nm "$python" packaging/sbom.py add dist/*.whl vkbloom/_core.abi3.so \
    build/core.map --symbols build/objects/csrc/*/*.o --source volk - "$headers/volk.h" \
    "$headers/volk.c" --source Vulkan-Headers - "$headers/vulkan/vulkan_core.h"
cd - >/dev/null
cp "$work"/source/dist/*.whl dist/
ls "$work"/source/dist

# What the tests import, as wheels for aarch64.
site=$work/site
tests="vkbloom[images,cli,quality,grid,fit] pytest pytest-xdist hypothesis"
# shellcheck disable=SC2086  # several requirements
"$python" -m pip install --quiet --upgrade --target "$site" --only-binary=:all: \
    --find-links "$work/source/dist" --python-version 3.11 --implementation cp \
    --platform manylinux2014_aarch64 --platform manylinux_2_28_aarch64 --platform "$platform" $tests
test $# -gt 0 || set -- tests/core/test_frames.py
cd "$work/source"
start=$(date +%s)
PYTHONPATH=$site VKBLOOM_CACHE_DIR=$work/cache LP_NUM_THREADS=2 \
    VK_DRIVER_FILES=$root/usr/share/vulkan/icd.d/lvp_icd.aarch64.json \
    qemu-aarch64-static -L "$root" "$root/usr/bin/python3.11" -m pytest -q -p no:cacheprovider "$@"
echo "tests under QEMU in $(($(date +%s) - start)) s"
