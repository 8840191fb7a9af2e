# `make demo` and `make test` do all their set-up; they need Python 3.11, 3.12, 3.13 or 3.14, make and git.
PYTHONS := python3.11 python3.12 python3.13 python3.14
ifndef PYTHON
PYTHON := $(firstword $(foreach python,$(PYTHONS),$(if $(shell $(python) -c 'print(1)' 2>/dev/null),$(python))))
endif
VERSION := $(if $(PYTHON),$(shell $(PYTHON) -c 'import platform; print(platform.python_version())' 2>/dev/null))
VENV := .venv
BIN := $(VENV)/bin
# One environment, in three steps: what a user's installation has, the project itself, and the tools of tests.
LOCKED := $(VENV)/.locked-$(VERSION)
PRODUCT := $(VENV)/.product-$(VERSION)
READY := $(VENV)/.ready-$(VERSION)
PIP := $(BIN)/python -m pip install --disable-pip-version-check --no-deps
# Which tests run on one worker, and in which order, says tests/conftest.py.
TESTS := $(BIN)/python -m pytest --numprocesses auto --dist loadfile --no-loadscope-reorder
DEMO_DATA ?= data
STUDY_DATA ?= data
# Recordings that are not part of the project; without a value, ../shared/matches.
RECORDINGS ?=
export PREFECT_SERVER_ANALYTICS_ENABLED := false
# The tests start hundreds of processes: they must find compiled sources.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: help browser pictures counterparts demo demo-learners test compiled quick lint docs pythons chain oldest newest dist bench study fuzz world rules study-labels study-values surely doing study-options ssl-options from-recordings from-recordings-psim ppo-demonstrator imitation-gain rebuilt \
  teams-apart expected-goals usual-codes football ball-goals best-constant transfer paradigms peers check-env check-lerobot seasons sensitivity looking trial penalties tried imitation soak bench-scale golden pages \
  notebooks lock clean

help:  ## list the targets
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/'

# The locks are what is installed: exact versions, checked by hash. Another lock or Python makes the environment
# anew; an edit of pyproject.toml only installs the project again, in seconds.
$(LOCKED): requirements.lock
	@test -n "$(filter $(PYTHONS:python%=%),$(basename $(VERSION)))" || { \
	  echo "pitchlore needs Python 3.11, 3.12, 3.13 or 3.14: make PYTHON=/path/to/python3.14"; exit 1; }
	$(PYTHON) -m venv --clear $(VENV)
	@$(call install,$<)
	@touch $@

$(PRODUCT): $(LOCKED) pyproject.toml
	$(PIP) --quiet --no-build-isolation --editable .
	@touch $@

$(READY): $(PRODUCT) requirements-dev.lock
	@$(call install,requirements-dev.lock)
	@touch $@

# Installs a lock and counts its packages meanwhile; what pip says is shown where it fails.
install = echo "$(1): $$(grep -c '^[a-z0-9]' $(1)) packages into $(VENV)"; rm -f $(VENV)/.whole; \
	{ $(PIP) --progress-bar off --require-hashes --requirement $(1) 2>&1 && touch $(VENV)/.whole; } | \
	tee $(VENV)/pip.log | awk '/^Collecting/ && ++read % 20 == 0 { printf " %d", read; fflush() } \
	  /^Installing/ { printf " read, now written"; fflush() } END { print "" }'; \
	test -e $(VENV)/.whole || { tail -n 20 $(VENV)/pip.log; exit 1; }

# What others wrote to check us against, in an environment of its own: these packages need an old protobuf.
counterparts: .venv-counterparts/.ready  ## sslclient and vsss-client, for tests that skip without them

.venv-counterparts/.ready: tests/counterparts/requirements.txt
	$(PYTHON) -m venv --clear .venv-counterparts
	.venv-counterparts/bin/python -m pip install --quiet --disable-pip-version-check --no-deps -r $<
	@touch $@

