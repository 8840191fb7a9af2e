# `make demo` and `make test` do all their set-up; they need Python 3.11, make and git.
PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
DEMO_DATA ?= data
STUDY_DATA ?= data
export PREFECT_SERVER_ANALYTICS_ENABLED := false

.PHONY: help demo test lint bench study world paradigms seasons golden lock clean

help:  ## show what can be made
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/'

# The lock is what is installed: exact versions, checked by hash.
$(READY): requirements.lock pyproject.toml
	@command -v $(PYTHON) >/dev/null || { echo "pitchlore needs Python 3.11: make PYTHON=/path/to/python3.11"; exit 1; }
	$(PYTHON) -m venv --clear $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $@

demo: $(READY)  ## a recording and three played matches in, knowledge and a trained policy out, which plays
	$(BIN)/pitchlore import data/samples/rsim-vss-3v3.parquet --data $(DEMO_DATA)
	$(BIN)/pitchlore record --home static --away static --matches 3 --minutes 4 --data $(DEMO_DATA)
	$(BIN)/pitchlore run --data $(DEMO_DATA)
	$(BIN)/pitchlore record --home learned --away static --minutes 4 --data $(DEMO_DATA)
	$(BIN)/pitchlore paradigms --quick --figure 5 --data $(DEMO_DATA)

test: $(READY) lint  ## lint, types, import contracts, tests
	$(BIN)/python -m pytest --numprocesses auto --dist loadfile

lint: $(READY)  ## style, types, import contracts
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

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

lock: $(READY)  ## resolve the dependencies anew
	$(BIN)/uv pip compile pyproject.toml --group dev --universal --no-strip-extras --generate-hashes \
	  --no-emit-index-url --no-header --python-version 3.11 --upgrade --quiet -o requirements.lock

clean:  ## remove the environment and caches, never the data
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .import_linter_cache .hypothesis .benchmarks.json
