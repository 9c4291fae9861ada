#!/usr/bin/env bash
# Unpacks the Vulkan drivers of Debian's backports, Mesa 25.0.7, beside those that are installed:
#   tools/mesa_backports.sh FOLDER
# Prints what selects them, for the environment of a process. Needs no root. Nothing is installed.
set -euo pipefail
mkdir -p "$1"
folder=$(cd "$1" && pwd)

if [ ! -e "$folder/done" ]; then
    mkdir -p "$folder/lists/partial" "$folder/archives/partial"
    . /etc/os-release
    printf 'deb http://deb.debian.org/debian %s main\n' "$VERSION_CODENAME" \
        "$VERSION_CODENAME-backports" >"$folder/sources.list"
    apt="apt-get -qq -o Dir::Etc::SourceList=$folder/sources.list -o Dir::Etc::SourceParts=-
         -o Dir::State::Lists=$folder/lists -o Dir::Cache=$folder -o Debug::NoLocking=1
         -o Acquire::Languages=none -o Dir::Cache::Archives=$folder/archives"
    $apt update >&2
    $apt --download-only --yes -t "$VERSION_CODENAME-backports" install mesa-vulkan-drivers >&2
    for deb in "$folder"/archives/*.deb; do
        dpkg -x "$deb" "$folder"
    done
    libraries=$(dirname "$(echo "$folder"/usr/lib/*/libvulkan_lvp.so)")
    # Manifests name a library; the path leads to these and to no others.
    sed -i -E "s#\"library_path\": \"(.*/)?([^/\"]+)\"#\"library_path\": \"$libraries/\\2\"#" \
        "$folder"/usr/share/vulkan/icd.d/*.json
    rm -rf "$folder/archives" "$folder/lists" "$folder"/*.bin
    touch "$folder/done"
fi
echo "LD_LIBRARY_PATH=$(dirname "$(echo "$folder"/usr/lib/*/libvulkan_lvp.so)")"
for kind in lvp radeon; do
    echo "$kind=$(echo "$folder"/usr/share/vulkan/icd.d/${kind}_icd*.json)"
done
