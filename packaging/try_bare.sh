#!/bin/sh
# Installs the wheels of dist/ with pip in bare roots, and makes an image with three lines of Python in
# each: Debian 12 and 13, Ubuntu 24.04 where UBUNTU_MIRROR has its packages, and Debian 12 for arm64
# under QEMU. As root, with mmdebstrap, and qemu-user-static for arm64.
# Arguments: the roots, by default all. They are made once, in build/bare.
set -eu
cd "$(dirname "$0")/.."
. packaging/mirrors.sh
work=$PWD/build/bare
mkdir -p "$work"

cat >"$work/lines.py" <<'END_OF_LINES'
import numpy, vkbloom
image = vkbloom.Renderer().apply(numpy.eye(256, dtype="f")[..., None].repeat(3, 2) * 8, vkbloom.Pyramid())["final"]
vkbloom.write("bloom.png", image)
END_OF_LINES
cat >"$work/check.py" <<'END_OF_CHECK'
import sys, vkbloom
info = vkbloom.Renderer().info
assert info.bundled, info.driver_info
image = vkbloom.read("bloom.png")
assert image.shape == (256, 256, 3) and 0 < image[10, 14].max() < image[10, 10].max(), image.shape
print(f"Python {sys.version.split()[0]}, {info.driver_info}, bundled {info.bundled}: an image of {image.shape}")
END_OF_CHECK

# download VERSION MACHINE FOLDER: the wheels that pip needs there.
download() {
    version=$1 machine=$2 folder=$3
    rm -rf "$folder"
    python3 -m pip download --quiet --only-binary=:all: --python-version "$version" \
        --implementation cp --platform "manylinux2014_$machine" --platform "manylinux_2_28_$machine" \
        --platform "manylinux_2_31_$machine" --dest "$folder" --find-links dist \
        "vkbloom[software,images]==$package" pip
}

# A root of this machine's processor: try_native RELEASE MIRROR [COMPONENTS [KEYRING]]
try_native() {
    root=$work/$1
    test -d "$root" || mmdebstrap --mode=root --variant=minbase --quiet \
        ${4:+--keyring="$4"} --include=python3-venv --components="${3:-main}" "$1" "$root" "$2"
    version=$(chroot "$root" python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])')
    download "$version" x86_64 "$root/srv/wheels"
    cp "$work/lines.py" "$work/check.py" "$root/srv/"
    chroot "$root" sh -ec 'rm -rf /srv/venv && cd /srv && python3 -m venv venv
        venv/bin/pip install --quiet --no-index --find-links wheels "vkbloom[software,images]"
        venv/bin/python lines.py && venv/bin/python check.py'
}

# Packages are unpacked, and QEMU is given the program: the kernel needs no foreign binary format.
try_arm64() {
    root=$work/bookworm-arm64
    test -d "$root" || mmdebstrap --mode=root --arch=arm64 --variant=extract --quiet --skip=check/qemu \
        --include=python3,libstdc++6 bookworm "$root" "deb $mirror bookworm main"
    download 3.11 aarch64 "$root/srv/wheels"
    rm -rf "$root/srv/site"
    cd "$root/srv"
    set -- wheels/pip-*.whl
    # As in aarch64.sh.
    export VKBLOOM_CACHE_DIR="$work/cache" QEMU_CPU="${QEMU_CPU:-neoverse-n1}"
    arm() { PYTHONPATH="$root/srv/site" qemu-aarch64-static -L "$root" "$root/usr/bin/python3.11" "$@"; }
    arm "$1/pip" install --quiet --root-user-action=ignore --no-index --find-links wheels \
        --target site "vkbloom[software,images]"
    arm "$work/lines.py"
    arm "$work/check.py"
    cd - >/dev/null
}

package=$(sed -n 's/^version = "\(.*\)"/\1/p' pyproject.toml)
test $# -gt 0 || set -- bookworm trixie noble arm64
for one; do
    start=$(date +%s)
    case $one in
    noble)
        if test -z "${UBUNTU_MIRROR:-}"; then
            echo "noble: not tried, since UBUNTU_MIRROR is not set"
            continue
        fi
        try_native noble "$UBUNTU_MIRROR" main,universe "${UBUNTU_KEYRING:-}" ;;
    arm64) try_arm64 ;;
    *) try_native "$one" "$mirror" ;;
    esac
    echo "$one: $(($(date +%s) - start)) s"
done
