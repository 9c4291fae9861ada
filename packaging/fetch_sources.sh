#!/bin/sh
# Runs in the build root, while it is made: fetches and unpacks the sources and compiles Python.
set -eu
. /srv/versions.sh
mkdir -p /build/fetched
cd /build/fetched
# apt's sandbox user must be able to write here.
chmod 777 .
dpkg --add-architecture arm64
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

# Of arm64, only what is linked, in the versions that are installed for this machine. dpkg records it
# in a database of its own, for the SBOM.
sysroot=/opt/aarch64
mkdir -p "$sysroot/var/lib/dpkg/updates" "$sysroot/var/lib/dpkg/info" arm64
touch "$sysroot/var/lib/dpkg/status"
cd arm64
chmod 777 .
# shellcheck disable=SC2046  # three packages
apt-get download -qq $(dpkg-query -W -f '${binary:Package} ${Version}\n' \
    "llvm-$LLVM-dev" zlib1g-dev libzstd-dev | sed 's/\(:amd64\)\? /:arm64=/')
dpkg --root="$sysroot" --force-architecture --force-depends --unpack ./*.deb
dpkg --remove-architecture arm64

cd "/build/Python-$PYTHON"
./configure --quiet --prefix=/opt/python >/dev/null
make -s -j2 >/build/python.log 2>&1
make -s altinstall >>/build/python.log 2>&1
# Debian 12's packages are downloaded only: one installed would bring its newer glibc.
rm /etc/apt/sources.list.d/sources.list
cd /build
rm -rf "Python-$PYTHON" fetched
apt-get clean