demo: $(PRODUCT)  ## a recording and three played matches become knowledge and a policy that plays (3 minutes)
	$(BIN)/pitchlore demo data/samples/rsim-vss-3v3.parquet --flow --data $(DEMO_DATA)

demo-learners: $(PRODUCT)  ## a quick look at section 5 of the paper: its learners and their peers
	$(BIN)/pitchlore paradigms --quick --figure 5 --data $(DEMO_DATA)

test: $(READY) .venv-counterparts/.ready  ## lint, types, import contracts, tests
	@$(MAKE) --no-print-directory --jobs=2 lint compiled
	$(TESTS)

# The first run of the tests finds compiled what takes long to compile: the lint leaves a core idle.
compiled: $(READY)
	PYTHONPATH=tests $(BIN)/python -m support.compiled
	$(BIN)/python -m pytest --collect-only -qq >/dev/null

quick: $(READY)  ## the unit tests: fast, without a Prefect server
	$(TESTS) -m unit --ignore=tests/studies

lint: $(READY)  ## style, types, import contracts
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

docs: $(READY)  ## build the site into site/; a broken link is an error
	rm -rf .site site
	mkdir .site
	cp -r docs zensical.toml .site
	rm .site/docs/reference.py
	$(BIN)/python docs/reference.py .site/docs/reference
	cd .site && $(abspath $(BIN))/zensical build --clean --strict
	mv .site/site site
	rm -r .site

# Each Python has an environment of its own. All installed Pythons must write the same bytes.
pythons:  ## run the chain under each installed Python; a file that differs is an error
	rm -f .chain-*.txt
	for python in $(PYTHONS); do \
	  $$python -c 'print()' >/dev/null 2>&1 || { echo "$$python is not installed"; continue; }; \
	  $(MAKE) chain PYTHON=$$python VENV=.venv-$$python || exit 1; \
	done
	sha256sum .chain-*.txt
	set -- .chain-*.txt; test $$# -gt 1 || { echo "only one Python is installed: nothing to compare"; exit 1; }; \
	  for other; do diff $$1 $$other || exit 1; done

chain: $(READY)
	PYTHONPATH=tests $(BIN)/python -m support.chain .chain-$(notdir $(PYTHON)).txt

# Neither takes the lock: each has an environment of its own. Versions of others may warn of what they will drop.
# The report's golden is left out: names of its games depend on the bytes of Parquet files, which versions write
# differently.
oldest: RESOLUTION := lowest-direct
oldest: $(READY)  ## goldens, systems and flows with the lowest versions that pyproject.toml allows (six minutes)
	$(call tried,oldest)

newest: RESOLUTION := highest
newest: $(READY)  ## the same with the newest versions
	$(call tried,newest)

define tried
	$(PYTHON) -m venv --clear --without-pip $(VENV)-$(1)
	$(BIN)/uv pip install --python $(VENV)-$(1)/bin/python --resolution $(RESOLUTION) --editable .
	$(BIN)/uv pip install --quiet --python $(VENV)-$(1)/bin/python hypothesis pytest pytest-benchmark pytest-xdist
	NUMBA_CACHE_DIR=$(CURDIR)/$(VENV)-$(1)/numba $(VENV)-$(1)/bin/python -m pytest -W default \
	  --deselect 'tests/test_golden.py::test_golden[report/two-games.txt]' \
	  tests/test_golden.py tests/test_system.py tests/test_flows.py
endef

# A release is a tag: the workflow calls this, and publishes what is in dist/.
dist: $(READY)  ## the wheel, into dist/, and its tests; a TAG has to be v and the version
	@test -z "$(TAG)" -o "$(TAG)" = "v$$($(BIN)/python -c 'import pitchlore; print(pitchlore.__version__)')" || { \
	  echo "$(TAG) is not the version"; exit 1; }
	rm -rf dist
	$(BIN)/python -m hatchling build --target wheel --directory dist
	$(BIN)/python -m pytest tests/test_wheel.py tests/test_release.py

