#!/bin/sh
# Tries the wheels of dist/ in a fresh root of a Debian release without Vulkan, compiler or X: an
# unprivileged user installs them, and renders. As root, with mmdebstrap; the release's own Python
# must be 3.11 or later, or PYTHON_FROM a root whose /opt/python is taken (bullseye).
# INCLUDE: further packages of the root, such as libvulkan1,vulkan-validationlayers.
# Arguments: the release (bullseye, bookworm, trixie), and the root's folder.
set -eu
release=$1
root=$2
cd "$(dirname "$0")/.."
. packaging/mirrors.sh

packages=python3,python3-venv
test -z "${PYTHON_FROM:-}" || packages=ca-certificates,libffi7,libssl1.1
test -d "$root" || mmdebstrap --mode=root --variant=minbase --quiet \
    --aptopt='Acquire::Check-Valid-Until "false"' --include="$packages${INCLUDE:+,$INCLUDE}" \
    "$release" "$root" "$mirror"
python=python3
if test -n "${PYTHON_FROM:-}"; then
    python=/opt/python/bin/python3.11
    cp -r "$PYTHON_FROM/opt/python" "$root/opt/"
fi
version=$(chroot "$root" "$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')

# What PyPI is asked for, beside the two wheels: NumPy, the command line, images, pytest.
wheels=$root/srv/wheels
rm -rf "$wheels" "$root/srv/llvmlite"
mkdir -p "$wheels"
download() {
    python3 -m pip download --quiet --only-binary=:all: --python-version "$version" \
        --implementation cp --platform manylinux2014_x86_64 --platform manylinux_2_28_x86_64 \
        --platform manylinux_2_31_x86_64 "$@"
}
download --dest "$wheels" --find-links dist \
    "vkbloom[software,scenes,cli,pytest]==$(sed -n 's/^version = "\(.*\)"/\1/p' pyproject.toml)" pip
# Of a test alone: another LLVM beside the driver's.
download --dest "$root/srv/llvmlite" llvmlite
echo "download: $(du -cb "$wheels"/*.whl | tail -n 1 | cut -f 1) bytes in all, of which" \
    "$(du -cb "$wheels"/vkbloom*.whl "$wheels"/numpy*.whl | tail -n 1 | cut -f 1)" \
    "for the renderer with its driver and NumPy"

chroot "$root" id bloom >/dev/null 2>&1 || chroot "$root" useradd --create-home bloom
cp packaging/try_as_user.sh tests/core/test_beside_llvm.py "$root/srv/"
chroot "$root" su - bloom -c "sh /srv/try_as_user.sh $python"
