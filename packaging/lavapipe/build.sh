#!/bin/sh
# Runs in the build root: builds Mesa's lavapipe alone, with LLVM inside, and its wheel.
# Arguments: this folder, which is in packaging/, and where to put the wheel. BUILD: the folder that
# has Mesa's source and gets all that is built. MACHINE: which one the wheel is for.
set -eu
package=$1
wheels=$2
build=${BUILD:-/build}
. /srv/versions.sh
. "$package/../machine.sh"
source=$build/mesa-$MESA
python=/opt/python/bin/python3.11

cd "$source"
test -f .patched || patch --quiet --strip=1 <"$package/mesa.patch"
touch .patched
llvm=/usr/lib/llvm-$LLVM
cat >"$build/native.ini" <<END
[binaries]
llvm-config = '$llvm/bin/llvm-config'
python = '$python'
glslangValidator = '/opt/glslang/glslangValidator'
END
set -- --native-file "$build/native.ini"
if test -n "$cross"; then
    # This machine's llvm-config of the same version, with the paths and the target of the other one.
    cat >"$build/llvm-config" <<END
#!/bin/sh
for one; do
    shift
    test "\$one" != native || one=$MACHINE
    set -- "\$@" "\$one"
done
$llvm/bin/llvm-config "\$@" | sed 's,$llvm,$sysroot$llvm,g; s,[^ ]*/libz3.so,,'
END
    chmod +x "$build/llvm-config"
    cat >"$build/cross.ini" <<END
[binaries]
c = '${cross}gcc'
cpp = '${cross}g++'
ar = '${cross}ar'
strip = '${cross}strip'
llvm-config = '$build/llvm-config'
python = '$python'
[host_machine]
system = 'linux'
cpu_family = '$MACHINE'
cpu = '$MACHINE'
endian = 'little'
END
    set -- "$@" --cross-file "$build/cross.ini"
fi
export PATH="/opt/python/bin:$PATH"
# What LLVM asks the linker for, so that none of it is a shared library: the linker looks here first.
# LLVM reads no XML and asks no solver here. (Links, so that the SBOM finds the packages.)
libraries=$sysroot$llvm/lib
ln -sf "$sysroot/usr/lib/$MACHINE-linux-gnu/libz.a" "$sysroot/usr/lib/$MACHINE-linux-gnu/libzstd.a" \
    "$libraries/"
mkdir -p "$build/stubs"
"${cross}gcc" -O2 -fPIC -c "$package/no_terminal.c" -o "$build/stubs/no_terminal.o"
rm -f "$build"/stubs/*.a
ar rcD "$build/stubs/libtinfo.a" "$build/stubs/no_terminal.o"
ar rcD "$build/stubs/libxml2.a"
ln -sf "$build/stubs/libtinfo.a" "$build/stubs/libxml2.a" "$libraries/"
cp "$package/driver.sym" "$build/"

# No window system, no DRM, no cache on disk, nothing found by chance: one library that needs libc.
# No absolute path of a source is in it.
flags="-ffunction-sections -fdata-sections -ffile-prefix-map=$build=."
test -f "$build/mesa/build.ninja" || "$python" -m mesonbuild.mesonmain setup "$build/mesa" \
    "$@" --buildtype=release --auto-features=disabled -Db_ndebug=true \
    -Dplatforms= -Dvulkan-drivers=swrast -Dgallium-drivers=llvmpipe \
    -Dllvm=enabled -Dshared-llvm=disabled \
    -Dopengl=false -Dgles1=disabled -Dgles2=disabled -Dglx=disabled -Degl=disabled -Dgbm=disabled \
    -Dshader-cache=disabled -Dxmlconfig=disabled -Dzstd=disabled -Dzlib=disabled -Dexpat=disabled \
    -Dvideo-codecs= -Dbuild-tests=false \
    -Dc_args="$flags" -Dcpp_args="$flags" \
    -Dc_link_args='-static-libgcc -Wl,--gc-sections,--as-needed' \
    -Dcpp_link_args="-static-libgcc -static-libstdc++ -Wl,--gc-sections,--as-needed,--version-script=$build/driver.sym,-Map=$build/driver.map" \
    >"$build/mesa-setup.log"
library=src/gallium/targets/lavapipe/libvulkan_lvp.so
# Of all that is linked, the map of the driver must be the last.
rm -f "$build/mesa/$library"
ninja -C "$build/mesa" -j "${JOBS:-2}" "$library" >"$build/mesa-build.log" ||
    { tail -n 40 "$build/mesa-build.log"; exit 1; }

work=$build/vkbloom-lavapipe
rm -rf "$work"
cp -r "$package" "$work"
cd "$work"
cp "$build/mesa/$library" vkbloom_lavapipe/
"${cross}strip" --strip-unneeded vkbloom_lavapipe/libvulkan_lvp.so
# Without start files, so that it is of its own source alone.
mkdir vkbloom_lavapipe/loader
"${cross}gcc" -O2 -Wall -Wextra -Werror -shared -fPIC -s -nostartfiles "-ffile-prefix-map=$build=." \
    -Wl,-Bsymbolic,-soname,libvulkan.so.1,-rpath,'$ORIGIN/..' loader.c \
    vkbloom_lavapipe/libvulkan_lvp.so -o vkbloom_lavapipe/loader/libvulkan.so.1
cat >vkbloom_lavapipe/_build.py <<END
MESA = "$(cat "$source/VERSION")"
LLVM = "$($llvm/bin/llvm-config --version)"
SHA256 = "$(sha256sum vkbloom_lavapipe/libvulkan_lvp.so | cut -d ' ' -f 1)"
END
# What is linked in: Mesa, LLVM, zlib and zstd for LLVM's own use, GCC's runtime.
cp "$source/docs/license.rst" LICENSE.mesa
mkdir licenses-mesa
for name in MIT Apache-2.0 BSL-1.0 SGI-B-2.0; do
    cp "$source/licenses/$name" licenses-mesa/
done
cp "/usr/share/doc/llvm-$LLVM-dev/copyright" LICENSE.llvm
cp /usr/share/doc/zlib1g-dev/copyright LICENSE.zlib
cp /usr/share/doc/libzstd-dev/copyright LICENSE.zstd
cp /usr/share/doc/gcc-10-base/copyright LICENSE.gcc
"$python" -m pip --quiet wheel --no-deps --no-build-isolation --no-index --wheel-dir dist .
"$python" -m wheel tags --remove --python-tag py3 --abi-tag none \
    --platform-tag "manylinux_${DRIVER_GLIBC}_$MACHINE" dist/*.whl
"$python" "$package/../sbom.py" add dist/*.whl vkbloom_lavapipe/libvulkan_lvp.so \
    "$build/driver.map" --own "$build" --sysroot "$sysroot/" --symbols "$build/mesa/$library" \
    --source Mesa "$MESA" "mesa_$MESA.orig.tar.xz@$MESA_SHA256" "$package/mesa.patch"
mv dist/*.whl "$wheels"
