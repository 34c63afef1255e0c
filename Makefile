# `make run` and `make test` do all the set-up themselves: python3 (3.11 or newer), pip and make are enough.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
LOCKED := $(VENV)/.locked
READY := $(VENV)/.ready
VIRTUALENV := virtualenv==21.15.8

export PIP_DISABLE_PIP_VERSION_CHECK = 1

.DEFAULT_GOAL := help
.PHONY: help setup run test lint types imports pytest bench lock clean

help: ## List the targets.
	@sed -n 's/^\([a-z]*\):[^#]*## \(.*\)/  make \1\t\2/p' $(MAKEFILE_LIST) | expand -t 16

setup: $(READY) ## Make .venv with the pinned dependencies and Oxbow itself (editable).

run: $(READY) ## Plan the example mission through the embedded stack.
	@mkdir -p out
	$(BIN)/oxbow plan docs/examples/lake.json --output out/lake.json --record out/lake.rrd
	$(BIN)/oxbow picture out/lake.json --output out/lake.png
	@echo "picture       out/lake.png"

test: lint types imports pytest ## Lint, types, import rules and all tests.

lint: $(READY)
	$(BIN)/ruff check
	$(BIN)/ruff format --check

types: $(READY)
	$(BIN)/mypy

imports: $(READY)
	$(BIN)/lint-imports

pytest: $(READY)
	$(BIN)/python -m pytest -n auto --dist worksteal

bench: $(READY) ## Measure planning, the bus and the stack; results in out/bench.json.
	$(BIN)/python -m tests.bench

lock: ## Renew requirements.lock: the newest versions that pyproject.toml accepts.
	rm -rf build/lock
	$(MAKE) build/lock/bin/python VENV=build/lock
	build/lock/bin/python -m pip install --quiet --editable '.[dev]'
	( sed -n '/^#/p' requirements.lock; build/lock/bin/python -m pip freeze --exclude-editable ) > build/requirements.lock
	mv build/requirements.lock requirements.lock

clean: ## Remove what the targets above made, the results in out/ included.
	rm -rf $(VENV) .venv-bootstrap build out .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache

$(READY): $(LOCKED) pyproject.toml
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --editable .
	@touch $@

$(LOCKED): requirements.lock
	@rm -rf $(VENV)
	@$(MAKE) --no-print-directory $(BIN)/python
	$(BIN)/python -m pip install --quiet --requirement requirements.lock
	@touch $@

# Debian keeps what `python3 -m venv` needs in a package of its own; virtualenv does without it.
$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit("Oxbow needs Python 3.11 or newer" if sys.version_info < (3, 11) else 0)'
	@echo "making $(VENV)"
	@$(PYTHON) -m venv $(VENV) >/dev/null 2>&1 || { \
	  rm -rf $(VENV) && \
	  $(PYTHON) -m pip install --quiet --upgrade --target .venv-bootstrap $(VIRTUALENV) && \
	  PYTHONPATH=.venv-bootstrap $(PYTHON) -m virtualenv --quiet $(VENV); \
	}
