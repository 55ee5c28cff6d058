# blysk: `make demo` renders the Utah teapot through simulated RTL, `make test` checks everything.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
TEST_WORKERS ?= auto

.PHONY: demo test test-all bench lint clean

demo: $(VENV)/.installed
	$(BIN)/blysk render teapot --size 640x480 -o teapot-simulated.png --compare teapot.png --json teapot.json

test: $(VENV)/.installed-test lint
	$(BIN)/python -m pytest -n $(TEST_WORKERS)

test-all: $(VENV)/.installed-test lint
	$(BIN)/python -m pytest -n $(TEST_WORKERS) -m ""

bench: $(VENV)/.installed-bench
	$(BIN)/python -m bench.engines
	$(BIN)/python -m bench.renderer
	$(BIN)/python -m bench.accuracy

lint: $(VENV)/.installed-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

$(VENV)/.installed: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e .
	touch $@

$(VENV)/.installed-test: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[test]'
	touch $@

$(VENV)/.installed-bench: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[bench]'
	touch $@

clean:
	rm -rf $(VENV) build *.egg-info teapot.png teapot-simulated.png teapot.json
