#!/bin/sh
# Runs in the build root: builds glslang's program, and its wheel. It has few files and no choices
# to make, so that it needs no CMake. Arguments: this folder, which is in packaging/, and where to put
# the wheel. BUILD: the folder that has glslang's source and gets all that is built. MACHINE: which one
# the wheel is for.
set -eu
package=$1
wheels=$2
. /srv/versions.sh
. "$package/../machine.sh"
build=${BUILD:-/build}
source=$build/glslang-$GLSLANG
objects=$build/glslang
python=/opt/python/bin/python3.11

mkdir -p "$objects/include/glslang"
cd "$source"
"$python" build_info.py . -i build_info.h.tmpl -o "$objects/include/glslang/build_info.h"
"$python" gen_extension_headers.py -i glslang/ExtensionHeaders \
    -o "$objects/include/glslang/glsl_intrinsic_header.h"
ls glslang/MachineIndependent/*.cpp glslang/MachineIndependent/preprocessor/*.cpp \
    glslang/GenericCodeGen/*.cpp glslang/OSDependent/Unix/ossource.cpp \
    OGLCompilersDLL/InitializeDll.cpp SPIRV/*.cpp StandAlone/StandAlone.cpp \
    StandAlone/ResourceLimits.cpp | grep -v CInterface >"$objects/sources"
# shellcheck disable=SC2016  # the inner shell's own argument
xargs -P "${JOBS:-2}" -n 1 sh -c '"$1" -std=c++11 -O2 -w -Wno-psabi -DNDEBUG -DENABLE_OPT=0 \
    -fno-exceptions -fno-rtti -ffunction-sections -fdata-sections -ffile-prefix-map="$PWD"=. -ffile-prefix-map="$0"=. \
    -I. -I"$0/include" -c "$2" -o "$0/$(echo "$2" | tr / _).o"' "$objects" "${cross}g++" <"$objects/sources"

work=$build/vkbloom-glslang
rm -rf "$work"
cp -r "$package" "$work"
cd "$work"
"${cross}g++" -static-libgcc -static-libstdc++ -Wl,--gc-sections,-Map="$objects/map" "$objects"/*.o \
    -o "$objects/glslangValidator" -lpthread
"${cross}strip" --strip-all -o vkbloom_glslang/glslangValidator "$objects/glslangValidator"
cat >vkbloom_glslang/_build.py <<END
GLSLANG = "$GLSLANG"
SHA256 = "$(sha256sum vkbloom_glslang/glslangValidator | cut -d ' ' -f 1)"
END
cp "$source/LICENSE.txt" LICENSE.glslang
cp /usr/share/doc/gcc-10-base/copyright LICENSE.gcc
"$python" -m pip --quiet wheel --no-deps --no-build-isolation --no-index --wheel-dir dist .
"$python" -m wheel tags --remove --python-tag py3 --abi-tag none \
    --platform-tag "manylinux_${DRIVER_GLIBC}_$MACHINE" dist/*.whl
"$python" "$package/../sbom.py" add dist/*.whl vkbloom_glslang/glslangValidator "$objects/map" \
    --own "$build" --symbols "$objects/glslangValidator" \
    --source glslang "$GLSLANG" "glslang_$GLSLANG.orig.tar.gz@$GLSLANG_SHA256"
mv dist/*.whl "$wheels"
