#!/bin/sh
# Runs in the fresh root, as an unprivileged user: what the README shows, from the wheels alone.
# Argument: the Python.
set -eu
rm -rf try && mkdir try && cd try
start=$(date +%s)
"$1" -m venv --without-pip venv
set -- /srv/wheels/pip-*.whl
venv/bin/python "$1/pip" install --quiet --no-index --find-links /srv/wheels \
    "vkbloom[software,scenes,cli,pytest]"
echo "installed in $(($(date +%s) - start)) s"
PATH=$PWD/venv/bin:$PATH
vkbloom adapters
vkbloom doctor
python - <<END
import numpy as np
import vkbloom

with vkbloom.Renderer() as renderer:
    frames = renderer.render(vkbloom.Scene.ufo(), vkbloom.presets["tutorial"], size=(1280, 720))
    total = frames["scene"][..., :3].astype(int) + frames["bloom"][..., :3]
    assert np.abs(np.minimum(total, 255) - frames["final"][..., :3]).max() <= 1
    frames.save("saucer.exr")
    image = np.random.default_rng(0).random((480, 640, 3), dtype=np.float32) ** 20
    bloom = renderer.apply(image, vkbloom.Pyramid(threshold=0.5))["bloom"]
    expected = vkbloom.reference.apply(image, vkbloom.Pyramid(threshold=0.5))["bloom"]
    assert np.abs(bloom - expected).max() < 1e-4
    assert renderer.info.bundled
    print(renderer.info.summary)
END
vkbloom render -o rendered.exr
cat >test_bloom.py <<END
import numpy as np
import vkbloom


def test_bloom(bloom_renderer, frame_regression):
    image = np.zeros((32, 32, 4), np.float32)
    image[16, 16] = 8
    frame_regression.check(bloom_renderer.apply(image, vkbloom.Pyramid()), atol=0)
END
python -m pytest -q --bloom-update test_bloom.py
python -m pytest -q test_bloom.py
echo "all of it in $(($(date +%s) - start)) s"

# Without a loader the message says what is missing.
python - <<END
import numpy as np
import vkbloom

try:
    with vkbloom.Renderer("software", validation=True) as renderer:
        renderer.apply(np.ones((40, 60, 3), np.float32), vkbloom.Pyramid(threshold=0.5))
        print("validated:", renderer.info.summary)
except vkbloom.Error as error:
    print("not validated:", error)
END
python "$1/pip" install --quiet --no-index --find-links /srv/llvmlite llvmlite
python -c "import llvmlite, vkbloom_lavapipe"  # else the test is skipped
python -m pytest -q -p no:cacheprovider /srv/test_beside_llvm.py