bench: $(READY)  ## measure Pitchlore beside the alternatives, as ratios
	$(BIN)/python -m pytest tests/benchmarks --benchmark-only --benchmark-json=.benchmarks.json
	$(BIN)/python -m tests.benchmarks.ratios .benchmarks.json

study: world rules best-constant teams-apart expected-goals ball-goals usual-codes football study-labels study-values surely doing study-options ssl-options from-recordings paradigms seasons sensitivity looking trial penalties  ## most studies, into data/studies/ (about thirteen hours)

# RECORDINGS is a folder of further recordings for the second table; they are read there, not copied.
world: $(READY)  ## check each frame of a thousand random matches, and measure the game (five minutes)
	$(BIN)/python data/studies/world/thousand.py
	$(BIN)/python data/studies/world/game.py $(RECORDINGS)

fuzz: $(READY)  ## ten minutes of broken recordings in every format
	PYTHONPATH=tests $(BIN)/python data/studies/fuzz/study.py 600

# Then fifty rounds of each pair of commands at once, fifty outages of each kind, and a kill at every step.
soak: $(READY)  ## an hour of everything at once on one data folder (two hours with what follows)
	PYTHONPATH=tests $(BIN)/python data/studies/soak/study.py 3600
	PITCHLORE_ROUNDS=50 PITCHLORE_STEPS=1 $(BIN)/python -m pytest --numprocesses auto --dist load --quiet \
	  tests/test_at_once.py tests/test_buckets*.py tests/test_kills.py > data/studies/soak/rounds.txt || { cat data/studies/soak/rounds.txt; exit 1; }

bench-scale: $(READY)  ## what a run costs with 10, 100 and 1,000 matches (seven minutes)
	$(BIN)/python data/studies/scale/study.py

