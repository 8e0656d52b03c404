# Two commands: `make validate` runs the main job, `make test` the tests. Each sets up what it needs.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

# Containers forbid Python to keep its bytecode: each of the tests' many processes would compile
# all sources again.
export PYTHONDONTWRITEBYTECODE =

.PHONY: validate test pytest test-long lint gallery atlas layers calibration coverage circle explorer gridwalk frontiers renderers two-layers bench widths dist docs clean

validate: $(READY)
	$(BIN)/microsurf validate

# A process for each core; a file's tests stay together, for what they share.
PYTEST := $(BIN)/pytest --numprocesses auto --maxprocesses 4 --dist loadfile

# Lint runs beside the tests: together they keep all cores busy to the end.
test: $(READY)
	@$(MAKE) --no-print-directory --jobs 2 lint pytest

pytest: $(READY)
	$(PYTEST)

test-long: $(READY)
	$(PYTEST) -m "long or not long"

# Mitsuba renders the relief of the first.
gallery: $(READY)
	$(BIN)/pip install --quiet --constraint constraints.txt --editable ".[mitsuba]"
	$(BIN)/python -m validation.figures.surface_and_lobes
	$(BIN)/python -m validation.figures.gallery
	$(BIN)/python -m validation.figures.spheres
	$(BIN)/python -m validation.figures.approximate_error

# Goes on where it was stopped.
atlas: $(READY)
	$(BIN)/python -m validation.structures.run

# Where IL facets, and where layering, stand for two layers; goes on where it was stopped, an hour.
layers: $(READY)
	$(BIN)/python -m validation.layers.atlas
	$(BIN)/python -m validation.layers.layering
	$(BIN)/python -m validation.layers.limits
	$(BIN)/python -m validation.layers.independent.run

calibration: $(READY)
	$(BIN)/python -m validation.calibration.run
	$(BIN)/python -m validation.calibration.verdict_rates
	$(BIN)/python -m validation.calibration.repeat
	$(BIN)/python -m validation.calibration.known_defects
	$(BIN)/python -m validation.calibration.brdf_fit

# Goes on where it was stopped; an hour.
coverage: $(READY)
	$(BIN)/python -m validation.coverage.surfaces
	$(BIN)/python -m validation.coverage.axes

# Wants MICROSURF_DATA, see validation/circle/run.py.
circle: $(READY)
	$(BIN)/python -m validation.circle.run

# One page of lobes, traced points and a surface, for a browser: a minute.
explorer: $(READY)
	$(BIN)/python -m validation.explorer.traced
	$(BIN)/python -m validation.explorer.page

# Both engines against a walk over the grid in float64: first hits; Embree: facets, albedos, leaks.
# And against each other: albedos.
gridwalk: $(READY)
	$(BIN)/python -m validation.gridwalk.first_hits
	$(BIN)/python -m validation.gridwalk.engine_albedos
	$(BIN)/python -m validation.gridwalk.check
	$(BIN)/python -m validation.gridwalk.leaks

# Goes on where it was stopped.
frontiers: $(READY)
	$(BIN)/python -m validation.tradeoff.run
	$(BIN)/python -m validation.tradeoff.recommendations

# Mitsuba's BSDFs against explicit surfaces, ten minutes; the picture wants LLVM 19.
renderers: $(READY)
	$(BIN)/pip install --quiet --constraint constraints.txt --editable ".[mitsuba]"
	$(BIN)/python -m validation.renderers.run
	$(BIN)/python -m validation.renderers.picture

# Two explicit layers by Mitsuba, three minutes; wants LLVM 19, see validation/mitsuba/renderer.py.
two-layers: $(READY)
	$(BIN)/pip install --quiet --constraint constraints.txt --editable ".[mitsuba]"
	$(BIN)/python -m validation.mitsuba.two_layers

# Wants LLVM 19, see validation/mitsuba/renderer.py.
bench: $(READY)
	$(BIN)/pip install --quiet --constraint constraints.txt --editable ".[peers]"
	$(BIN)/python -m validation.bench.engines
	$(BIN)/python -m validation.bench.run
	$(BIN)/python -m validation.bench.time_to_error
	$(BIN)/python -m validation.bench.effects

# Of intervals, against a report of another version in reports/before.
widths: $(READY)
	$(BIN)/python -m validation.bench.widths

# Wheel and sdist; the wheel tried where nothing else is, by the Pythons named in PYTHONS.
dist: $(READY)
	$(BIN)/pip install --quiet --constraint constraints.txt --editable ".[dist]"
	$(BIN)/python -m validation.packages

# The site, into build/docs; its notebooks run.
docs: $(READY)
	$(BIN)/pip install --quiet --constraint constraints.txt --editable ".[docs]"
	$(BIN)/python -m validation.site

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
