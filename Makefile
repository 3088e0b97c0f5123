# Every command makes the environment it needs: .venv, refreshed whenever pyproject.toml changes.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
CHROMIUM := chromium chromium-browser google-chrome

DOCS := docs/_build/html

.PHONY: demo docs docs-check test check bounds coverage mutants fuzz bench bench-planners bench-pairs bench-premises bench-page \
    bench-survey bench-survey-runs bench-survey-workers bench-proofs bench-stuck bench-queries picture browser format clean
.DELETE_ON_ERROR:

demo: $(VENV)/.installed ## plan, prove and show a field; writes demo/plan.fits and demo/plan.html
	$(BIN)/fiberplan demo -o demo

test: check ## everything that must hold before a change lands
	$(BIN)/pytest -n 2 --dist loadgroup

check: $(VENV)/.test
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache
	$(BIN)/repo-review . --show err

bounds: $(VENV)/.test ## the planners' promises once with every array access checked; its compiled kernels are kept apart
	NUMBA_OPT=1 NUMBA_BOUNDSCHECK=1 $(BIN)/pytest -q -n 2 --dist loadgroup tests/test_bounds.py # a planner is compiled once, and sooner

mutants: $(VENV)/.test ## does a test notice every wrong kernel? 300 of them (OPTIONS=--sample=9999: all, an hour or more); goes on where it was stopped
	nice $(BIN)/python tests/mutants.py $(OPTIONS)

coverage: $(VENV)/.test ## statements that small tests run, kernels included: the compiler is off, and no real data
	NUMBA_DISABLE_JIT=1 FIBERPLAN_NO_DATA=1 $(BIN)/pytest -n 2 -m "small and not large and not slow" \
	    --cov --cov-report=term-missing:skip-covered

fuzz: $(VENV)/.test ## random campaigns, three minutes; OPTIONS="--seed 1000 --only plans" for others
	PYTHONPATH=tests $(BIN)/python -m fuzz $(OPTIONS)

bench: $(VENV)/.installed ## the figures of the README
	$(BIN)/python benchmarks/bench.py

bench-planners: $(VENV)/.installed ## every planner on every scene; OPTIONS="--quick" for the small ones
	$(BIN)/python benchmarks/planners.py $(OPTIONS)

bench-pairs: $(VENV)/.installed ## every planner and verify against another commit, timed in turn; BASE=COMMIT
	$(BIN)/python benchmarks/pairs.py $(BASE) $(OPTIONS)

bench-survey: $(VENV)/.installed ## allocation: conflict tables, solvers, motion in the loop, ties; OPTIONS="--only ties" for a part
	nice $(BIN)/python benchmarks/survey.py $(OPTIONS)

bench-survey-runs: $(VENV)/.installed ## surveys: overhead, kills, many fields; OPTIONS="--only kills" for a part
	nice $(BIN)/python benchmarks/survey_runs.py $(OPTIONS)

bench-survey-workers: $(VENV)/.installed ## surveys: two processes against one; OPTIONS="--full" for 547 robots
	nice $(BIN)/python benchmarks/survey_workers.py $(OPTIONS)

bench-proofs: $(VENV)/.test ## certificates and their replay, false certificates, planted contacts; OPTIONS="--planted 0" for a part
	nice $(BIN)/python benchmarks/proofs.py $(OPTIONS)

bench-stuck: $(VENV)/.installed ## stuck robots, pairs and triples: a path, or a proof that there is none; OPTIONS="--robots 2"
	nice $(BIN)/python benchmarks/stuck.py $(OPTIONS)

bench-queries: $(VENV)/.test ## do two moving arms touch? exact answers, and who gives others; OPTIONS="--out queries.jsonl" keeps them
	nice $(BIN)/python benchmarks/queries.py $(OPTIONS)

bench-premises: $(VENV)/.installed ## starts, machines and targets as they are; OPTIONS="--only touching --trials 20" for a part
	nice $(BIN)/python benchmarks/premises.py $(OPTIONS)

bench-page: $(VENV)/.test ## the HTML page: its size, how soon it opens, frames a second; needs Chromium
	$(BIN)/python benchmarks/page.py $(OPTIONS)

docs: $(VENV)/.docs ## the manual as a web site: docs/_build/html/docs/index.html; every example is run, and a warning is an error
	$(BIN)/sphinx-build -q -W --keep-going -b html -c docs . $(DOCS)

docs-check: docs $(VENV)/.test ## the built manual's accessibility, page by page; needs Chromium
	$(BIN)/python docs/accessibility.py $(DOCS)

picture: demo ## the film of the README: a plan from field to field of the sdss array
	$(BIN)/fiberplan animate demo/plan.fits --speed 8 --fps 8 --size 560 -o docs/plan.gif

browser: ## Chromium, for the test of the HTML page
	@for name in $(CHROMIUM); do command -v $$name >/dev/null && exit 0; done; \
	if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	    apt-get update -qq && apt-get install -y -qq --no-install-recommends chromium; \
	else \
	    echo "install Chromium with your system's package manager (looked for: $(CHROMIUM))" >&2; exit 1; \
	fi

format: $(VENV)/.test
	$(BIN)/ruff format
	$(BIN)/ruff check --fix

clean: ## everything that make made
	rm -rf $(VENV) demo docs/_build docs/_examples build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis .coverage
	find src tests benchmarks docs -name __pycache__ -prune -exec rm -rf {} + 2>/dev/null || true

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit("fiberplan needs Python 3.11 or newer" if sys.version_info < (3, 11) else 0)'
	$(PYTHON) -m venv $(VENV)

$(VENV)/.installed: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	@touch $@

$(VENV)/.test: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[test]'
	@touch $@ $(VENV)/.installed

$(VENV)/.docs: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[docs,proof]'
	@touch $@ $(VENV)/.installed
