#!/bin/sh
# Builds the core's wheel with what this system has into FOLDER/dist, from a copy of the working tree in
# FOLDER, with its SBOM where the system is Debian. What FOLDER/build has is not compiled again.
# Arguments: FOLDER; a Python with pip; the Python that builds, with setuptools, by default the same.
set -eu
folder=$1
pip=$2
python=${3:-$pip}
. "$(dirname "$0")/versions.sh"
git ls-files -z --cached --others --exclude-standard | tar -c --null -T - | tar -x -C "$folder"
cd "$folder"
VKBLOOM_CFLAGS="${VKBLOOM_CFLAGS--ffile-prefix-map=$folder=.}" \
    VKBLOOM_LDFLAGS="-Wl,--strip-all,-Map=build/core.map" "$pip" -m pip --quiet --python "$python" wheel \
    --no-deps --no-build-isolation --wheel-dir dist .
core=$(cd build/lib* && ls vkbloom/_core.*.so)
test -z "$(command -v dpkg-query)" ||
    "$python" packaging/sbom.py add dist/*.whl "$core" build/core.map \
        --symbols build/objects/csrc/*/*.o --source volk - /usr/include/volk.h /usr/include/volk.c \
        --source Vulkan-Headers - /usr/include/vulkan/vulkan_core.h
