# `make demo` and `make test` set everything up by themselves; `make help` lists the rest.
PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin
READY  := $(VENV)/.ready
WORKERS ?= auto

.DEFAULT_GOAL := help
.PHONY: help demo test test-slow test-long check check-client format site wheel-check compatibility constraints assets pictures data-dictionary client-protocol clean

help: ## List the targets
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:[^#]*## /\t/' | expand -t 18

demo: $(READY) ## Set up, simulate an assisted clean-up into runs/demo, then film it
	$(BIN)/mjsim run --objects 6 --assistance guided --seed 0 --no-video --force --out runs/demo
	@echo "Look at runs/demo/topdown.png while the film is made."
	$(BIN)/mjsim replay runs/demo --video runs/demo.mp4 --force

test: $(READY) ## Set up, then run the tests except for the slow ones; COVERAGE=1 checks how many lines they run
	$(BIN)/python -m pytest -n $(WORKERS) --dist worksteal $(if $(COVERAGE),--cov --cov-report=term:skip-covered)

test-slow: $(READY) ## Run the slow tests, each of which takes seconds
	$(BIN)/python -m pytest -n $(WORKERS) --dist loadgroup -m 'slow and not long'

test-long: $(READY) ## Run the long tests, each of which takes about a minute or more
	$(BIN)/python -m pytest -n $(WORKERS) --dist loadgroup -m long

check: check-client site ## Lint, strict types, import contracts, security, the site
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	.ci/check-prose
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/bandit --quiet --recursive --configfile pyproject.toml mjsim planner hud experiments studies

check-client: $(READY) ## Types, lint and unit tests of the client of `mjsim play`
	PYTHON=$(abspath $(BIN)/python) .ci/check-client

format: $(READY) ## Put the code into the house style
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

site: $(READY) ## Build the site of the documents into site/; any warning is an error
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet --strict

wheel-check: $(READY) ## Build the wheel and use it in an empty environment
	PYTHON=$(BIN)/python .ci/wheel-check

compatibility: $(READY) ## Try the wheel on every Python from 3.11 to 3.14 that is here, with the lowest and the newest versions
	.ci/compatibility

constraints: $(READY) ## Renew constraints.txt: the newest version of everything, for all supported Pythons
	.ci/renew-constraints

assets: $(READY) ## Make textures and meshes under models/ anew
	$(BIN)/python -m tools.authoring

pictures: $(READY) ## Make the pictures of the README and of the documentation anew
	$(BIN)/mjsim gallery --force --out docs/pictures
	$(BIN)/python -m tools.drawn_pairs docs/pictures/browser.webp
	$(BIN)/python -m tools.furniture_sheet docs/pictures/furniture.webp
	$(BIN)/python -m tools.homes_sheet docs/pictures/homes.webp

data-dictionary: $(READY) ## Make docs/data.md anew from the types
	$(BIN)/python -m tools.data_dictionary > docs/data.md

client-protocol: $(READY) ## Make the client's copy of the protocol anew from the types
	$(BIN)/python -m tools.client_protocol > experiments/web/client/static/protocol.js

clean: ## Remove the environment, caches and runs
	rm -rf $(VENV) runs dist build site .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache

$(READY): pyproject.toml constraints.txt .ci/system-libraries
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "Python 3.11 or newer is needed, $(PYTHON) is $$($(PYTHON) --version); name another with PYTHON=..."; exit 1; }
	PYTHON=$(PYTHON) .ci/system-libraries
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --upgrade pip
	$(BIN)/pip install --quiet --constraint constraints.txt --editable '.[dev]'
	$(BIN)/pip install --quiet --constraint constraints.txt --no-deps dm-control
	$(BIN)/python -m experiments.trials.warmup
	@touch $@
