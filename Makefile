# twbal: `make run` and `make test` work in a fresh clone with nothing but Python 3.11 and make.

IS_311 := import sys; sys.exit(sys.version_info[:2] != (3, 11))
PYTHON ?= $(shell for p in python3.11 python3 python /usr/bin/python3.11; do \
            $$p -c '$(IS_311)' 2>/dev/null && { echo $$p; break; }; done)
VENV := .venv
STAMP := $(VENV)/.installed
BENCH_STAMP := $(VENV)/.installed-bench
SWEEPS_STAMP := $(VENV)/.installed-sweeps

.DEFAULT_GOAL := help
.PHONY: help run test test-slow bench bench-hidden lint clean

help: ## list what can be made
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' $(MAKEFILE_LIST) | expand -t 12

run: $(STAMP) ## Algorithm 1 from start to end on the virtual robot (makes the environment first)
	$(VENV)/bin/twbal iterate

# One file's tests stay in one process, as they share what is costly to make.
test: $(STAMP) ## the quick tests, on two cores
	$(VENV)/bin/python -m pytest -m "not slow" --numprocesses=2 --dist=loadfile

test-slow: $(STAMP) $(SWEEPS_STAMP) ## the longer tests (needs the launchers of sweeps: extra [sweeps])
	$(VENV)/bin/python -m pytest -m slow

bench: $(STAMP) $(BENCH_STAMP) ## the benchmarks behind the tables (two hours; needs the peers: extra [bench])
	$(VENV)/bin/python -m benchmarks

bench-hidden: $(STAMP) $(BENCH_STAMP) ## hide effects in another engine and diagnose them (an hour and a half and more on two cores)
	$(VENV)/bin/python -m benchmarks.hidden_effects all seeds=5,6,7,8,9 workers=2

lint: $(STAMP) ## style and types
	$(VENV)/bin/ruff check
	$(VENV)/bin/ruff format --check
	$(VENV)/bin/mypy

clean: ## remove the environment and what tools leave behind (outputs/ stays)
	rm -rf $(VENV) build dist .pytest_cache .ruff_cache .mypy_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# The environment: remade when what it is made from changes. Versions are pinned in constraints.txt.
$(STAMP): pyproject.toml constraints.txt
	@"$(PYTHON)" -c '$(IS_311)' 2>/dev/null || { echo "twbal needs Python 3.11 (PyBullet has wheels for no other)," \
	  "$(if $(PYTHON),and '$(PYTHON)' is not that,and none was found). Try: make PYTHON=/path/to/python3.11" >&2; exit 1; }
	rm -rf $(VENV)
	"$(PYTHON)" -m venv $(VENV)
	$(VENV)/bin/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable ".[dev]"
	$(VENV)/bin/python -m compileall -q twbal
	$(VENV)/bin/python -m twbal.cli.warm
	@touch $@

$(BENCH_STAMP): $(STAMP)
	$(VENV)/bin/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable ".[bench]"
	@touch $@

$(SWEEPS_STAMP): $(STAMP)
	$(VENV)/bin/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable ".[sweeps]"
	@touch $@
