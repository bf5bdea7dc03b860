# `make demo` and `make test` set everything up by themselves; `make help` lists the rest.
PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin
READY  := $(VENV)/.ready
WORKERS ?= auto

.DEFAULT_GOAL := help
.PHONY: help demo test check format wheel-check assets pictures data-dictionary clean

help: ## List the targets
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:[^#]*## /\t/' | expand -t 18

demo: $(READY) ## Set up, then film an assisted clean-up into runs/demo
	$(BIN)/mjsim run --objects 6 --assistance guided --seed 0 --out runs/demo

test: $(READY) ## Set up, then run the whole test suite; COVERAGE=1 measures what it covers
	$(BIN)/python -m pytest -n $(WORKERS) $(if $(COVERAGE),--cov --cov-report=term:skip-covered)

check: $(READY) ## Lint, strict types, import contracts
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

format: $(READY) ## Put the code into the house style
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

wheel-check: $(READY) ## Build the wheel and use it in an empty environment
	PYTHON=$(BIN)/python .ci/wheel-check

assets: $(READY) ## Make textures and meshes under models/ anew
	PYTHONPATH=tools $(BIN)/python -m authoring

pictures: $(READY) ## Make the pictures of the README anew
	$(BIN)/mjsim gallery --force --out docs/pictures

data-dictionary: $(READY) ## Make docs/data.md anew from the types
	$(BIN)/python -m experiments.data_dictionary > docs/data.md

clean: ## Remove the environment, caches and runs
	rm -rf $(VENV) runs dist build .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache

$(READY): pyproject.toml .ci/system-libraries
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "Python 3.11 or newer is needed, $(PYTHON) is $$($(PYTHON) --version); name another with PYTHON=..."; exit 1; }
	PYTHON=$(PYTHON) .ci/system-libraries
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --upgrade pip
	$(BIN)/pip install --quiet --editable '.[dev]'
	$(BIN)/python -m experiments.trials.warmup
	@touch $@
