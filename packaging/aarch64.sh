#!/bin/sh
# Runs tests with the aarch64 wheels of dist/, driver included, under qemu-user in a Debian 13 root for
# arm64 with the validation layer, which is made once in build/aarch64. Prints the time of each file.
# Needs no foreign binary format in the kernel: packages are unpacked, and QEMU is given the program.
# As root, with mmdebstrap and qemu-user-static. Arguments: tests to run.
set -eu
cd "$(dirname "$0")/.."
. packaging/mirrors.sh
work=$PWD/build/aarch64
root=$work/root
site=$work/site

missing=
for tool in mmdebstrap:mmdebstrap qemu-aarch64-static:qemu-user-static; do
    test -n "$(command -v "${tool%%:*}")" || missing="$missing ${tool#*:}"
done
test "$(id -u)" = 0 || { echo "packaging/aarch64.sh needs to be run as root" >&2; exit 2; }
test -z "$missing" || { echo "packaging/aarch64.sh needs: apt install$missing" >&2; exit 2; }
ls dist/vkbloom-*_aarch64.whl dist/vkbloom_lavapipe-*_aarch64.whl >/dev/null

if test ! -d "$root"; then
    mmdebstrap --mode=root --arch=arm64 --variant=extract --quiet --skip=check/qemu \
        --include=python3,libvulkan1,vulkan-validationlayers trixie "$root.part" \
        "deb $mirror trixie main"
    ln -s usr/lib "$root.part/lib"
    mv "$root.part" "$root"
fi
# What Python takes for itself, so that the processes that it starts are emulated, too.
cat >"$root/usr/bin/emulated-python" <<END
#!/bin/sh
exec qemu-aarch64-static -0 "\$0" -L "$root" "$root/usr/bin/python3.13" "\$@"
END
chmod +x "$root/usr/bin/emulated-python"

install() {
    python3 -m pip install --quiet --upgrade --target "$site" --only-binary=:all: \
        --python-version 3.13 --implementation cp --platform manylinux2014_aarch64 \
        --platform manylinux_2_28_aarch64 --platform manylinux_2_31_aarch64 "$@"
}
# What the tests import comes once, the wheels of dist/ each time.
version=$(sed -n 's/^version = "\(.*\)"/\1/p' pyproject.toml)
test -d "$site" || install --find-links dist \
    "vkbloom[software,images,scenes,cli,quality,grid,fit]==$version" pytest pytest-xdist hypothesis
install --no-deps dist/*_aarch64.whl

# A processor without SVE: QEMU 7.2 runs the SVE code of NumPy's OpenBLAS wrong.
export QEMU_CPU="${QEMU_CPU:-neoverse-n1}"
failed=
for one; do
    start=$(date +%s)
    PYTHONPATH=$site VKBLOOM_CACHE_DIR=$work/cache LP_NUM_THREADS=${LP_NUM_THREADS:-1} \
        "$root/usr/bin/emulated-python" -m pytest -q -p no:cacheprovider "$one" || failed="$failed $one"
    echo "$one: $(($(date +%s) - start)) s under QEMU"
done
test -z "$failed" || { echo "failed:$failed" >&2; exit 1; }
