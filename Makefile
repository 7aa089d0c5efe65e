# Every target does all it needs on a machine with Python 3.11-3.14 and make: the exact pinned
# versions go into .venv once, and again when requirements.txt or pyproject.toml changes.

# Tests start processes: their byte code is kept, whatever the shell says.
export PYTHONDONTWRITEBYTECODE :=

PYTHON ?= python3
BIN := .venv/bin
READY := .venv/ready

.PHONY: help demo test test-fast check slow fuzz reliability claims docs pictures gallery bench bench-peer peer clean

help:
	@echo "make demo        simulate, calibrate, evaluate and report the default scenario into runs/demo"
	@echo "make test        the fast tests"
	@echo "make test-fast   the fast tests of one folder while working: make test-fast FOLDER=twin"
	@echo "make check       format, lint, types"
	@echo "make slow        the tests that take minutes"
	@echo "make fuzz        random damage to every kind of file, 30 minutes, or FUZZ_SECONDS=N"
	@echo "make reliability try every hostile case into docs/reliability.md"
	@echo "make claims      measure the claims on ten fixed and ten sampled robots into docs/claims.md (half an hour)"
	@echo "make docs        the documentation site into docs/_site, offline once its tools are installed"
	@echo "make pictures    pictures and figures of the README and the documents from runs/demo; needs Chromium"
	@echo "make gallery     short runs of the other scenarios, for their results in the gallery"
	@echo "make bench       the benchmarks"
	@echo "make bench-peer  geometric calibration beside FIGAROH's, in an environment of its own"
	@echo "make peer        FIGAROH 1.0.2 in .venv-peer, for tiago-twin peer"
	@echo "make clean       remove .venv, caches and built files; runs/ stays"

demo: $(READY)
	$(BIN)/tiago-twin run humanoids2024 --out runs/demo

test: $(READY)
	$(BIN)/python -m pytest -q -n 2 --dist loadfile

FOLDER ?= calibration

test-fast: $(READY)
	$(BIN)/python -m pytest -q -n 2 --dist loadfile tests/$(FOLDER)

check: $(READY)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

slow: $(READY)
	$(BIN)/python -m pytest -q -m slow -n 2 --dist loadfile

fuzz: $(READY)
	FUZZ_SECONDS=$${FUZZ_SECONDS:-1800} $(BIN)/python -m tests.hostile.fuzz

reliability: $(READY)
	$(BIN)/python -m tests.hostile.page

claims: $(READY)
	$(BIN)/python -m pytest -q -m slow tests/acceptance/test_ladder.py
	$(BIN)/python -m tests.acceptance.claims

docs: $(READY) .venv/docs-ready
	$(BIN)/python docs/reference.py
	$(BIN)/sphinx-build -q -W --keep-going -b html docs docs/_site
	@echo "docs/_site/index.html"

.venv/docs-ready: docs/requirements.txt $(READY)
	@$(BIN)/python -m pip install -qq --disable-pip-version-check -r docs/requirements.txt
	@touch $@

pictures: $(READY)
	$(BIN)/tiago-twin report runs/demo
	$(BIN)/python docs/pictures.py runs/demo
	$(BIN)/python docs/evidence.py runs/demo

gallery: $(READY)
	for name in $$($(BIN)/tiago-twin list | cut -d' ' -f1 | grep -v -e humanoids2024 -e swing20); do \
	  $(BIN)/tiago-twin run $$name --quick --out runs/gallery/$$name && \
	  $(BIN)/python docs/evidence.py runs/gallery/$$name || exit 1; done

bench: $(READY)
	$(BIN)/python -m pytest -q -s -m "" -o python_files='bench_*.py' tests/bench --ignore=tests/bench/bench_peer.py

bench-peer: $(READY) .venv-peer/ready
	$(BIN)/python -m pytest -q -s -m "" -o python_files='bench_peer.py' tests/bench

peer: .venv-peer/ready

.venv-peer/ready:
	@echo "Installing the peer, FIGAROH 1.0.2, into .venv-peer (once, about 1 GB)"
	@$(PYTHON) -m venv .venv-peer
	@.venv-peer/bin/python -m pip install -qq --disable-pip-version-check figaroh==1.0.2
	@touch $@

$(READY): requirements.txt pyproject.toml scenarios/testing/pytest_plugin.py
	@$(PYTHON) -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 14))' || { \
	  echo "Python 3.11 to 3.14 is needed; $(PYTHON) is $$($(PYTHON) --version 2>&1 | head -1)."; \
	  echo "Name another one: make PYTHON=python3.12 $(MAKECMDGOALS)"; exit 1; }
	@echo "Installing the pinned packages into .venv (once, 1.4 GB)"
	@$(PYTHON) -m venv .venv || { \
	  echo "$(PYTHON) cannot create a virtual environment; on Debian and Ubuntu: apt install python3-venv"; exit 1; }
	@$(BIN)/python -m pip install -qq --disable-pip-version-check -r requirements.txt
	@$(BIN)/python -m pip install -qq --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@found=$$($(BIN)/python -m pip check --disable-pip-version-check) || { echo "$$found"; exit 1; }
	@touch $@

clean:
	rm -rf .venv .venv-peer dist docs/_site docs/reference .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
