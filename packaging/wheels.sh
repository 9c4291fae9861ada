#!/bin/sh
# Builds the wheels of vkbloom, vkbloom-lavapipe and vkbloom-glslang into dist/, as root on a system with mmdebstrap.
# The root that they are built in is made once, in build/wheels; so is Mesa.
set -eu
cd "$(dirname "$0")/.."
work=build/wheels
root=$work/root
. packaging/versions.sh

test -d "$root" || packaging/build_root.sh "$root"
cp packaging/versions.sh "$root/srv/"

# PyPI is asked here, so the root needs neither certificates nor the network.
rm -rf "$root/srv/pypi"
python3 -m pip download --quiet --no-deps --dest "$root/srv/pypi" --only-binary=:all: \
    --python-version 3.11 --implementation cp --abi cp311 --abi abi3 --abi none \
    --platform manylinux2014_x86_64 --platform manylinux_2_28_x86_64 \
    --requirement packaging/requirements.txt
# pip's wheel can be run as it is: Debian's source of Python comes without it.
chroot "$root" sh -c 'set -- /srv/pypi/pip-*.whl
    /opt/python/bin/python3.11 "$1/pip" install --quiet --no-index --no-deps \
        --root-user-action=ignore --upgrade /srv/pypi/*.whl'

rm -rf "$root/build/vkbloom" "$root/build/wheels"
mkdir -p "$root/build/vkbloom" "$root/build/wheels" dist
git ls-files -z --cached --others --exclude-standard | tar -c --null -T - | tar -x -C "$root/build/vkbloom"
for step in core.sh lavapipe/build.sh glslang/build.sh; do
    folder=/build/vkbloom
    test "$step" = core.sh || folder=$folder/packaging/$(dirname "$step")
    chroot "$root" /usr/bin/env -i PATH=/usr/bin:/bin LANG=C.UTF-8 JOBS="${JOBS:-2}" \
        sh "/build/vkbloom/packaging/$step" "$folder" /build/wheels
done
# Names that promise more than the files keep must not leave here.
check_glibc() {
    newest=$(chroot "$root" sh -c "objdump -T $2" | grep -o 'GLIBC_[0-9.]*' | sort -uV | tail -n 1)
    most=GLIBC_$(echo "$1" | tr _ .)
    echo "$2 needs $newest; at most $most"
    test "$(printf '%s\n' "$newest" "$most" | sort -V | tail -n 1)" = "$most"
}
check_glibc "$CORE_GLIBC" '/build/vkbloom/build/lib*/vkbloom/_core.abi3.so'
check_glibc "$DRIVER_GLIBC" /build/vkbloom-lavapipe/vkbloom_lavapipe/libvulkan_lvp.so
check_glibc "$DRIVER_GLIBC" /build/vkbloom-glslang/vkbloom_glslang/glslangValidator
cp "$root"/build/wheels/*.whl dist/
ls -l dist
