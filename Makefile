# What people and CI run. A target sets up .venv first, if pyproject.toml or constraints.txt changed.

VENV := .venv
BIN := $(VENV)/bin
PEERS := $(VENV)/peers
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt
FITNESS := import sys; \
  sys.version_info >= (3, 11) or sys.exit("too old: " + sys.version.split()[0]); \
  import ensurepip, venv

# As `import farside` says it (farside/__init__.py).
ifeq ($(wildcard farside/dem/.),)
  $(error Expected the symbolic link farside/dem -> ../dem, found none: this checkout was made \
    without symbolic links. Clone again with `git clone -c core.symlinks=true`)
endif

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.NOTPARALLEL:
.PHONY: help mission test lint bench study reference picture clean

help: ## list the targets
	@sed -n 's/^\([a-z]*\):.*## /\1\t/p' Makefile | expand -t 10

mission: $(VENV)/.ready-to-run ## fly the first mission, missions/blackout.toml
	$(BIN)/farside run missions/blackout.toml

test: $(VENV)/.ready-to-develop ## run every test
	$(BIN)/python -m pytest -n auto --dist worksteal

lint: $(VENV)/.ready-to-develop ## check style, types and the direction of imports
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: export PYTHONPATH := tests/helpers
bench: $(VENV)/.ready-to-develop $(VENV)/.ready-to-compare ## measure simulated seconds per wall second
	$(BIN)/python tests/bench/run.py
	$(BIN)/python tests/bench/long_runs.py
	$(BIN)/python tests/bench/logs.py
	$(BIN)/python tests/bench/reports.py
	$(BIN)/python tests/bench/link_channel.py
	$(BIN)/python tests/bench/link_emulator.py
	$(BIN)/python tests/bench/link_queries.py
	$(BIN)/python tests/bench/dem_cycle.py
	$(BIN)/python tests/bench/dem_map.py
	$(BIN)/python tests/bench/dem_expected.py
	$(BIN)/python tests/bench/dem_worlds.py
	$(BIN)/python tests/bench/dem_aliased.py
	$(BIN)/python tests/bench/gym_table.py
	$(BIN)/python tests/bench/environment.py
	$(BIN)/python tests/bench/console.py
	$(BIN)/python tests/bench/peers/table.py
	PYTHONHASHSEED=0 PYTHONPATH=$(PYTHONPATH):$(PEERS) $(BIN)/python tests/bench/peers/acs2_table.py
	$(BIN)/python tests/bench/dem_claims.py

study: export PYTHONPATH := tests/helpers
study: $(VENV)/.ready-to-develop ## run the studies, and write docs/study.md and its pictures
	$(BIN)/python tests/study/study.py

reference: $(VENV)/.ready-to-develop ## write the reference in docs/mission.md, and docs/failsafe.html
	$(BIN)/python docs/mission.py
	$(BIN)/python docs/failsafe.py

picture: export PYTHONPATH := tests/helpers
picture: $(VENV)/.ready-to-develop ## draw docs/blackout.svg, docs/policy-map.svg, and docs/console/* with chromium
	$(BIN)/python docs/picture.py
	$(BIN)/python docs/policy_map.py
	$(BIN)/python docs/console.py

clean: ## remove .venv, caches and builds; logs stay
	rm -rf $(VENV) build dist .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find farside dem link rover ground console logs missions tests -name __pycache__ -prune -exec rm -rf {} +

$(VENV)/.ready-to-run: pyproject.toml constraints.txt | $(BIN)/pip
	@echo "Installing Farside into $(VENV)"
	@$(INSTALL) --editable '.[console]'
	@touch $@

$(VENV)/.ready-to-develop: pyproject.toml constraints.txt | $(BIN)/pip
	@echo "Installing Farside and its development tools into $(VENV)"
	@$(INSTALL) --editable '.[dev,astropy,console,figures,gymnasium,spice,tables]'
	@touch $@ $(VENV)/.ready-to-run

# pyalcs brings packages named `tests` and `examples`, so it stays out of the others' way.
$(VENV)/.ready-to-compare: constraints.txt | $(BIN)/pip
	@echo "Installing pyalcs into $(PEERS)"
	@$(INSTALL) --no-deps --upgrade --target $(PEERS) pyalcs
	@touch $@

$(BIN)/pip:
	@tried=""; \
	for python in python3.11 python3; do \
	  if found=$$($$python -c '$(FITNESS)' 2>&1); then exec $$python -m venv $(VENV); fi; \
	  tried="$$tried\n  $$python: $$(echo "$$found" | tail -n 1)"; \
	done; \
	printf '%b\n' "Expected Python 3.11 or later with venv and ensurepip, found:$$tried" \
	  "On Debian and Ubuntu: apt-get install python3 python3-venv" >&2; \
	exit 1
