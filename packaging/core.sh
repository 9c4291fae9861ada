#!/bin/sh
# Runs in the build root: builds the core's wheel. Arguments: the folder of the unpacked source
# distribution, and where to put the wheel. MACHINE: which one it is for.
set -eu
source=$1
wheels=$2
. /srv/versions.sh
. "$source/packaging/machine.sh"
python=/opt/python/bin/python3.11
headers=/build/vulkan/usr/include

cd "$source"
# volk is compiled in, so its licence comes along.
cp /build/vulkan/usr/share/doc/libvulkan-volk-dev/copyright LICENSE.volk
export VKBLOOM_CFLAGS="-include packaging/glibc_2_28.h -ffile-prefix-map=$source=."
export DEB_BUILD_OPTIONS="parallel=${JOBS:-2}"
export VKBLOOM_LDFLAGS=-Wl,--strip-all,-Map=build/core.map
test -z "$cross" || export CC="${cross}gcc" LDSHARED="${cross}gcc -shared" \
    _PYTHON_HOST_PLATFORM="linux-$MACHINE"
VULKAN_SDK=/build/vulkan/usr "$python" -m pip --quiet wheel \
    --no-deps --no-build-isolation --no-index --wheel-dir dist .
"$python" -m wheel tags --remove --platform-tag "manylinux_${CORE_GLIBC}_$MACHINE" dist/*.whl
"$python" packaging/sbom.py add dist/*.whl vkbloom/_core.abi3.so build/core.map \
    --symbols build/objects/csrc/*/*.o --source volk - "$headers/volk.h" "$headers/volk.c" \
    --source Vulkan-Headers - "$headers/vulkan/vulkan_core.h" --properties spirv/made.json
mv dist/*.whl "$wheels"
