#!/bin/sh
# Installs missing system packages for the build and the tests with apt. Without apt or root, it
# lists what is missing. Arguments: the groups "build" and "test".
set -eu

missing_packages=""
missing_names=""
wanted_packages=""

# need NAME PACKAGE COMMAND...: the package is missing unless the command succeeds.
need() {
    name=$1
    package=$2
    shift 2
    if ! "$@" >/dev/null 2>&1; then
        missing_packages="$missing_packages $package"
        missing_names="$missing_names
  - $name (Debian: $package)"
    fi
}

# want PACKAGE COMMAND...: the same for a package without which tests are skipped.
want() {
    package=$1
    shift
    "$@" >/dev/null 2>&1 || wanted_packages="$wanted_packages $package"
}

has_header() {
    echo "#include <$1>" | ${CC:-cc} -fsyntax-only -DVK_NO_PROTOTYPES -x c -
}

has_python_headers() {
    test -f "$(python3 -c 'import sysconfig; print(sysconfig.get_paths()["include"])')/Python.h"
}

has_loader() {
    python3 -c 'import ctypes; ctypes.CDLL("libvulkan.so.1")'
}

has_driver() {
    # The manifest of any driver, where the loader searches.
    test -n "${VK_DRIVER_FILES:-${VK_ICD_FILENAMES:-}}" && return 0
    for folder in /usr/share /usr/local/share /etc; do
        ls "$folder"/vulkan/icd.d/*.json && return 0
    done
    return 1
}

has_validation() {
    for folder in /usr/share /usr/local/share /etc; do
        test -f "$folder/vulkan/explicit_layer.d/VkLayer_khronos_validation.json" && return 0
    done
    return 1
}

has_glslang() {
    command -v glslangValidator || command -v glslang
}

has_chromium() {
    command -v chromium || command -v chromium-browser
}

check() {
    missing_packages=""
    missing_names=""
    wanted_packages=""
    for group in "$@"; do
        case $group in
        build)
            need "Python 3.11 or later" python3 \
                python3 -c 'import sys; assert sys.version_info >= (3, 11)'
            need "Python's venv module" python3-venv python3 -c 'import ensurepip, venv'
            need "a C compiler" "gcc libc6-dev" has_header stdio.h
            need "Python's C headers" python3-dev has_python_headers
            need "glslang" glslang-tools has_glslang
            need "spirv-opt" spirv-tools command -v spirv-opt
            need "the Vulkan headers" libvulkan-dev has_header vulkan/vulkan.h
            need "volk" libvulkan-volk-dev has_header volk.h
            need "the Vulkan loader" libvulkan1 has_loader
            need "a Vulkan driver, such as Mesa's lavapipe" mesa-vulkan-drivers has_driver
            ;;
        test)
            need "the Khronos validation layer" vulkan-validationlayers has_validation
            want chromium has_chromium
            want xvfb command -v Xvfb
            want twm command -v twm
            want libjxl-tools command -v cjxl
            want libtiff-tools command -v tiffcp
            want locales test -f /usr/share/i18n/locales/de_DE
            ;;
        esac
    done
}

check "$@"
test -z "$missing_names$wanted_packages" && exit 0

if command -v apt-get >/dev/null && [ "$(id -u)" = 0 ]; then
    echo "Installing with apt:$missing_packages$wanted_packages"
    export DEBIAN_FRONTEND=noninteractive
    apt-get update -qq
    # Word splitting is intended: one argument for each package.
    # shellcheck disable=SC2086
    apt-get install -qq -y --no-install-recommends $missing_packages >/dev/null
    for package in $wanted_packages; do
        apt-get install -qq -y --no-install-recommends "$package" >/dev/null ||
            echo "Tests that need $package will be skipped." >&2
    done
    check "$@"
fi
test -z "$missing_names" && exit 0
echo "vkbloom needs these, which are not installed:$missing_names" >&2
exit 1
