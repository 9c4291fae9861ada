#!/bin/sh
# Makes the source distribution in FOLDER/dist, from a copy of the working tree in FOLDER. Modules of
# SPIR-V that FOLDER/build/spirv has of the same sources are not compiled again.
# Arguments: FOLDER; a Python with setuptools.
set -eu
folder=$1
python=$2
mkdir -p "$folder"
git ls-files -z --cached --others --exclude-standard | tar -c --null -T - | tar -x -C "$folder"
cd "$folder"
"$python" setup.py --quiet sdist --dist-dir dist
