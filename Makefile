# `make demo` and `make test` do all their set-up; they need Python 3.11, 3.12 or 3.13, make and git.
PYTHONS := python3.11 python3.12 python3.13
ifndef PYTHON
PYTHON := $(firstword $(foreach python,$(PYTHONS),$(if $(shell $(python) -c 'print(1)' 2>/dev/null),$(python))))
endif
VERSION := $(if $(PYTHON),$(shell $(PYTHON) -c 'import platform; print(platform.python_version())' 2>/dev/null))
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready-$(VERSION)
DEMO_DATA ?= data
STUDY_DATA ?= data
export PREFECT_SERVER_ANALYTICS_ENABLED := false
# the tests start some hundred processes: none shall have to compile the sources again
export PYTHONDONTWRITEBYTECODE :=

.PHONY: help demo demo-learners test quick lint docs pythons chain bench study world paradigms seasons golden notebooks \
  lock clean

help:  ## show what can be made
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/'

# The lock is what is installed: exact versions, checked by hash. Another Python makes the environment anew.
$(READY): requirements.lock pyproject.toml
	@test -n "$(filter $(PYTHONS:python%=%),$(basename $(VERSION)))" || { \
	  echo "pitchlore needs Python 3.11, 3.12 or 3.13: make PYTHON=/path/to/python3.13"; exit 1; }
	$(PYTHON) -m venv --clear $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $@

demo: $(READY)  ## a recording and three played matches in, knowledge and a trained policy out, which plays
	$(BIN)/pitchlore demo data/samples/rsim-vss-3v3.parquet --data $(DEMO_DATA)

demo-learners: $(READY)  ## a quick look at section 5 of the paper: its learners and their peers
	$(BIN)/pitchlore paradigms --quick --figure 5 --data $(DEMO_DATA)

test: $(READY) lint  ## lint, types, import contracts, tests
	$(BIN)/python -m pytest --numprocesses auto --dist loadfile --no-loadscope-reorder

quick: $(READY)  ## the unit tests: none that is slow or needs a Prefect server
	$(BIN)/python -m pytest -m unit --numprocesses auto --dist loadfile --no-loadscope-reorder

lint: $(READY)  ## style, types, import contracts
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

docs: $(READY)  ## the site, into site/; a broken link fails
	$(BIN)/python docs/reference.py
	$(BIN)/zensical build --clean --strict
	rm site/reference.py

# Each Python has an environment of its own; all that are here must write the same bytes.
pythons:  ## the chain under each Python that is here; a file that differs fails
	rm -f .chain-*.txt
	for python in $(PYTHONS); do \
	  $$python -c 'print()' >/dev/null 2>&1 || { echo "$$python is not here"; continue; }; \
	  $(MAKE) chain PYTHON=$$python VENV=.venv-$$python || exit 1; \
	done
	sha256sum .chain-*.txt
	set -- .chain-*.txt; test $$# -gt 1 || { echo "one Python alone has nothing to differ from"; exit 1; }; \
	  for other; do diff $$1 $$other || exit 1; done

chain: $(READY)
	PYTHONPATH=tests $(BIN)/python -m studies.chain .chain-$(notdir $(PYTHON)).txt

bench: $(READY)  ## ours beside the alternatives, as ratios
	$(BIN)/python -m pytest tests/benchmarks --benchmark-only --benchmark-json=.benchmarks.json
	$(BIN)/python -m tests.benchmarks.ratios .benchmarks.json

study: world paradigms seasons  ## all studies, into data/studies/

world: $(READY)  ## a thousand random matches, each frame looked at (a minute)
	PYTHONPATH=tests $(BIN)/python -m studies.thousand data/studies/world/thousand.json

paradigms: $(READY)  ## section 5 of the paper in full (about 45 minutes)
	$(BIN)/pitchlore paradigms --export data/studies/paradigms
	$(BIN)/pitchlore paradigms --export data/studies/paradigms --figure 4 --figure 5 --runs 2000 --sensitivity
	$(BIN)/pitchlore paradigms --export data/studies/paradigms --figure 6 --runs 200 --sensitivity

# seeds below 101 were for finding settings
SEASON = $(BIN)/pitchlore season --seed 101 --jobs 2 --discard --data $(STUDY_DATA)
EVALUATE = $(BIN)/pitchlore evaluate --export data/studies/evaluations --data $(STUDY_DATA)
IDEAS := bold both-teams constant-steps each-decision grams influence one-match optimistic random-tries \
  short-traces states

seasons: $(READY)  ## sections 4 and 6: the paper's seasons, ours, and what each idea is worth (under 90 minutes)
	$(SEASON) --settings paper --seasons 5
	$(SEASON) --settings paper-full35 --opponent static --opponent human-like --seasons 5
	$(SEASON) --settings paper-level --seasons 5
	$(SEASON) --settings best --opponent static --opponent human-like --seasons 5
	$(SEASON) --settings best-in-games --seasons 5
	for idea in $(IDEAS); do $(SEASON) --settings best-$$idea --games 20 --seasons 3 || exit 1; done
	for other in random static; do \
	  $(EVALUATE) --policy static --against $$other --matches 200 --minutes 2 || exit 1; \
	  for seed in 101 102 103 104 105; do \
	    for ours in best best-in-games; do \
	      $(EVALUATE) --policy $$ours-static-$$seed --against $$other --matches 100 || exit 1; \
	    done; \
	  done; \
	done
	$(BIN)/pitchlore report --export data/studies/seasons --data $(STUDY_DATA)

golden: $(READY)  ## make the goldens anew; review the diff
	PYTHONPATH=tests $(BIN)/python -m golden.cases
	git diff --stat -- tests/golden

notebooks: $(READY)  ## run the notebooks anew and keep what they show; review the diff
	PYTHONPATH=tests $(BIN)/python -m support.notebooks

# One version of a package for all Pythons, so that all give the same bytes.
lock: $(READY)  ## resolve the dependencies anew
	$(BIN)/uv pip compile pyproject.toml --all-extras --group dev --group docs --universal --fork-strategy fewest \
	  --no-strip-extras --generate-hashes --no-emit-index-url --no-header --python-version 3.11 --upgrade --quiet \
	  -o requirements.lock

clean:  ## remove the environment, the site and caches, never the data
	rm -rf $(VENV) $(VENV)-* .chain-*.txt site .cache .mypy_cache .ruff_cache .pytest_cache .import_linter_cache .hypothesis .benchmarks.json
