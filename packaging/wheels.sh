#!/bin/sh
# Builds the source distribution of vkbloom, and from it and packaging/ the wheels of vkbloom,
# vkbloom-lavapipe and vkbloom-glslang for x86-64 and aarch64, into dist/ with their SHA-256; each file
# twice in two folders, which must give equal files; as root on a system with mmdebstrap. The root that
# wheels are built in is made once, in build/wheels; so are Mesa and glslang, in all folders. SPIR-V is
# made here by the versions of glslang and spirv-opt in packaging/versions.sh.
# STEPS: the scripts to run, MACHINES: which ones to build for; by default all.
set -eu
cd "$(dirname "$0")/.."
work=build/wheels
root=$work/root
. packaging/versions.sh
machines=${MACHINES:-x86_64 aarch64}
steps=${STEPS:-core.sh lavapipe/build.sh glslang/build.sh}

missing=
needs() {
    test -n "$2" || missing="$missing
    $1"
}
# What it needs is said before it starts, all at once.
needs "to be run as root" "$(test "$(id -u)" != 0 || echo yes)"
needs "mmdebstrap (apt install mmdebstrap)" "$(test -d "$root" && echo yes || command -v mmdebstrap)"
needs "git (apt install git)" "$(command -v git)"
needs "dpkg's keys (apt install debian-archive-keyring)" \
    "$(ls /usr/share/keyrings/debian-archive-keyring.gpg 2>/dev/null)"
needs "pip and venv (apt install python3-pip python3-venv)" \
    "$(python3 -c 'import ensurepip, pip' 2>/dev/null && echo yes)"
needs "glslang $GLSLANG (apt install glslang-tools, on Debian 12)" \
    "$(glslangValidator --version 2>/dev/null | grep -F ":$GLSLANG")"
needs "SPIRV-Tools $SPIRV_TOOLS (apt install spirv-tools, on Debian 12)" \
    "$(spirv-opt --version 2>&1 | grep -F " v$SPIRV_TOOLS ")"
needs "7 GB of free disk in $PWD" \
    "$(test "$(df -P -k . | awk 'END { print $4 }')" -lt 7000000 || echo yes)"
needs "a new root, without spirv-opt (rm -r $work)" \
    "$(test -d "$root" && test ! -d "$root/opt/glslang" || echo yes)"
test -z "$missing" || { echo "make wheels needs:$missing" >&2; exit 2; }

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

# Both builds of a wheel are of the same files, which may change meanwhile.
test -d "$work/check" || python3 -m venv "$work/check"
python=$PWD/$work/check/bin/python
"$python" -m pip install --quiet --requirement packaging/requirements.txt \
    "cyclonedx-python-lib[json-validation]==$CYCLONEDX"
must_be_equal() {
    cmp "$1" "$2"
    echo "two builds are equal: $(sha256sum "$1" | cut -d ' ' -f 1) $(basename "$1")"
}
# The source distribution, and the wheel for all systems.
for folder in source again; do
    rm -rf "${work:?}/$folder"
    DEB_BUILD_OPTIONS="parallel=${JOBS:-2}" packaging/sdist.sh "$work/$folder" "$python"
    VKBLOOM_PURE=1 "$python" -m pip wheel --quiet --no-deps --no-build-isolation \
        --wheel-dir "$work/$folder/dist" "$work/$folder"/dist/*.tar.gz
done
for file in "$work"/source/dist/*; do
    must_be_equal "$file" "$work/again/dist/$(basename "$file")"
done
sdist=$(ls "$work"/source/dist/*.tar.gz)

# Builds for a machine in a folder of the root.
build_in() {
    rm -rf "$root$1/vkbloom" "$root$1/wheels"
    mkdir -p "$root$1/vkbloom" "$root$1/wheels"
    for source in "mesa-$MESA" "glslang-$GLSLANG"; do
        test -d "$root$1/$source" || cp -r "$root/build/$source" "$root$1/"
    done
    tar -x -f "$sdist" -C "$root$1/vkbloom" --strip-components=1
    cp -r "$work/source/packaging" "$root$1/vkbloom/"
    for step in $steps; do
        folder=$1/vkbloom
        test "$step" = core.sh || folder=$folder/packaging/$(dirname "$step")
        chroot "$root" /usr/bin/env -i PATH=/usr/bin:/bin LANG=C.UTF-8 JOBS="${JOBS:-2}" BUILD="$1" \
            MACHINE="$2" sh "$1/vkbloom/packaging/$step" "$folder" "$1/wheels"
    done
}
for machine in $machines; do
    build_in "/build/$machine" "$machine"
    build_in "/again/$machine" "$machine"
    for wheel in "$root/build/$machine"/wheels/*.whl; do
        must_be_equal "$wheel" "$root/again/$machine/wheels/$(basename "$wheel")"
    done
done
"$python" packaging/sbom.py check "$root"/build/*/wheels/*.whl

# Names that promise more than the files keep must not leave here.
check_glibc() {
    newest=$(chroot "$root" sh -c "${cross}objdump -T $2" | grep -o 'GLIBC_[0-9.]*' | sort -uV | tail -n 1)
    most=GLIBC_$(echo "$1" | tr _ .)
    echo "$2 needs $newest; at most $most"
    test "$(printf '%s\n' "$newest" "$most" | sort -V | tail -n 1)" = "$most"
}
mkdir -p dist
cp "$work"/source/dist/* dist/
for MACHINE in $machines; do
    . packaging/machine.sh
    build=/build/$MACHINE
    for step in $steps; do
        case $step in
        core.sh) check_glibc "$CORE_GLIBC" "$build/vkbloom/build/lib*/vkbloom/_core.abi3.so" ;;
        lavapipe/*)
            check_glibc "$DRIVER_GLIBC" "$build/vkbloom-lavapipe/vkbloom_lavapipe/libvulkan_lvp.so" ;;
        glslang/*)
            check_glibc "$DRIVER_GLIBC" "$build/vkbloom-glslang/vkbloom_glslang/glslangValidator" ;;
        esac
    done
    cp "$root$build"/wheels/*.whl dist/
done
(cd dist && sha256sum ./*.tar.gz ./*.whl | sed 's,\./,,' >SHA256SUMS)
ls -l dist
