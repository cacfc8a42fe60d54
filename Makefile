# Two commands are enough: `make demo` shows the package, `make test` checks it.
.DEFAULT_GOAL := help
.PHONY: help setup setup-dev demo lint test pytest adversity wheel docs lock clean

PY := .venv/bin/python
ARGS ?=
MINUTES ?= 60
SEED ?= 1

help: ## print this list
	@sed -n 's/^\([a-z]*\):.*## /\1\t/p' $(MAKEFILE_LIST) | while IFS="$$(printf '\t')" read -r name what; do \
		printf '  make %-9s %s\n' "$$name" "$$what"; done

setup: ## install the environment .venv from requirements.lock, and a Vulkan driver
	@sh tools/setup.sh

setup-dev: # install everything for tests and docs as well
	@sh tools/setup.sh dev

demo: setup ## render the human of the package to out/demo.png
	@mkdir -p out
	@.venv/bin/dermis render --atlas 1024 -o out/demo.png

lint: setup-dev ## check style, types and import layers
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	$(PY) -m mypy
	.venv/bin/lint-imports

test: setup-dev ## run lint and all tests (ARGS="-k blur" selects some)
	@$(PY) -m compileall -q src tests || true # for the processes that tests start
	@$(MAKE) --no-print-directory -j 2 lint pytest

pytest: setup-dev # run all tests without lint
	$(PY) -m pytest -n 2 --dist loadfile --no-loadscope-reorder --durations=10 $(ARGS)

adversity: setup-dev ## test damaged inputs of all kinds for MINUTES=60 (SEED=2 for others)
	$(PY) -m tests.adversity --minutes $(MINUTES) --seed $(SEED) $(ARGS)

wheel: setup ## build the wheel in dist
	$(PY) -m pip wheel --quiet --no-deps --no-build-isolation --disable-pip-version-check -w dist . && ls dist

lock: ## update both requirements locks from pyproject.toml (ARGS=--upgrade for newer versions)
	@sh tools/lock.sh $(ARGS)

docs: setup-dev ## build the documentation as web pages in out/docs
	@.venv/bin/sphinx-build -q -W --keep-going docs out/docs && echo out/docs/index.html

clean: ## remove build products and caches, except .venv
	rm -rf out dist build .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis
	find src tests gallery benchmarks tools -name __pycache__ -type d -prune -exec rm -rf {} +