browser:  ## chromium from Debian's packages, for the tests of pages; where it cannot be had they skip
	@command -v chromium >/dev/null || { [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null && \
	  timeout 120 apt-get update -qq && timeout 300 apt-get install -qq -y --no-install-recommends chromium \
	  >/dev/null; } || echo "no browser: the tests of pages skip"

teams-apart: $(READY)  ## does what robots do tell who plays? (two minutes)
	$(BIN)/python data/studies/scout/teams_apart.py

football: $(READY)  ## football's possession, touches and situations beside the provider's (three minutes; RECORDINGS as above)
	$(BIN)/python data/studies/football/study.py $(RECORDINGS)

usual-codes: $(READY)  ## what situations each kind of match usually shows (two minutes; RECORDINGS as above)
	$(BIN)/python data/studies/usual/study.py $(RECORDINGS)

expected-goals: $(READY)  ## do shots become goals as often as xG says? (five minutes; RECORDINGS as above)
	$(BIN)/python data/studies/scout/expected_goals.py $(RECORDINGS)

ball-goals: $(READY)  ## are goals found from the ball those of the score? (five minutes; RECORDINGS as above)
	$(BIN)/python data/studies/ball_goals/study.py $(RECORDINGS)

rules: $(READY)  ## what each rule of the static team is worth (a quarter of an hour)
	$(BIN)/python data/studies/world/rules.py

best-constant: $(READY)  ## search for the best constant team, which the name best-constant plays (ten minutes)
	$(BIN)/python data/studies/best_constant/study.py

# LEARNERS: the settings of some seasons (looking-held); then the rows of others stay as they are.
looking: $(READY)  ## does a team that looks win? apprentices against the panel, and blind (six hours; LEARNERS)
	$(BIN)/python data/studies/looking/study.py $(STUDY_DATA) $(LEARNERS)

# It plays apprentices that `make looking` has trained.
trial: $(READY)  ## is a second of looking worth more than one of the best constant? randomised trials (half an hour; LEARNERS)
	$(BIN)/python data/studies/looking/trial.py $(STUDY_DATA) $(LEARNERS)

penalties: $(READY)  ## what becomes of the apprentices with fewer penalties, and with the goalkeeper on its line (a quarter of an hour)
	$(BIN)/python data/studies/looking/penalties.py $(STUDY_DATA)

# It takes the results of seasons, imitation and peers that are in data/studies.
tried: $(READY)  ## which kinds of learners were tried, their curves (seconds)
	$(BIN)/python data/studies/looking/tried.py

imitation: $(READY)  ## is watching worth anything? ten seasons each of two ways to watch, and of none (three hours)
	$(BIN)/python data/studies/imitation/study.py $(STUDY_DATA)

# rSim has no wheel and needs ODE. RSIM and PSIM are Pythons with rc-robosim and with pSim, TEAMS are seasons of STUDY_DATA.
transfer: $(READY)  ## does a team play in others' simulators as in our arena? (three minutes a team in pSim, half an hour in rSim; RSIM, PSIM, TEAMS)
	$(BIN)/python data/studies/transfer/study.py $(or $(RSIM),-) $(or $(PSIM),-) $(STUDY_DATA) $(TEAMS)

# Each peer's library has an environment of its own. It takes the apprentices that `make looking` has trained.
peers: $(READY) $(VENV)-sb3/.ready $(VENV)-d3rlpy/.ready  ## other learners on the same pitch: PPO, DQN, BC, CQL (five hours)
	$(BIN)/python data/studies/peers/study.py $(STUDY_DATA)

check-env: $(VENV)-sb3/.ready  ## stable-baselines3's own check of the environments, and its trainings (`make test` skips them: they need torch)
	$(VENV)-sb3/bin/python -m pytest tests/test_env.py tests/studies/test_peers_study.py

check-lerobot: $(READY)  ## LeRobot's own loader on a dataset of ours (LEROBOT is a Python that has it; `make test` skips it)
	LEROBOT=$(or $(LEROBOT),python) $(BIN)/python -m pytest tests/test_datasets.py -k lerobot_reads_it

$(VENV)-sb3/.ready: requirements-dev.lock data/studies/peers/sb3.txt
	$(PYTHON) -m venv --clear $(VENV)-sb3
	$(VENV)-sb3/bin/python -m pip install --quiet --no-deps --require-hashes -r requirements-dev.lock
	$(VENV)-sb3/bin/python -m pip install --quiet --no-deps --no-build-isolation -e .
	$(VENV)-sb3/bin/python -m pip install --quiet -r data/studies/peers/sb3.txt
	@touch $@

$(VENV)-d3rlpy/.ready: data/studies/peers/d3rlpy.txt
	$(PYTHON) -m venv --clear $(VENV)-d3rlpy
	$(VENV)-d3rlpy/bin/python -m pip install --quiet -r data/studies/peers/d3rlpy.txt
	@touch $@

study-values: $(READY)  ## whether V and the values of behaviours predict (a quarter of an hour; RECORDINGS as above)
	$(BIN)/python data/studies/values/study.py $(RECORDINGS)
	$(BIN)/python data/studies/values/shipped.py
	$(BIN)/python data/studies/values/level.py $(RECORDINGS)

pictures: $(READY)  ## each page of the scout as OLD=…/bin/pitchlore makes it, and as it is now (a quarter of an hour)
	$(BIN)/python data/studies/pages/study.py $(STUDY_DATA)/pages data/studies/pages $(OLD)

surely: $(READY)  ## of behaviours said to go surely with better or worse chances, how many do in other matches (ten minutes)
	$(BIN)/python data/studies/surely/study.py $(STUDY_DATA)/surely
	$(BIN)/python data/studies/surely/acts.py $(STUDY_DATA)/surely

doing: $(READY)  ## a value of doing a behaviour, beside random draws; and the best inserted (twenty minutes)
	$(BIN)/python data/studies/doing/study.py $(STUDY_DATA)/doing

study-options: $(READY)  ## ratios and classes of options, and what is recovered beside what was done (an hour)
	$(BIN)/python data/studies/options/shipped.py
	$(BIN)/python data/studies/options/drawn.py
	$(BIN)/python data/studies/options/alike.py
	$(BIN)/python data/studies/options/study.py

ssl-options: $(READY)  ## options of robots of SSL that drive in all directions (ten minutes; RECORDINGS as above)
	$(BIN)/python data/studies/omnidirectional/study.py $(RECORDINGS)
	$(BIN)/python data/studies/omnidirectional/playing.py $(RECORDINGS)

from-recordings: $(READY)  ## copies of six teams from their recordings, all of the study (four and a half hours; PSIM=PYTHON: two and a half more, in pSim)
	$(BIN)/python data/studies/from_recordings/everything.py $(or $(PSIM),-)

# The network lies in the study's folder; other processors may train a slightly other one.
ppo-demonstrator: $(VENV)-sb3/.ready  ## train the PPO that from-recordings copies (twenty minutes of a core)
	PYTHONPATH=data/studies $(VENV)-sb3/bin/python -m peers.online ppo 2026 data/from-recordings/networks --matches 1400
	cp data/from-recordings/networks/ppo-2026-1400.npz data/studies/from_recordings/

from-recordings-psim: $(READY)  ## the same in pSim (PSIM is a Python that has it; half an hour a team, after from-recordings)
	$(BIN)/python data/studies/from_recordings/psim.py $(or $(PSIM),python) data/from-recordings $(TEAMS)
	$(BIN)/python data/studies/from_recordings/recovered.py data/from-recordings

rebuilt: $(READY)  ## copies as stand-ins for their originals (half an hour, after from-recordings; and half an hour of seasons)
	$(BIN)/python data/studies/from_recordings/rebuilt.py

imitation-gain: $(READY)  ## what an apprentice gains that starts as a copy: ten pairs of seasons, and a control (over an hour, after from-recordings)
	$(BIN)/python data/studies/from_recordings/gain.py

study-labels: $(READY)  ## the recogniser beside the labels of 200 moments and the kicks that 2D servers count (30 s)
	$(BIN)/python data/studies/labels/study.py $(RECORDINGS)

# STUDY_DATA keeps what was played: a study that was stopped goes on.
paradigms: $(READY)  ## section 5 of the paper in full (about 50 minutes on two free cores)
	$(BIN)/python data/studies/paradigms/study.py $(STUDY_DATA)

seasons: $(READY)  ## sections 4 and 6: the paper's seasons, ours, and an ablation of each idea (about three hours on two free cores)
	$(BIN)/python data/studies/seasons/study.py $(STUDY_DATA)

sensitivity: $(READY)  ## the paper's seasons with each setting that it leaves open (40 minutes on two free cores)
	$(BIN)/python data/studies/sensitivity/study.py $(STUDY_DATA)

golden: $(READY)  ## write the goldens anew; review the diff
	PYTHONPATH=tests $(BIN)/python -m golden.cases
	git diff --stat -- tests/golden

pages: $(READY)  ## write the outputs anew that README and docs show; review the diff
	PYTHONPATH=tests $(BIN)/python -m support.shown
	git diff --stat -- README.md docs

notebooks: $(READY)  ## run the notebooks anew and keep their outputs; review the diff
	PYTHONPATH=tests $(BIN)/python -m support.notebooks

# All Pythons get the same version of a package, so they write the same bytes. The product's lock begins as a copy
# of the other one, whose versions it keeps.
RESOLVE := $(BIN)/uv pip compile pyproject.toml --universal --fork-strategy fewest --python-version 3.11 \
  --no-strip-extras --generate-hashes --no-emit-index-url --no-header --quiet
lock: $(READY)  ## resolve the dependencies anew
	$(RESOLVE) --all-extras --group dev --group docs --upgrade --output-file requirements-dev.lock
	cp requirements-dev.lock requirements.lock
	$(RESOLVE) --group build --output-file requirements.lock

clean:  ## remove the environment, the site and the caches; data stays
	rm -rf $(VENV) $(VENV)-* .chain-*.txt site dist .cache .mypy_cache .ruff_cache .pytest_cache .import_linter_cache .hypothesis .benchmarks.json
