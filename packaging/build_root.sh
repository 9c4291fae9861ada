#!/bin/sh
# Makes the root that the wheels are built in: Debian 11 with glibc 2.31, GCC 10 and a static
# LLVM 16, both also for aarch64; Python 3.11 from Debian 12's source; glslang's source as Debian 12
# has it, Mesa's as Debian 13 has it; volk and the Vulkan headers of Debian 12. Only Mesa's own build
# finds glslang, and nothing spirv-opt: they would be too old for the core's shaders. As root, with
# mmdebstrap.
# DEBIAN_MIRROR, DEBIAN_SECURITY_MIRROR: by default what this system's apt uses.
# Argument: the folder to make.
set -eu
root=$1
here=$(cd "$(dirname "$0")" && pwd)
. "$here/versions.sh"
. "$here/mirrors.sh"

mkdir -p "$(dirname "$root")"
mmdebstrap --mode=root --variant=minbase --quiet \
    --aptopt='Acquire::Check-Valid-Until "false"' \
    --include=ca-certificates,g++,make,ninja-build,bison,flex,patch,pkg-config,glslang-tools,xz-utils \
    --include="llvm-$LLVM-dev,zlib1g-dev,libzstd-dev,libffi-dev,libssl-dev,g++-aarch64-linux-gnu" \
    --customize-hook='upload /usr/share/keyrings/debian-archive-keyring.gpg /etc/apt/sources.gpg' \
    --customize-hook="cat >\"\$1/etc/apt/sources.list.d/sources.list\" <<-END
		deb-src [signed-by=/etc/apt/sources.gpg] $mirror bookworm main
		deb-src [signed-by=/etc/apt/sources.gpg] $mirror trixie main
		deb [signed-by=/etc/apt/sources.gpg] $mirror bookworm main
	END" \
    --customize-hook="upload $here/fetch_sources.sh /srv/fetch_sources.sh" \
    --customize-hook="upload $here/versions.sh /srv/versions.sh" \
    --customize-hook='chroot "$1" sh /srv/fetch_sources.sh' \
    --customize-hook='mkdir "$1/opt/glslang"; mv "$1/usr/bin/glslangValidator" "$1/opt/glslang/"' \
    --customize-hook='rm "$1"/usr/bin/spirv-*' \
    bullseye "$root.part" \
    "deb $mirror bullseye main" "deb $security_mirror bullseye-security main"
mv "$root.part" "$root"
