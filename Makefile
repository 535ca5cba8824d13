# make run   set everything up and do the main job on the embedded defaults
# make test  set everything up and pass lint, types and tests
PY ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.ready

# Other people's programs for the same servos, which the tests run against the simulated bus; without
# their dependencies, of which they need none there. What cannot be had is skipped.
CLIENTS := lerobot==0.4.4 deepdiff orderly-set cachebox tqdm deprecation
# This one brings an old dynamixel_sdk along, so it gets a folder of its own, without that.
ASIDE := dynamixel-controller==0.9.2

.PHONY: setup run test lint types unit bench campaign clean

setup: $(STAMP)

$(STAMP): pyproject.toml
	$(PY) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed")'
	$(PY) -m venv $(VENV)
	$(BIN)/pip install --quiet --upgrade pip
	$(BIN)/pip install --quiet --editable '.[dev]'
	$(BIN)/pip install --quiet --no-deps $(CLIENTS) || echo "tests of other clients are skipped"
	$(BIN)/pip install --quiet --no-deps --target $(VENV)/clients $(ASIDE) || echo "as above"
	rm -rf $(VENV)/clients/dynamixel_sdk
	.ci/offscreen
	touch $(STAMP)

run: setup
	$(BIN)/snakewalk run

test: setup lint types unit

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: setup
	$(BIN)/mypy

unit: setup
	OPENBLAS_NUM_THREADS=1 $(BIN)/pytest -n 2

# make bench     ratios to peers and limits; make campaign  100,000 cycles under faults
bench: setup
	$(BIN)/python -m benchmarks

campaign: setup
	$(BIN)/python -m tests.campaign

clean:
	rm -rf $(VENV) build dist *.egg-info
