#!/bin/sh
# Runs in the build root, while it is made: fetches and unpacks the sources and compiles Python.
set -eu
. /srv/versions.sh
mkdir -p /build/fetched
cd /build/fetched
# apt's sandbox user must be able to write here.
chmod 777 .
apt-get update -qq
source_version() {
    apt-cache showsrc "$1" | sed -n 's/^Version: //p' | grep "^$2-" | sort | tail -n 1
}
apt-get source -qq --download-only "mesa=$(source_version mesa "$MESA")"
apt-get source -qq --download-only "python3.11=$(source_version python3.11 "$PYTHON")"
apt-get source -qq --download-only "glslang=$(source_version glslang "$GLSLANG")"
apt-get download -qq libvulkan-volk-dev/bookworm libvulkan-dev/bookworm
echo "$MESA_SHA256  mesa_$MESA.orig.tar.xz" | sha256sum --check --quiet
echo "$GLSLANG_SHA256  glslang_$GLSLANG.orig.tar.gz" | sha256sum --check --quiet
tar -xf "glslang_$GLSLANG.orig.tar.gz" -C /build
tar -xf "mesa_$MESA.orig.tar.xz" -C /build
tar -xf "python3.11_$PYTHON".orig.tar.?z -C /build
for package in *.deb; do
    dpkg -x "$package" /build/vulkan
done

cd "/build/Python-$PYTHON"
./configure --quiet --prefix=/opt/python >/dev/null
make -s -j2 >/build/python.log 2>&1
make -s altinstall >>/build/python.log 2>&1
# Debian 12's packages are downloaded only: one installed would bring its newer glibc.
rm /etc/apt/sources.list.d/sources.list
cd /build
rm -rf "Python-$PYTHON" fetched
apt-get clean
