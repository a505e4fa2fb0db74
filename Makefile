# Two commands do everything on a fresh machine: `make render` and `make test`.

PYTHON ?= python3.11
CARGO ?= cargo
CXX ?= c++
SCENE ?= glass_caustic
RENDER_ARGS ?= --time 30

LIBRARY := build/libsegue.so
VENV := .venv
# As many tests at a time as there are cores; those that look at the clock have the machine for themselves.
PYTEST := $(VENV)/bin/pytest -q -n auto --dist worksteal
TIMED := tests/python/test_cli.py tests/python/test_converge.py
PIP_FLAGS := --quiet --disable-pip-version-check

.PHONY: all library render test lint test-rust test-c test-python test-blender-current test-blender stress \
        blender-extension bench clean

all: library $(VENV)/ready

# The Rust core with its C++ bridge is one static archive; linking it here, and not as a cdylib, is what
# exports the C ABI and nothing else.
library:
	$(CARGO) build --release --locked
	@mkdir -p build
	$(CXX) -shared -o $(LIBRARY).new \
	    -Wl,--whole-archive target/release/libsegue.a -Wl,--no-whole-archive \
	    -Wl,--gc-sections -Wl,--version-script=cpp_bridge/exports.map -Wl,-z,defs -Wl,-s \
	    -static-libstdc++ -static-libgcc -lpthread -ldl -lm
	@cmp -s $(LIBRARY).new $(LIBRARY) && rm $(LIBRARY).new || mv $(LIBRARY).new $(LIBRARY)

$(VENV)/ready: python/pyproject.toml python/hatch_build.py
	$(PYTHON) -m venv $(VENV)
	$(VENV)/bin/pip install $(PIP_FLAGS) --editable 'python[cli,test]'
	touch $@

# A gallery scene, as EXR and PNG in results/.
render: all
	@mkdir -p results
	$(VENV)/bin/segue render scenes/$(SCENE).usda -o results/$(SCENE).png $(RENDER_ARGS)
	@echo "results/$(SCENE).exr and results/$(SCENE).png are written"

test: lint test-rust test-c test-python test-blender-current

lint: all
	$(CARGO) fmt --check
	$(CARGO) clippy --release --locked --all-targets -- -D warnings
	$(VENV)/bin/ruff check python tests blender_addon scenes benches
	$(VENV)/bin/ruff format --check python tests blender_addon scenes benches

test-rust:
	$(CARGO) test --release --locked

# A C program that knows nothing but the header and the library.
test-c: library
	$(CC) -std=c11 -Wall -Wextra -Werror -D_POSIX_C_SOURCE=200809L -Icpp_bridge/include \
	    tests/abi/outsider.c $(LIBRARY) -Wl,-rpath,'$$ORIGIN' -lm -lpthread -o build/outsider
	build/outsider

test-python: all
	$(PYTEST) tests/python $(addprefix --ignore=,$(TIMED))
	$(VENV)/bin/pytest -q $(TIMED)
	$(PYTEST) tests/stability

# The stability suite in full, and its report docs/stability.md.
stress: all
	$(VENV)/bin/python tests/stability/report.py

test-blender-current: all
	$(VENV)/bin/python tests/blender/run_versions.py 5.0

# Every supported Blender, each in an environment of its own.
test-blender: all
	$(VENV)/bin/python tests/blender/run_versions.py

# The archive that Blender installs.
blender-extension: library $(VENV)/ready
	$(VENV)/bin/python blender_addon/build.py --output dist

bench: all
	$(CARGO) bench --locked
	$(VENV)/bin/python benches/startup.py

clean:
	rm -rf target build results $(VENV) .venv-*
