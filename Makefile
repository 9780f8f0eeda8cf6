# `make demo` and `make test` work on a fresh machine with Python >= 3.11, git and make; `make help` lists the rest.

PYTHON  ?= python3
# Processes that run tests side by side.
WORKERS ?= 2

VENV := .venv
BIN  := $(VENV)/bin
RUN  := $(BIN)/python
# Python compiles a module when it is first imported. To compile all that is installed takes twice as long as to install it.
INSTALL := $(RUN) -m pip --disable-pip-version-check --no-input install --no-compile
# The second option pins what builds packages, the first what they need to run.
PINS := --constraint constraints.txt --build-constraint constraints.txt

# pyright would otherwise ask the network for a newer release at each start.
export PYRIGHT_PYTHON_IGNORE_WARNINGS := 1

# Empty: Python keeps what it compiled, even where the shell forbids it; else each test process compiles all tests anew.
export PYTHONDONTWRITEBYTECODE :=

.DEFAULT_GOAL := help
.NOTPARALLEL:
.DELETE_ON_ERROR:
.PHONY: help demo monitor test test-slow bench docs wheel lint format types contract clean distclean

help: ## show this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-10s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

# ---------------------------------------------------------------------------------------------- environment
# One environment in .venv. A stamp per set of packages makes the second call instant and is outdated by a
# change of what is required or pinned.

BASE    := $(VENV)/base.stamp
RUNTIME := $(VENV)/runtime.stamp
MONITOR := $(VENV)/monitor.stamp
DEV     := $(VENV)/dev.stamp
BENCH   := $(VENV)/bench.stamp
DOCS    := $(VENV)/docs.stamp

$(BASE): constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || { \
	    echo "error: PYTHON must be Python 3.11 or newer, got $$($(PYTHON) --version 2>&1);" \
	         "name another with make PYTHON=/path/to/python3." >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
	    echo "error: PYTHON must come with the modules venv and ensurepip, which $(PYTHON) lacks;" \
	         "install them (Debian: the package python3-venv) or name another with make PYTHON=/path/to/python3." >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(INSTALL) --quiet --constraint constraints.txt pip
	@touch $@

$(RUNTIME): pyproject.toml constraints.txt | $(BASE)
	$(INSTALL) --editable . $(PINS)
	@touch $@

$(MONITOR): pyproject.toml constraints.txt | $(BASE)
	$(INSTALL) --editable '.[monitor]' $(PINS)
	@touch $(RUNTIME) $@

# What tests need includes what the demo and the monitor need, so all three stamps are fresh after it.
$(DEV): pyproject.toml constraints.txt | $(BASE)
	$(INSTALL) --editable '.[dev]' $(PINS)
	@touch $(RUNTIME) $(MONITOR) $@

$(BENCH): pyproject.toml constraints.txt | $(BASE)
	$(INSTALL) --editable '.[bench]' $(PINS)
	@touch $(RUNTIME) $@

# The API is written from docstrings, so all that the packages import must be there.
$(DOCS): pyproject.toml constraints.txt | $(BASE)
	$(INSTALL) --editable '.[dev,docs]' $(PINS)
	@touch $(RUNTIME) $(MONITOR) $(DEV) $@

# ---------------------------------------------------------------------------------------------- main job

# A twin of four faults and few records, so that the demo stays short; without these settings it is a better one.
DEMO_TWIN := faults=[crack,loose_base,reducer_play,friction] simulated=5000
DAYS := monday tuesday wednesday

demo: $(RUNTIME) ## make the Table 2 data set, train on it, diagnose one record; then the twin of a bench; results in demo/
	@rm -rf demo/table2 demo/model demo/diagnosis demo/bench demo/twin demo/answers
	$(BIN)/indexer generate campaign=table2 out=demo/table2
	$(BIN)/indexer train data=demo/table2 out=demo/model
	$(BIN)/indexer diagnose model=demo/model measured=demo/table2/example.csv out=demo/diagnosis
	$(RUN) -m examples.twin_bench demo/bench
	$(BIN)/indexer twin healthy=demo/bench/healthy machine=reference out=demo/twin $(DEMO_TWIN)
	@mkdir demo/answers
	@printf '%s\n' $(DAYS) | xargs -P 2 -I DAY sh -c \
	    '$(BIN)/indexer twin-diagnose twin=demo/twin signal=demo/bench/days/DAY >demo/answers/DAY.txt'
	@for day in $(DAYS); do echo "$$day:"; cat demo/answers/$$day.txt; done
	@echo "The twin: demo/twin/report.html"
	@echo "Pictures:"
	@find demo -name '*.png' | sort | sed 's/^/  /'
	@echo "Next, machines that wear out before your eyes: make monitor"

monitor: $(MONITOR) ## watch simulated machines wear out on a page of this host; Ctrl-C ends
	$(BIN)/indexer monitor

bench: $(BENCH) ## measure speed and accuracy beside other solvers; fills the table in benchmarks/README.md
	$(RUN) -m benchmarks

docs: $(DOCS) ## build the site in docs/_build; a warning or a broken link is an error
	$(BIN)/sphinx-build --builder html --fail-on-warning --keep-going --quiet --jobs auto docs docs/_build
	@echo "The site: docs/_build/index.html"

# Each file goes into an environment that holds nothing else, and is run in a folder without the checkout.
wheel: $(DEV) ## build wheel and sdist in dist/ and prove each in an empty environment
	rm -rf dist build
	$(RUN) -m build --no-isolation
	@for file in dist/*.whl dist/*.tar.gz; do \
	    echo "== $$file"; \
	    rm -rf build/empty && $(PYTHON) -m venv build/empty && \
	    build/empty/bin/python -m pip install --quiet --disable-pip-version-check "$$file" --constraint constraints.txt && \
	    (cd build/empty && bin/indexer --version && bin/indexer simulate out=record) || exit 1; \
	done

# ---------------------------------------------------------------------------------------------- checks

# Tests stay in their order and go over to a worker without work one by one: what a file sets up is set up once.
PYTEST := $(RUN) -m pytest -n $(WORKERS) --dist worksteal

test: $(DEV) ## run the tests, then the kernel tests again without compilation
	$(PYTEST)
	NUMBA_DISABLE_JIT=1 $(RUN) -m pytest -m "unjitted and not slow and not gpu" $$(grep -rl --include='test_*.py' mark.unjitted tests)

test-slow: $(DEV) ## run the tests marked slow, which `make test` leaves out
	$(PYTEST) -m "slow and not gpu"

lint: $(DEV) ## check style and format (ruff)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

format: $(DEV) ## repair style and format where ruff can
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

types: $(DEV) ## check types (pyright)
	$(BIN)/pyright

contract: $(DEV) ## check who may import whom (import-linter)
	$(BIN)/lint-imports --no-logo

# ---------------------------------------------------------------------------------------------- cleaning

clean: ## remove demo results, built files and caches
	rm -rf demo build dist docs/_build docs/reference/api docs/reference/commands docs/reference/settings .hypothesis .import_linter_cache .pytest_cache .ruff_cache
	find . -path ./$(VENV) -prune -o -name __pycache__ -type d -prune -exec rm -rf {} +

distclean: clean ## remove the environment too
	rm -rf $(VENV)
