# blysk: `make demo` renders the Utah teapot through simulated RTL, `make test` is run before a commit,
# `make test-all` checks everything, `make site` builds report, live page, units and documents, `make release` all that
# is published.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
TEST_WORKERS ?= auto

COMMA := ,

VERSION := $(shell sed -n 's/^version = "\(.*\)"/\1/p' pyproject.toml)
BOARDS ?= ulx3s-25f ulx3s-85f icepi-zero
SHA256 := $(if $(shell command -v sha256sum),sha256sum,shasum -a 256)

# Workers, and the commands that tests start, share their bytecode.
unexport PYTHONDONTWRITEBYTECODE

# The tests compile their models; without a C++ compiler one comes from PyPI.
TEST_EXTRAS := $(if $(shell command -v c++ || command -v g++ || command -v clang++),[test],[test$(COMMA)native])

LINT := import tomllib; of = tomllib.load(open("pyproject.toml", "rb"))["project"]; \
	print(*of["optional-dependencies"]["lint"], *(one for one in of["dependencies"] if one.startswith(("click", "numpy"))), sep="\n")

.PHONY: demo test test-quick test-all test-long test-ci prove prove-ci decided adversary mutants soak coverage bench \
	pages docs site paper boards release lint style types clean

demo: $(VENV)/.installed
	$(BIN)/blysk render teapot --size 640x480 --compare teapot.png

# Style at once; types, which one core checks in most of a minute, beside the tests.
test: $(VENV)/.installed-test style
	$(MAKE) --no-print-directory -j2 test-quick types

test-quick: $(VENV)/.installed-test
	$(BIN)/python -m pytest -n $(TEST_WORKERS) --no-loadscope-reorder

test-all:
	$(MAKE) test
	$(MAKE) prove
	$(MAKE) test-long

# What `make test` leaves out but for proofs: other structures of the units, costs, sweeps, browsers.
test-long: $(VENV)/.installed-test
	$(BIN)/python -m pytest -n $(TEST_WORKERS) --no-loadscope-reorder -m long

# Of those the part that CI runs.
test-ci: $(VENV)/.installed-test
	$(BIN)/python -m pytest -n $(TEST_WORKERS) --no-loadscope-reorder -m ci

# Of the proofs the part that CI runs.
prove-ci: $(VENV)/.installed-test
	$(BIN)/python -m pytest -n $(TEST_WORKERS) --no-loadscope-reorder -m "prove and not seldom" tests/formal

prove: $(VENV)/.installed-test
	$(BIN)/python -m pytest -n $(TEST_WORKERS) --no-loadscope-reorder -m prove tests/formal

# Decides what is not in the list of what was decided, and writes the list anew; with an empty list all of it.
decided: $(VENV)/.installed-test
	mkdir -p build
	rm -f build/decided
	DECIDED=$(CURDIR)/build/decided $(BIN)/python -m pytest -n $(TEST_WORKERS) --no-loadscope-reorder \
		-m "prove or long" tests/formal tests/test_units.py \
		tests/simulators tests/hdl/test_toggle_coverage.py tests/sim/frames/test_testbench.py
	LC_ALL=C sort -u build/decided > tests/decided.txt

# A search for the largest errors from a new seed each day, or from ADVERSARY_SEED=N. It prints its seed.
adversary: $(VENV)/.installed-test
	ADVERSARY_SEED=$${ADVERSARY_SEED:-$$(date +%Y%m%d)} \
		$(BIN)/python -m pytest -s -m long tests/judges/test_adversary.py

mutants: $(VENV)/.installed-test
	$(BIN)/python -m blysk.bench.quality.mutants

soak: $(VENV)/.installed-bench
	$(BIN)/python -m blysk.bench.quality.soak

coverage: $(VENV)/.installed-test
	$(BIN)/python -m pytest -n $(TEST_WORKERS) --no-loadscope-reorder --cov
	@for package in golden hdl sim; do \
		printf '%s: %% ' $$package; \
		$(BIN)/coverage report --include="$$package/*" --format=total || exit 1; \
	done

