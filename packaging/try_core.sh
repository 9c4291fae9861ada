#!/bin/sh
# Builds the core's wheel with what this system has, and renders with it in a fresh environment:
# nothing of the working tree is imported. Argument: the Python that builds, with setuptools.
set -eu
python=$(realpath -s "$1")
cd "$(dirname "$0")/.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$python" -m pip --quiet wheel --no-deps --no-build-isolation --wheel-dir "$work" .
"$python" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet "$work"/vkbloom-*.whl
cd "$work"
VKBLOOM_CACHE_DIR="$work/cache" venv/bin/python - <<END
import numpy as np
import vkbloom

image = np.random.default_rng(0).random((37, 53, 4), dtype=np.float32)
settings = vkbloom.Pyramid(threshold=0.5)
with vkbloom.Renderer("software") as renderer:
    bloom = renderer.apply(image, settings)["bloom"]
expected = vkbloom.reference.apply(image, settings)["bloom"]
assert "$work" in vkbloom.__file__, vkbloom.__file__
assert np.abs(bloom - expected).max() < 1e-4
print("the core's wheel renders in a fresh environment")
END
