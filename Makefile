# Two commands do everything on a fresh machine: `make demo` and `make test`.
PYTHON ?= python3
VENV := .venv
PY := $(VENV)/bin/python

.PHONY: demo test lint bench audit clean system assets weights

demo: $(VENV)/.ready
	$(PY) examples/demo/main.py out/demo

# Two processes of one thread each: four threads on two cores wait for each other.
test: system $(VENV)/.ready-dev lint
	OMP_NUM_THREADS=1 $(PY) -m pytest -n 2 --dist loadfile

lint: $(VENV)/.ready-dev
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/ruff check .
	$(VENV)/bin/mypy
	$(VENV)/bin/lint-imports

bench: $(VENV)/.ready-dev
	$(PY) -m benchmarks.kinematics
	$(PY) -m benchmarks.agreement
	$(PY) -m benchmarks.renderers
	$(PY) -m benchmarks.generation
	$(PY) -m benchmarks.resume
	$(PY) -m benchmarks.objects
	$(PY) -m benchmarks.simulators
	$(PY) -m benchmarks.realism
	$(PY) -m benchmarks.fitting
	$(PY) -m benchmarks.inference
	$(PY) -m benchmarks.retrieval
	$(PY) -m benchmarks.errors
	$(PY) -m benchmarks.legacy_iou
	$(PY) -m benchmarks.joint
	$(PY) -m benchmarks.robot_arm

# Sim-readiness of 10,000 procedural objects, and of the real ones in ARTSIM_PARTNET_DIR.
audit: $(VENV)/.ready-dev
	$(PY) -m benchmarks.audit

# The estimators that come with the package, each from its recipe; stop it at any moment: the same command goes on.
# To try one: make weights RECIPES=laptop PRESET=quick
RECIPES ?= $(basename $(notdir $(wildcard artperl/recipes/*.json)))
weights: $(VENV)/.ready-dev
	for recipe in $(RECIPES); do \
		$(VENV)/bin/artperl train --recipe $$recipe $(if $(PRESET),--preset $(PRESET)) --workers 2 --threads 1 || exit; \
	done

assets: $(VENV)/.ready-dev
	$(PY) urdf_assets/build.py

# System libraries that PyBullet's EGL renderer needs, and SAPIEN's Vulkan driver; everything else comes from pip.
system:
	scripts/install-system.sh
	scripts/install-vulkan.sh

$(VENV)/.ready: pyproject.toml constraints.txt
	test -x $(PY) || $(PYTHON) -m venv $(VENV)
	$(PY) -m pip install --quiet -c constraints.txt -e '.[pybullet,view,train]'
	touch $@

$(VENV)/.ready-dev: pyproject.toml constraints.txt
	test -x $(PY) || $(PYTHON) -m venv $(VENV)
	$(PY) -m pip install --quiet -c constraints.txt -e '.[pybullet,view,train,dev]'
	touch $(VENV)/.ready $@

clean:
	rm -rf $(VENV) out build *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