bench: $(VENV)/.installed-bench
	$(BIN)/blysk bench report
	$(BIN)/python -m blysk.bench.speed.engines
	$(BIN)/python -m blysk.bench.speed.renderer

pages: $(VENV)/.installed
	mkdir -p build/pages
	$(BIN)/blysk pages build/pages

# Guide, theory and Python interface, in build/docs.
docs: $(VENV)/.installed-docs
	$(BIN)/python docs/site/make.py build/docs $(DOCS_OPTIONS)

site: pages $(VENV)/.installed-web
	$(MAKE) docs DOCS_OPTIONS="--pages build/pages $(DOCS_OPTIONS)"
	$(BIN)/blysk web -o site --docs build/docs

# Bitstreams, first frames and their page. A design that was mapped or routed before is taken from the cache.
# BOARDS="ulx3s-25f icepi-zero" chooses boards.
boards: $(VENV)/.installed-release
	for board in $(BOARDS); do \
		rm -rf build/boards/$$board && mkdir -p build/boards/$$board && \
		$(BIN)/blysk board $$board --simulate 1 -o build/boards/$$board \
			--record build/boards/$$board/figures.json && \
		$(BIN)/blysk board $$board -o build/boards/$$board/blysk-$(VERSION)-$$board.bit \
			--record build/boards/$$board/figures.json || exit 1; \
	done
	$(BIN)/python docs/site/boards.py build/boards $(BOARDS)

# The wheel is built from the source archive. The folder dist appears when every file in it is made.
# BOARDS= leaves out the bitstreams.
release: $(VENV)/.installed-release
	rm -rf dist build/dist
	$(if $(strip $(BOARDS)),$(MAKE) boards)
	$(MAKE) site DOCS_OPTIONS="$(if $(strip $(BOARDS)),--boards build/boards)"
	$(BIN)/python -m build $(BUILD_OPTIONS) -o build/dist
	$(if $(strip $(BOARDS)),cp $(foreach board,$(BOARDS),build/boards/$(board)/*.bit) build/dist)
	tar -czf build/dist/blysk-$(VERSION)-site.tar.gz site
	cd build/dist && $(SHA256) * > ../SHA256SUMS
	mv build/SHA256SUMS build/dist
	mv build/dist dist

# Measures the sections of the report that the paper takes, with pictures of full size. Clock rates are committed.
# PAPER_OPTIONS=--quick takes small pictures, in minutes.
paper: $(VENV)/.installed-bench
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[paper]'
	mkdir -p build/paper
	$(BIN)/blysk bench build/paper/report --only methods --only rivals $(PAPER_OPTIONS)
	$(BIN)/python -m blysk.bench.quality.paper build/paper/report/report.json

lint: style types

style: $(VENV)/.installed-lint
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

# Types are checked under the import name, which the folders have by links.
types: $(VENV)/.installed-lint
	@mkdir -p build/types/blysk
	@ln -sf ../../../golden ../../../hdl ../../../sim ../../../blysk/__init__.py build/types/blysk
	MYPYPATH=build/types $(BIN)/mypy -p blysk.golden -p blysk.sim.api

$(VENV)/.installed: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e .
	touch $@

# The tools, and the two libraries whose types the checked files use.
$(VENV)/.installed-lint: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -c '$(LINT)' > $@.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r $@.txt
	touch $@

$(VENV)/.installed-test: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.$(TEST_EXTRAS)'
	touch $@

$(VENV)/.installed-web: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[web]'
	touch $@

$(VENV)/.installed-docs: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[docs]'
	touch $@

$(VENV)/.installed-release: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[release]'
	touch $@

$(VENV)/.installed-bench: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[bench,fpga,report]'
	touch $@

clean:
	rm -rf $(VENV) build dist site report *.egg-info teapot.png
