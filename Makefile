# make demo: installs what is missing, renders the built-in scene into out/.
# make test: installs what the tests need, runs all tests. Both are quick the second time.
# make test-devices: runs all tests on SwiftShader, which comes with Debian's Chromium; compiles and
#   records everything for seven families of AMD's GPUs, without one, on Mesa 22.3.6 and 25.0.7. (make
#   test runs a part of both.) SWIFTSHADER: its manifest. TESTS: some of the tests.
# make test-torch: runs the tests that need PyTorch, with the one for CPUs in an environment of its own,
#   build/torch (0.7 GB).
# make exhaustive: the same with every case of the tests that otherwise take a few (tests/exhaustive.py),
#   such as each fault point; takes hours.
# make check: for use during development: lints the changed files, runs a fast part of the tests.
# make docs: builds the documentation into build/docs, and runs the examples of its gallery; a warning
#   is a failure.
# make docs-version: the same, with a choice of versions, into build/versions beside other versions.
# make first-page: the same, and runs the test that reads the built pages.
# make tables: measures again, and writes the tables of docs/evidence, in more than an hour.
# make wheels: builds the source distribution, and the wheels of vkbloom, its driver and its compiler for
#   x86-64 and aarch64, into dist/ (docs/releasing.md); as root.
# make release-check: runs the jobs of the release's workflow as for the tag of this version, up to the
#   upload, and checks the workflows and the conda recipe; as root, on a working tree without changes.
# make freethreaded: builds Python 3.13 without the GIL, from Debian's source, and the core for it; makes
#   10,000 calls in 16 threads, and some under ThreadSanitizer; takes half an hour the first time.
# make try-core: builds the core's wheel from a source distribution, without glslang and spirv-opt, and
#   tries it in a fresh environment.
# make test-floors: runs the fast part of the tests with the oldest packages that pyproject.toml allows.
# make test-pure: runs the tests that need no device with the wheel for all systems, which has no core.
# make try-wheels: installs the wheels of dist/ in bare roots of Debian, Ubuntu and arm64, and makes an
#   image in each (ROOTS="bookworm arm64"); as root.
# make test-aarch64: runs the fast part of the tests with the aarch64 wheels of dist/ under QEMU; as root.
# make engines: compares with Blender and pygfx as they run; needs Python 3.11 and 3.13, and 4 GB of disk.
# make engine-laws: takes both through all laws, in a quarter of an hour.
# make libplacebo HOOKS=folder: compares the user shaders of a folder with libplacebo 7 as it runs,
#   which comes as packages of Debian 13 that are unpacked, not installed.
# make same-bits: draws with the wheel's driver of dist/ on emulated CPUs, by vkbloom and by pygfx, and
#   fails where pictures of the frozen code differ; SAME_BITS="--driver system --cpus Haswell"; takes long.
# make cluster: renders grids under Slurm with two nodes on this machine; installs it (with apt, as root).
# make bench: times vkbloom beside its peers into out/bench.md, in about a quarter of an hour.

