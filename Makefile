# Two commands: `make demo` and `make test`. Both set everything up in .venv; nothing else is touched.
# Needs python3 (3.11 or newer) with venv, and make. uv is used where present, because it is faster.

VENV := .venv
BIN := $(VENV)/bin
PYTHON ?= python3
READY := $(VENV)/.ready
UV := $(shell command -v uv 2>/dev/null)

.PHONY: demo test slow check examples benchmark clean help

help:            ## this list
	@grep -E '^[a-z]+:.*##' Makefile | sed 's/:.*##/\t/'

$(READY): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "make: Python 3.11 or newer is needed, $(PYTHON) is $$($(PYTHON) --version 2>&1)" >&2; exit 2; }
ifdef UV
	@test -x $(BIN)/python || $(UV) venv --quiet --python $(PYTHON) $(VENV)
	$(UV) pip install --quiet --python $(BIN)/python --constraint constraints.txt --editable '.[simulation,cluster,paxini]' --group dev
else
	@test -x $(BIN)/pip || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --upgrade 'pip>=25.1' --constraint constraints.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt \
		--editable '.[simulation,cluster,paxini]' --group dev
endif
	@touch $(READY)

demo: $(READY)   ## simulate one scene, fuse it, print the tables and draw the picture
	$(BIN)/evifuse demo

test: $(READY)   ## the tests, doctests included
	$(BIN)/python -m pytest --numprocesses auto --maxprocesses 4 --dist loadfile

slow: $(READY)   ## the tests that take longer
	$(BIN)/python -m pytest -m slow

check: $(READY)  ## format, lint, types and the import contract
	$(BIN)/ruff format --check
	$(BIN)/ruff check
	$(BIN)/pyright
	$(BIN)/lint-imports

benchmark: $(READY) ## the time of each stage
	$(BIN)/python benchmarks/stages.py

clean:           ## remove what was set up and drawn
	rm -rf $(VENV) out build dist .pytest_cache .ruff_cache .hypothesis
