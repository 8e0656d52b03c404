# Two commands: `make validate` runs the main job, `make test` the tests. Each sets up what it needs.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.PHONY: validate test test-long lint gallery atlas calibration frontiers bench clean

validate: $(READY)
	$(BIN)/microsurf validate

# A process for each core; a file's tests stay together, for what they share.
PYTEST := $(BIN)/pytest --numprocesses auto --maxprocesses 4 --dist loadfile

test: $(READY) lint
	$(PYTEST)

test-long: $(READY)
	$(PYTEST) -m "long or not long"

gallery: $(READY)
	$(BIN)/python validation/gallery.py
	$(BIN)/python validation/approximate_error.py

# Goes on where it was stopped.
atlas: $(READY)
	$(BIN)/python validation/atlas.py

calibration: $(READY)
	$(BIN)/python validation/calibration.py
	$(BIN)/python validation/verdict_rates.py
	$(BIN)/python validation/repeat.py
	$(BIN)/python validation/known_defects.py

# Goes on where it was stopped.
frontiers: $(READY)
	$(BIN)/python validation/frontiers.py

# Wants a quiet machine and LLVM 19, see validation/peers/mitsuba.py.
bench: $(READY)
	$(BIN)/pip install --quiet --constraint constraints.txt --editable ".[peers]"
	$(BIN)/python validation/bench.py
	$(BIN)/python validation/bench_effects.py

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
