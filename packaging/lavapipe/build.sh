#!/bin/sh
# Runs in the build root: builds Mesa's lavapipe alone, with LLVM inside, and its wheel.
# Arguments: this folder, and where to put the wheel.
set -eu
package=$1
wheels=$2
. /srv/versions.sh
source=/build/mesa-$MESA
python=/opt/python/bin/python3.11

cd "$source"
test -f .patched || patch --quiet --strip=1 <"$package/mesa.patch"
touch .patched
cat >/build/native.ini <<END
[binaries]
llvm-config = '/usr/lib/llvm-$LLVM/bin/llvm-config'
python = '$python'
END
export PATH="/opt/python/bin:$PATH"
# What LLVM asks the linker for, so that none of it is a shared library: the linker looks here first.
# LLVM reads no XML and asks no solver here.
libraries=/usr/lib/llvm-$LLVM/lib
cp /usr/lib/x86_64-linux-gnu/libz.a /usr/lib/x86_64-linux-gnu/libzstd.a "$libraries/"
cc -O2 -fPIC -c "$package/no_terminal.c" -o /build/no_terminal.o
rm -f "$libraries/libtinfo.a" "$libraries/libxml2.a"
ar rcD "$libraries/libtinfo.a" /build/no_terminal.o
ar rcD "$libraries/libxml2.a"
cp "$package/driver.sym" /build/

# No window system, no DRM, no cache on disk, nothing found by chance: one library that needs libc.
test -f /build/mesa/build.ninja || "$python" -m mesonbuild.mesonmain setup /build/mesa \
    --native-file /build/native.ini --buildtype=release --auto-features=disabled -Db_ndebug=true \
    -Dplatforms= -Dvulkan-drivers=swrast -Dgallium-drivers=llvmpipe \
    -Dllvm=enabled -Dshared-llvm=disabled \
    -Dopengl=false -Dgles1=disabled -Dgles2=disabled -Dglx=disabled -Degl=disabled -Dgbm=disabled \
    -Dshader-cache=disabled -Dxmlconfig=disabled -Dzstd=disabled -Dzlib=disabled -Dexpat=disabled \
    -Dvideo-codecs= -Dbuild-tests=false \
    -Dc_args='-ffunction-sections -fdata-sections' \
    -Dcpp_args='-ffunction-sections -fdata-sections' \
    -Dc_link_args='-static-libgcc -Wl,--gc-sections,--as-needed' \
    -Dcpp_link_args='-static-libgcc -static-libstdc++ -Wl,--gc-sections,--as-needed,--version-script=/build/driver.sym' \
    >/build/mesa-setup.log
library=src/gallium/targets/lavapipe/libvulkan_lvp.so
ninja -C /build/mesa -j "${JOBS:-2}" "$library" >/build/mesa-build.log ||
    { tail -n 40 /build/mesa-build.log; exit 1; }

work=/build/vkbloom-lavapipe
rm -rf "$work"
cp -r "$package" "$work"
cd "$work"
cp "/build/mesa/$library" vkbloom_lavapipe/
strip --strip-unneeded vkbloom_lavapipe/libvulkan_lvp.so
cat >vkbloom_lavapipe/_build.py <<END
MESA = "$(cat "$source/VERSION")"
LLVM = "$(/usr/lib/llvm-$LLVM/bin/llvm-config --version)"
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
"$python" -m wheel tags --remove --python-tag py3 --abi-tag none --platform-tag "manylinux_${DRIVER_GLIBC}_x86_64" dist/*.whl
mv dist/*.whl "$wheels"
