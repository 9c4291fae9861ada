#!/bin/sh
# Builds apply_hook with libplacebo 7.349 in a root of its own: build.sh FOLDER. The root has the
# packages of Debian 13, unpacked; nothing is installed. Needs apt and a C compiler.
# DEBIAN_MIRROR: by default what this system's apt uses. FOLDER/apply_hook runs the program.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
. "$here/../../packaging/mirrors.sh"
mkdir -p "$1/apt/lists/partial" "$1/apt/archives/partial"
folder=$(cd "$1" && pwd)
root=$folder/root

apt() {
    apt-get -qq -o Dir::Etc::SourceList="$folder/apt/sources.list" -o Dir::Etc::SourceParts=/dev/null \
        -o Dir::State::Lists="$folder/apt/lists" -o Dir::State::status="$folder/apt/status" \
        -o Dir::Cache::Archives="$folder/apt/archives" -o Dir::Cache::pkgcache= \
        -o Dir::Cache::srcpkgcache= -o APT::Architecture=amd64 -o APT::Sandbox::User=root \
        -o Debug::NoLocking=1 "$@"
}
keyring=/usr/share/keyrings/debian-archive-keyring.gpg
echo "deb [signed-by=$keyring] $mirror trixie main" >"$folder/apt/sources.list"
: >"$folder/apt/status"
apt update
apt -y --no-install-recommends --download-only install libplacebo-dev mesa-vulkan-drivers libc6-dev

rm -rf "$root"
mkdir -p "$root"
for package in "$folder"/apt/archives/*.deb; do
    dpkg -x "$package" "$root"
done
# The packages' files are below /usr; the linker's scripts name /lib.
for name in lib lib64; do
    test -e "$root/$name" || ln -s "usr/$name" "$root/$name"
done

libraries=$root/usr/lib/x86_64-linux-gnu
${CC:-cc} -std=c11 -O2 -Wall -Wextra -Werror --sysroot="$root" "$here/apply_hook.c" \
    -o "$folder/apply_hook.elf" -L"$libraries" -lplacebo -Wl,-rpath-link,"$libraries"
cat >"$folder/apply_hook" <<END
#!/bin/sh
export VK_DRIVER_FILES="$root/usr/share/vulkan/icd.d/lvp_icd.json" VK_LOADER_LAYERS_DISABLE='~all~'
exec "$root/lib64/ld-linux-x86-64.so.2" --library-path "$libraries" "$folder/apply_hook.elf" "\$@"
END
chmod +x "$folder/apply_hook"