VENV := .venv
PYTHON := $(VENV)/bin/python
CORE := $(wildcard csrc/*/*.[ch]) $(wildcard shaders/* shaders/*/*.*) \
        $(wildcard python/vkbloom/_custom/glsl/*/*) python/vkbloom/_custom/spirv.py setup.py pyproject.toml

# Test processes. All tests of a file run in one process, which makes its fixtures once. One process
# more than there are cores, since some tests wait for a browser or another process.
WORKERS := $(shell echo $$(($$(nproc 2>/dev/null || echo 2) + 1)))
# What build/stamp/packages installs: "all", and "test", "docs" and "lint" where one call of pip is
# to do it.
GROUPS := all
PARALLEL := -n $(WORKERS) --dist loadfile --no-loadscope-reorder
# One thread of lavapipe in each of them: with more they take a quarter more time from each other.
test test-torch exhaustive check sanitize: export LP_NUM_THREADS := 1
# Python keeps compiled modules, also where the environment says otherwise: each process would compile
# the package again, and each run the tests' assertions. So pip leaves to the first use what is used.
export PYTHONDONTWRITEBYTECODE :=
PIP_INSTALL = $(PYTHON) -m pip install --quiet --no-compile
# The tests that a change of the core or of a method breaks first. They reach every layer, and have no
# other process, browser or large image.
FAST := tests/core/test_settings.py tests/core/test_core_arguments.py tests/core/test_graph.py \
	tests/core/test_refusals.py tests/core/test_frames.py tests/core/test_out_of_date.py \
	tests/methods/test_dither.py tests/methods/test_original_blur.py tests/scene/test_scene.py \
	tests/io/test_files.py tests/views

.PHONY: demo test test-devices test-torch exhaustive check docs first-page tables bench engines engine-laws libplacebo cluster wheels lint \
	docs-version release-check test-floors same-bits \
	freethreaded try-core try-wheels test-pure test-aarch64 format sanitize clean
.DELETE_ON_ERROR:

demo: build/stamp/core
	$(PYTHON) examples/demo.py --out out

SWIFTSHADER := /usr/lib/chromium/vk_swiftshader_icd.json
test-devices: export VK_DRIVER_FILES := $(SWIFTSHADER)
test-devices: export VK_ICD_FILENAMES := $(SWIFTSHADER)
test-devices: export VKBLOOM_DRIVER := system
test-devices: build/stamp/core build/stamp/test
	test -f $(SWIFTSHADER) || { echo "$(SWIFTSHADER) is missing: apt install chromium-common"; exit 2; }
	$(PYTHON) -m pytest $(PARALLEL) $(TESTS)
	env -u VK_DRIVER_FILES -u VK_ICD_FILENAMES $(PYTHON) -m tests.device.amd_families

# PyTorch for CPUs comes from an index of its own; where that is out of reach, pip takes what it finds.
TORCH := build/torch/bin/python
TORCH_INDEX := https://download.pytorch.org/whl/cpu
test-torch: build/stamp/core build/stamp/test build/torch/done
	$(TORCH) -m pytest -q tests/methods/test_torch.py tests/device/test_training_pairs.py
	$(TORCH) -m pytest -q tests/docs/test_scripts.py -k "torch or operators or learned"

# It finds what is installed in $(VENV), too.
build/torch/done: pyproject.toml | build/stamp/packages
	$(PYTHON) -m venv --clear --without-pip build/torch
	$(PYTHON) -c "import sysconfig; print('import site; site.addsitedir(%r)' % sysconfig.get_path('purelib'))" \
	    >$$($(TORCH) -c "import sysconfig; print(sysconfig.get_path('purelib'))")/packages.pth
	$(PYTHON) -m pip --python $(TORCH) install -qq --no-compile --retries 0 --extra-index-url $(TORCH_INDEX) \
	    torch==2.13.0
	touch $@

exhaustive: export VKBLOOM_EXHAUSTIVE := 1
test exhaustive: build/stamp/core build/stamp/test
	$(PYTHON) -m pytest $(PARALLEL)

# Changed files: those that differ from the last commit, and untracked ones.
check: build/stamp/core build/stamp/test build/stamp/lint
	changed=$$(git ls-files --modified --others --exclude-standard --deduplicate -- '*.py' | \
	    while read -r file; do test ! -e "$$file" || echo "$$file"; done); \
	    test -z "$$changed" || { $(VENV)/bin/ruff check $$changed && \
	    $(VENV)/bin/ruff format --check $$changed && $(VENV)/bin/mypy; }
	changed=$$(git ls-files --modified --others --exclude-standard --deduplicate -- '*.c' '*.h' | \
	    while read -r file; do test ! -e "$$file" || echo "$$file"; done); \
	    test -z "$$changed" || $(VENV)/bin/clang-format --dry-run -Werror $$changed
	$(PYTHON) -m pytest -q $(PARALLEL) $(FAST)

# DOCS: options for sphinx. With "-D plot_gallery=0" the gallery's examples do not run.
# EXPLORER=--quick: one picture and one preset in the page of stored pictures.
# VKBLOOM_DOCS_SMALL=1: looks are shown with photographs of a quarter of their sides, exposures with fewer
#   frames, a lens with a larger tolerance.
docs: build/stamp/core build/stamp/docs
	rm -rf docs/api docs/examples
	$(PYTHON) -m sphinx -q -W --keep-going -b html $(DOCS) docs build/docs
	rm -rf build/docs/explorer_stored
	$(PYTHON) -m tools.static_explorer build/docs/explorer_stored $(EXPLORER)

# VERSIONS: the folder, which can be served as it is.
VERSIONS := build/versions
docs-version: export VKBLOOM_DOCS_VERSIONS := 1
docs-version: docs
	$(PYTHON) tools/docs_versions.py build/docs $(VERSIONS)

first-page: docs build/stamp/test
	$(PYTHON) -m pytest -q tests/docs/test_first_page.py

tables: build/stamp/core build/stamp/test build/stamp/peers
	$(PYTHON) tools/tables/write.py
	$(PYTHON) tools/where_it_has_run.py
	$(PYTHON) -m tools.laws

# The build root and Mesa are built once, in build/wheels.
wheels:
	packaging/wheels.sh

# LEAVE_OUT: steps of the workflow that are not run, by name, between semicolons. MACHINES, STEPS: as of packaging/wheels.sh.
LEAVE_OUT := Install Debian's packages;Let root use the checkout
RELEASE := build/release/python/bin
release-check: build/release/done
	$(RELEASE)/zizmor --quiet --offline .github action.yml
	$(RELEASE)/python packaging/conda/check.py
	$(RELEASE)/python packaging/run_workflow.py .github/workflows/release.yml \
	    --tag "v$$(sed -n 's/^version = "\(.*\)"/\1/p' pyproject.toml)" --leave-out "$(LEAVE_OUT)"

build/release/done: packaging/release_requirements.txt
	python3 -m venv build/release/python
	$(RELEASE)/pip install --quiet --requirement $<
	touch $@

# Both Pythons are built once, in build/free_threaded. CALLS: how many, and how many of them under the
# sanitizer.
freethreaded: build/stamp/core build/stamp/test
	PYTHON=$(abspath $(PYTHON)) LP_NUM_THREADS=1 tools/free_threaded/run.sh $(CALLS)

try-core: build/stamp/core
	packaging/try_core.sh $(PYTHON)

# uv takes the least versions, which pip cannot.
FLOORS := build/floors/bin/python
test-floors: build/stamp/core build/floors/done
	$(FLOORS) -m pytest -q $(FAST)

build/floors/done: pyproject.toml tools/requirements.py | build/stamp/packages
	$(PYTHON) -m venv --clear build/floors
	$(PYTHON) -m pip --python $(FLOORS) install --quiet --upgrade uv setuptools wheel
	{ $(PYTHON) tools/requirements.py all pytest; echo "hypothesis >= 6.100"; } \
	    >build/floors/requirements.txt
	UV_DEFAULT_INDEX="$$($(PYTHON) -m pip config get global.index-url 2>/dev/null || \
	    echo https://pypi.org/simple)" build/floors/bin/uv pip install --quiet --python $(FLOORS) \
	    --resolution lowest-direct --requirement build/floors/requirements.txt
	$(PYTHON) -m pip --python $(FLOORS) install --quiet --no-build-isolation --no-deps --editable .
	touch $@

# The wheel's files are found before those of the checkout.
PURE := build/pure
test-pure: build/stamp/core build/stamp/test
	rm -rf $(PURE) && mkdir -p $(PURE)/site
	VKBLOOM_PURE=1 $(PYTHON) setup.py --quiet egg_info --egg-base $(PURE) build --build-base \
	    $(PURE)/build bdist_wheel --dist-dir $(PURE) 2>$(PURE)/log || { cat $(PURE)/log; exit 1; }
	$(PYTHON) -m zipfile -e $(PURE)/*.whl $(PURE)/site
	PYTHONPATH=$(PURE)/site $(PYTHON) -m pytest -q -p tests.no_core tests/core/test_settings.py \
	    tests/psf tests/plugin/test_comparison.py tests/plugin/test_diagnosis.py tests/plugin/test_laws.py

try-wheels:
	packaging/try_bare.sh $(ROOTS)

test-aarch64:
	packaging/aarch64.sh $(FAST)

# BENCH: options for python -m benchmarks.
bench: build/stamp/core build/stamp/peers
	$(PYTHON) -m benchmarks --out out/bench.md $(BENCH)

# Installs engines, each into an environment of its own, and compares with them (docs/evidence/engines.md).
engines: build/stamp/core $(foreach one,blender blender-5.2 pygfx,build/engines/$(one)/done)
	$(PYTHON) tools/engines/compare.py blender=build/engines/blender/bin/python \
	    blender-5.2=build/engines/blender-5.2/bin/python \
	    pygfx=build/engines/pygfx/bin/python $(ENGINES)

same-bits: build/stamp/core build/engines/pygfx/done
	test -n "$$(command -v qemu-x86_64)" || apt-get install --yes qemu-user
	$(PYTHON) packaging/emulated_cpus.py --program pygfx $(SAME_BITS)
	$(PYTHON) packaging/emulated_cpus.py --program vkbloom $(SAME_BITS)

# Takes the engines through all laws, in about a hundred runs of each.
engine-laws: build/stamp/core build/engines/blender/done build/engines/pygfx/done
	$(PYTHON) tools/engines/laws.py blender=build/engines/blender/bin/python \
	    pygfx=build/engines/pygfx/bin/python

# Each bpy is for one version of Python.
build/engines/blender-5.2/done: PACKAGES := bpy==5.2.3 numpy==2.5.5
build/engines/blender-5.2/done: ENGINE_PYTHON := python3.13
build/engines/blender/done: PACKAGES := bpy==5.0.1 numpy==1.26.4
build/engines/pygfx/done: PACKAGES := pygfx==0.17.0 rendercanvas==2.7.2 wgpu==0.32.0
build/engines/%/done:
	$(or $(ENGINE_PYTHON),python3.11) -m venv $(@D)
	$(@D)/bin/pip install --quiet $(PACKAGES)
	touch $@

# Compares custom methods with libplacebo (docs/evidence/libplacebo.md).
libplacebo: build/stamp/core build/libplacebo/apply_hook
	test -n "$(HOOKS)" || { echo "give a folder of user shaders: make libplacebo HOOKS=..."; exit 2; }
	$(PYTHON) tools/libplacebo/compare.py build/libplacebo/apply_hook "$(HOOKS)" $(LIBPLACEBO)

build/libplacebo/apply_hook: tools/libplacebo/build.sh tools/libplacebo/apply_hook.c
	tools/libplacebo/build.sh build/libplacebo

# Tries examples/cluster, and prints the times (docs/grids.md).
cluster: build/stamp/core build/cluster/done
	build/cluster/python/bin/python tools/cluster/run.py build/cluster examples/cluster

build/cluster/done: tools/cluster/setup.sh
	tools/cluster/setup.sh $(@D) $(PYTHON)
	touch $@

lint: build/stamp/core build/stamp/test build/stamp/lint
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/mypy
	$(PYTHON) -m mypy.stubtest vkbloom --concise --mypy-config-file tools/stubtest.ini \
	    --allowlist tools/stubtest_allowlist.txt --ignore-unused-allowlist
	$(VENV)/bin/lint-imports
	$(PYTHON) -m pytest -q tests/core/test_floors.py
	$(VENV)/bin/clang-format --dry-run -Werror csrc/*/*.c csrc/*/*.h packaging/*/*.c tests/*/*.c tools/*/*.c
	$(VENV)/bin/abi3audit --strict --assume-minimum-abi3 3.11 python/vkbloom/_core.abi3.so

format: build/stamp/lint
	$(VENV)/bin/ruff check --fix-only .
	$(VENV)/bin/ruff format .
	$(VENV)/bin/clang-format -i csrc/*/*.c csrc/*/*.h packaging/*/*.c tests/*/*.c tools/*/*.c

# Tests of the core with ASan, UBSan and LeakSanitizer; beside them, threads with ThreadSanitizer.
# Their output is shown last, since a failure among the tests' lines is easily overlooked.
sanitize: build/stamp/core build/stamp/test
	PYTHON=$(abspath $(PYTHON)) tools/threads/run.sh >build/threads.log 2>&1 & threads=$$!; \
	    PYTHON=$(abspath $(PYTHON)) tools/sanitize.sh; tests=$$?; \
	    wait $$threads; threads=$$?; cat build/threads.log; exit $$((tests || threads))

clean:
	rm -rf build out docs/api docs/examples $(VENV) python/vkbloom/_core*.so

build/stamp/system:
	tools/setup_system.sh build
	@mkdir -p $(@D) && touch $@

$(PYTHON): | build/stamp/system
	python3 -m venv $(VENV)
	$(PIP_INSTALL) --upgrade pip setuptools wheel

build/stamp/packages: pyproject.toml | $(PYTHON)
	$(PYTHON) tools/requirements.py $(GROUPS) | $(PIP_INSTALL) -r /dev/stdin
	@mkdir -p $(@D) && touch $@ $(patsubst %,$(@D)/%,$(filter-out all,$(GROUPS)))

# Needs no packages: make -j 2 compiles while pip installs them.
build/stamp/compiled: $(CORE) | $(PYTHON)
	$(PYTHON) setup.py --quiet build_ext --inplace
	@mkdir -p $(@D) && touch $@

# Takes the objects that are compiled.
build/stamp/core: build/stamp/compiled build/stamp/packages
	$(PIP_INSTALL) --no-build-isolation --no-deps --editable .
	@mkdir -p $(@D) && touch $@

build/stamp/peers: benchmarks/peers.txt | $(PYTHON)
	$(PIP_INSTALL) -r benchmarks/peers.txt
	@mkdir -p $(@D) && touch $@

build/stamp/test-system: | build/stamp/system
	tools/setup_system.sh test
	@mkdir -p $(@D) && touch $@

build/stamp/test: pyproject.toml | build/stamp/packages build/stamp/test-system build/stamp/slangc
	$(PYTHON) tools/requirements.py test | $(PIP_INSTALL) -r /dev/stdin
	@mkdir -p $(@D) && touch $@

# The command slangc of slangtorch alone, without PyTorch.
build/stamp/slangc: | build/stamp/packages
	$(PIP_INSTALL) --no-deps slangtorch || echo "Tests of HLSL and Slang will be skipped." >&2
	@mkdir -p $(@D) && touch $@

build/stamp/docs: pyproject.toml | build/stamp/packages
	$(PYTHON) tools/requirements.py docs | $(PIP_INSTALL) -r /dev/stdin
	@mkdir -p $(@D) && touch $@

build/stamp/lint: pyproject.toml | build/stamp/packages
	$(PYTHON) tools/requirements.py lint | $(PIP_INSTALL) -r /dev/stdin
	@mkdir -p $(@D) && touch $@
