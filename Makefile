# `make help` lists the targets. `make demo` and `make test` do everything on a fresh machine.
PYTHON ?= python3
VENV := .venv
PY := $(VENV)/bin/python
# Two processes of one thread each: four threads on two cores wait for each other.
PYTEST := OMP_NUM_THREADS=1 $(PY) -m pytest -n 2
TIMED := scripts/timed.sh
# The pinned versions exist for Python 3.11 and later.
PINS = $(shell $(PYTHON) -c 'import sys; print("-c constraints.txt" * (sys.version_info >= (3, 11)))')

# Tests start hundreds of programs: each would compile all modules anew where this is set.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help demo check test lint results audit weights gpu assets site release matrix system clean

help:  ## list the targets
	@sed -n 's/^\([a-z]*\):.*##/\1 /p' $(MAKEFILE_LIST) | while read -r name text; do printf '%-8s %s\n' "$$name" "$$text"; done

demo: $(VENV)/.ready  ## draw all categories, make a dataset, train a small estimator, in out/demo
	$(TIMED) demo $(VENV)/bin/artperl demo --out out/demo

check: $(VENV)/.ready-dev lint  ## lint, types and the fast tests: in two minutes, before each commit
	$(PYTEST) --dist worksteal -m "not slow"

test: system $(VENV)/.ready-dev lint  ## lint, types and every test: what continuous integration runs
	$(TIMED) tests env $(PYTEST) --dist loadfile --no-loadscope-reorder --durations 30 --durations-min 1

lint: export PATH := $(CURDIR)/$(VENV)/bin:$(PATH)
lint: $(VENV)/.ready-dev  ## format, lint, types and import contracts
	$(TIMED) lint sh -ec 'ruff format --check .; ruff check .; mypy; lint-imports'

# Stop it at any moment: the same command goes on.
results: $(VENV)/.ready-dev  ## print figures of the docs that are missing or stale into results; ONLY=name runs one
	$(PY) -m benchmarks.results $(if $(ONLY),--only $(ONLY))

audit: $(VENV)/.ready-dev  ## test 10,000 procedural objects, and those in ARTSIM_PARTNET_DIR, for simulators
	$(PY) -m benchmarks.audit

# Stop it at any moment: the same command goes on. To try one: make weights CATEGORY=laptop PRESET=quick
# METHOD=artperl makes those of the paper's method.
CATEGORY ?= $(basename $(notdir $(wildcard artperl/recipes/$(METHOD)/*.json)))
weights: $(VENV)/.ready-dev  ## make the shipped estimators again, each from its recipe
	for recipe in $(CATEGORY); do \
		$(VENV)/bin/artperl train --recipe $(METHOD:%=%/)$$recipe $(if $(PRESET),--preset $(PRESET)) --workers 2 --threads 1 || exit; \
	done

gpu: $(VENV)/.ready-dev  ## on a machine with a GPU: tests marked gpu, speed; results in out/gpu
	$(PY) -m benchmarks.gpu

assets: $(VENV)/.ready-dev  ## make the objects in urdf_assets again
	$(PY) urdf_assets/build.py

site: $(VENV)/.ready-dev  ## build the site of the docs, which needs no network, in out/site
	NO_MKDOCS_2_WARNING=1 $(TIMED) site $(PY) -m mkdocs build --strict

release: $(VENV)/.ready-dev  ## build and check sdist and wheel in dist, and use them in an environment of their own
	$(TIMED) release scripts/release.sh $(abspath $(PY))

matrix:  ## try the wheel in dist with each Python from 3.10 to 3.13 that exists
	scripts/matrix.sh dist/*.whl

# System libraries that PyBullet's EGL renderer needs, SAPIEN's Vulkan driver and a browser for the tests of pages;
# everything else comes from pip.
system:  ## install what EGL, SAPIEN and the tests of pages need; wants root
	$(TIMED) "system libraries" sh -ec 'for name in system vulkan browser; do scripts/install-$$name.sh; done'

$(VENV)/.ready: pyproject.toml constraints.txt
	test -x $(PY) || $(PYTHON) -m venv $(VENV)
	$(TIMED) install $(PY) -m pip install --quiet $(PINS) -e '.[view,train,sim]'
	touch $@

$(VENV)/.ready-dev: pyproject.toml constraints.txt
	test -x $(PY) || $(PYTHON) -m venv $(VENV)
	$(TIMED) "install for tests" $(PY) -m pip install --quiet $(PINS) -e '.[dev]'
	touch $(VENV)/.ready $@

clean:  ## remove the environment and everything made
	rm -rf $(VENV) out build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
