#!/bin/sh
# Makes the source distribution in FOLDER/dist, from a copy of the working tree in FOLDER. Modules of
# SPIR-V that FOLDER/build/spirv has of the same sources are not compiled again. Two archives of the
# same files have the same bytes: sorted, without users, of the time SOURCE_DATE_EPOCH.
# Arguments: FOLDER; a Python with setuptools.
set -eu
. "$(dirname "$0")/versions.sh"
folder=$1
python=$2
mkdir -p "$folder"
git ls-files -z --cached --others --exclude-standard | tar -c --null -T - | tar -x -C "$folder"
cd "$folder"
"$python" setup.py --quiet sdist --formats tar --dist-dir dist
name=$(basename dist/*.tar .tar)
tar -x -f "dist/$name.tar" -C dist
rm "dist/$name.tar"
tar -c -C dist --sort=name --format=ustar --owner=0 --group=0 --numeric-owner --mode=u=rwX,go=rX \
    --mtime="@$SOURCE_DATE_EPOCH" "$name" | gzip -9 -n >"dist/$name.tar.gz"
rm -r "dist/$name"
