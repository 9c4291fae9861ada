# make demo: sets up what is missing, renders the built-in scene into out/.
# make test: the same for the tests, and runs them. Both are quick the second time.
# make docs: the documentation into build/docs; a warning is a failure.
# make bench: times vkbloom beside its peers into out/bench.md, in about a quarter of an hour.

VENV := .venv
PYTHON := $(VENV)/bin/python
CORE := $(wildcard csrc/*/*.[ch]) $(wildcard shaders/* shaders/*/*.*) setup.py pyproject.toml

.PHONY: demo test docs bench lint format sanitize clean
.DELETE_ON_ERROR:

demo: build/stamp/core
	$(PYTHON) examples/demo.py --out out

test: build/stamp/core build/stamp/test
	$(PYTHON) -m pytest

docs: build/stamp/core build/stamp/docs
	rm -rf docs/api
	$(PYTHON) -m sphinx -q -W --keep-going -b html docs build/docs

# BENCH: more options of python -m benchmarks.
bench: build/stamp/core build/stamp/peers
	$(PYTHON) -m benchmarks --out out/bench.md $(BENCH)

lint: build/stamp/core build/stamp/test build/stamp/lint
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/mypy
	$(VENV)/bin/clang-format --dry-run -Werror csrc/*/*.c csrc/*/*.h tests/*/*.c tools/threads/*.c
	$(VENV)/bin/abi3audit --strict --assume-minimum-abi3 3.11 python/vkbloom/_core.abi3.so

format: build/stamp/lint
	$(VENV)/bin/ruff check --fix-only .
	$(VENV)/bin/ruff format .
	$(VENV)/bin/clang-format -i csrc/*/*.c csrc/*/*.h tests/*/*.c tools/threads/*.c

# The suite once more over a core with ASan, UBSan and LeakSanitizer; threads under ThreadSanitizer.
sanitize: build/stamp/core build/stamp/test
	PYTHON=$(abspath $(PYTHON)) tools/sanitize.sh
	PYTHON=$(abspath $(PYTHON)) tools/threads/run.sh 10

clean:
	rm -rf build out docs/api $(VENV) python/vkbloom/_core*.so

build/stamp/system:
	tools/setup_system.sh build
	@mkdir -p $(@D) && touch $@

$(PYTHON): | build/stamp/system
	python3 -m venv $(VENV)
	$(PYTHON) -m pip install --quiet --upgrade pip setuptools wheel

build/stamp/packages: pyproject.toml | $(PYTHON)
	$(PYTHON) tools/requirements.py all | $(PYTHON) -m pip install --quiet -r /dev/stdin
	@mkdir -p $(@D) && touch $@

build/stamp/core: $(CORE) build/stamp/packages
	$(PYTHON) -m pip install --quiet --no-build-isolation --no-deps --editable .
	@mkdir -p $(@D) && touch $@

build/stamp/peers: benchmarks/peers.txt | $(PYTHON)
	$(PYTHON) -m pip install --quiet -r benchmarks/peers.txt
	@mkdir -p $(@D) && touch $@

build/stamp/test: pyproject.toml | $(PYTHON)
	tools/setup_system.sh test
	$(PYTHON) tools/requirements.py test | $(PYTHON) -m pip install --quiet -r /dev/stdin
	@mkdir -p $(@D) && touch $@

build/stamp/docs: pyproject.toml | $(PYTHON)
	$(PYTHON) tools/requirements.py docs | $(PYTHON) -m pip install --quiet -r /dev/stdin
	@mkdir -p $(@D) && touch $@

build/stamp/lint: pyproject.toml | $(PYTHON)
	$(PYTHON) tools/requirements.py lint | $(PYTHON) -m pip install --quiet -r /dev/stdin
	@mkdir -p $(@D) && touch $@
