#!/bin/sh
# Builds Python 3.13 without the GIL from Debian 13's source: python.sh FOLDER [OPTION of configure...].
# The source comes by apt, into FOLDER/source; Python is installed into FOLDER. It needs a compiler and
# the headers of zlib, libffi and OpenSSL.
set -eu
mkdir -p "$1"
folder=$(cd "$1" && pwd)
shift
here=$(cd "$(dirname "$0")/../.." && pwd)
. "$here/packaging/versions.sh"
. "$here/packaging/mirrors.sh"

for header in zlib.h:zlib1g-dev ffi.h:libffi-dev openssl/ssl.h:libssl-dev; do
    echo "#include <${header%%:*}>" | ${CC:-cc} -E -x c - >/dev/null 2>&1 ||
        { echo "tools/free_threaded/python.sh needs: apt install ${header#*:}" >&2; exit 2; }
done
source=$folder/source
if test ! -f "$source/configure"; then
    # Its own lists of packages, so that those of the system stay what they are.
    apt=$folder/apt
    mkdir -p "$apt/lists/partial" "$apt/cache/archives/partial" "$source"
    echo "deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $mirror trixie main" \
        >"$apt/sources.list"
    cat >"$apt/apt.conf" <<-CONF
		Dir::Etc::sourcelist "$apt/sources.list";
		Dir::Etc::sourceparts "-";
		Dir::State::lists "$apt/lists";
		Dir::Cache "$apt/cache";
		APT::Sandbox::User "root";
	CONF
    export APT_CONFIG="$apt/apt.conf"
    apt-get update -qq
    version=$(apt-cache showsrc python3.13 | sed -n "s/^Version: //p" | grep "^$PYTHON_FREE_THREADED-" |
        sort -V | tail -n 1)
    (cd "$apt" && apt-get source -qq --download-only "python3.13=$version")
    tar -x -f "$apt/python3.13_$PYTHON_FREE_THREADED.orig.tar.xz" -C "$source" --strip-components=1
fi
mkdir -p "$folder/build"
cd "$folder/build"
test -f Makefile ||
    "$source/configure" --quiet --prefix="$folder" --disable-gil --without-ensurepip \
        --disable-test-modules "$@" >/dev/null
make -s -j "${JOBS:-1}" >"$folder/build.log" 2>&1 || { tail -n 40 "$folder/build.log"; exit 1; }
# This leaves out the compilation of all modules, which takes long under ThreadSanitizer.
make -s install PYTHON_FOR_BUILD=: >>"$folder/build.log" 2>&1
rm -rf "$folder/build"
