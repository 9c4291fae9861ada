#!/bin/sh
# Builds the core's wheel with what this system has into FOLDER/dist, from the source distribution that
# it makes there, with its SBOM where the system is Debian. The wheel is built without glslang and
# spirv-opt. What FOLDER/build/spirv and FOLDER/core/build/objects have is not compiled again.
# Arguments: FOLDER; a Python with pip; the Python that builds, with setuptools, by default the same.
set -eu
folder=$1
pip=$2
python=${3:-$pip}
. "$(dirname "$0")/versions.sh"
"$(dirname "$0")/sdist.sh" "$folder" "$python"
mkdir -p "$folder/core" "$folder/bin"
tar -x -f "$folder"/dist/vkbloom-*.tar.gz -C "$folder/core" --strip-components=1

# Links to all programs but those that make SPIR-V.
(IFS=: && for place in $PATH; do ln -s "$place"/* "$folder/bin/" 2>/dev/null || :; done)
rm -f "$folder"/bin/glslang* "$folder"/bin/spirv-*
cd "$folder/core"
PATH="$folder/bin" VKBLOOM_CFLAGS="${VKBLOOM_CFLAGS--ffile-prefix-map=$folder/core=.}" \
    VKBLOOM_LDFLAGS="-Wl,--strip-all,-Map=build/core.map" "$pip" -m pip --quiet --python "$python" wheel \
    --no-deps --no-build-isolation --wheel-dir "$folder/dist" .
core=$(cd build/lib* && ls vkbloom/_core.*.so)
test -z "$(command -v dpkg-query)" ||
    "$python" "$folder/packaging/sbom.py" add "$folder"/dist/*.whl "$core" build/core.map \
        --symbols build/objects/csrc/*/*.o --source volk - /usr/include/volk.h /usr/include/volk.c \
        --source Vulkan-Headers - /usr/include/vulkan/vulkan_core.h --properties spirv/made.json
