# Two commands: `make validate` runs the main job, `make test` the tests. Each sets up what it needs.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.PHONY: validate test test-long lint gallery bench clean

validate: $(READY)
	$(BIN)/microsurf validate

test: $(READY) lint
	$(BIN)/pytest

test-long: $(READY)
	$(BIN)/pytest -m "long or not long"

gallery: $(READY)
	$(BIN)/python validation/gallery.py
	$(BIN)/python validation/approximate_error.py

# Wants a quiet machine and LLVM 19, see validation/peers/mitsuba.py.
bench: $(READY)
	$(BIN)/pip install --quiet --constraint constraints.txt --editable ".[peers]"
	$(BIN)/python validation/bench.py

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

$(READY): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --constraint constraints.txt --editable ".[dev]"
	touch $@

clean:
	rm -rf $(VENV) reports/latest
