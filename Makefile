# make run      set up what a run and the tutorials need, and do the main job on the embedded defaults
# make test     set everything up and pass lint, types and the fast tests
# make quick    the fast tests that the changed files concern, in less than a minute
# make slow     further cases of the expensive tests; CI runs them
# make nightly  everything that is too long for CI
PY ?= python3
VENV := .venv
BIN := $(VENV)/bin
MAIN := $(VENV)/.main
STAMP := $(VENV)/.ready

PYTEST := PYTHONDONTWRITEBYTECODE= OPENBLAS_NUM_THREADS=1 $(BIN)/pytest -n 2 --dist worksteal

.PHONY: setup lock loops fallbacks run test lint types unit quick slow nightly pages docs bench campaign lerobot warp failures clean

setup: $(STAMP)

# The versions that are installed are in .ci/locks; `make lock` chooses them again.
$(MAIN): pyproject.toml $(wildcard .ci/locks/*)
	@$(PY) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed")'
	@echo "1 of 3: installing packages in $(VENV), about 1 GB"
	@$(PY) -m venv $(VENV)
	@.ci/setup $(BIN) main
	@.ci/offscreen
	@touch $(MAIN)

$(STAMP): $(MAIN)
	.ci/setup $(BIN) dev
	touch $(STAMP)

lock: setup
	.ci/lock $(BIN)

# The loops are compiled once, by two processes, before many would compile them each for itself.
loops: setup
	PYTHONDONTWRITEBYTECODE= $(BIN)/snakewalk tools compile

run: $(MAIN)
	@echo "2 of 3: compiling the loops of runs for this computer"
	@PYTHONDONTWRITEBYTECODE= $(BIN)/snakewalk tools compile --runs
	@echo "3 of 3: snakewalk run: a walk over hills in the simulator, then its report and film"
	@PYTHONDONTWRITEBYTECODE= $(BIN)/snakewalk run

# The types are checked while the loops are compiled and the tests collected: neither fills two cores.
test: setup lint
	$(MAKE) -j 2 types unit

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: setup
	$(BIN)/mypy

# Each process takes whole files in their order, so that a file's fixtures are made once. Byte code is kept,
# also where the environment says that it is not: forty tests start a program of their own.
unit: loops
	$(PYTEST) --most-expensive 30 --limit-costs

quick: setup
	PYTHONDONTWRITEBYTECODE= OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.tiers

slow: loops
	$(PYTEST) -m "slow and not nightly" --most-expensive 30

# Each of them, with the reason that keeps it out of CI, is in docs/how-to/test-a-change.md.
nightly: loops
	$(PYTEST) -m nightly --most-expensive 30
	$(BIN)/python -m tests.campaign
	$(BIN)/python -m benchmarks.hard_walks --walks 1000 -o build/hard-walks.jsonl
	$(BIN)/python -m benchmarks.hard_walks --walks 200 --planted -o build/planted-walks.jsonl
	$(BIN)/python -m tests.mutation
	$(BIN)/python -m benchmarks

# make pages     the commands of the pages, as printed; PAGES="feetech or robots" chooses some
PAGES ?= docs
pages: loops
	$(PYTEST) -m "slow or not slow" tests/controller/cli/test_printed_commands.py -k "$(PAGES)"

# make docs      the site, in build/docs; a link that leads nowhere inside it, or any other warning, is an error
docs: setup
	$(BIN)/sphinx-build -j 2 -q -W --keep-going -b html docs build/docs

# make fallbacks the public fallbacks of private interfaces, which CI runs once; docs/decisions/0078
fallbacks: loops
	.ci/fallbacks $(BIN)

# make bench     ratios to peers and limits; make campaign  100,000 cycles under faults
bench: setup
	$(BIN)/python -m benchmarks

campaign: setup
	$(BIN)/python -m tests.campaign

# make lerobot   teleoperate, record and replay with the real LeRobot, in an environment of its own (several GB)
LEROBOT_VENV ?= .venv-lerobot

lerobot:
	.ci/lerobot $(PY) $(LEROBOT_VENV)

# make warp      MuJoCo-Warp against the compiled simulator, in an environment of its own
WARP_VENV ?= .venv-warp

warp:
	.ci/warp $(PY) $(WARP_VENV)

# make failures  where the walk still fails and why: maps over grounds, frictions and robots (hours; SEEDS=1
# is a first look; docs/failures.md). A stopped one goes on where it was; FAILURES is where the tables are.
SEEDS ?= 20
FIRST_SEED ?= 1000
FAILURES ?= runs/failures
TRIALS := $(BIN)/snakewalk trials run --motion walk --seeds $(SEEDS) --first-seed $(FIRST_SEED) --force
ANYWHERE := --over world.planner.slope_limit_rad=1.4 --over world.planner.variance_limit_m2=1
BODIES := --robot alternating16 --robot yaw16

failures: setup
	mkdir -p $(FAILURES)
	$(TRIALS) steps-4cm $(BODIES) $(ANYWHERE) --over world.ground.height_m=0.01,0.02,0.04,0.06 \
	  -o $(FAILURES)/steps.csv --picture $(FAILURES)/steps.png
	$(TRIALS) gaps-8cm $(BODIES) $(ANYWHERE) --over world.ground.width_m=0.04,0.08,0.12,0.16 \
	  -o $(FAILURES)/gaps.csv --picture $(FAILURES)/gaps.png
	$(TRIALS) ramp-10-up $(BODIES) --robot alternating12 --robot xl330-16 $(ANYWHERE) \
	  --over world.ground.slope_deg=5,10,15,20 --over run.safety.voltage_min_v=4 \
	  -o $(FAILURES)/ramp.csv --picture $(FAILURES)/ramp.png
	$(TRIALS) random-10 $(ANYWHERE) --over world.ground.rms_slope_deg=5,10,15,20 \
	  --over world.ground.correlation_m=0.15,0.3,0.6 \
	  -o $(FAILURES)/random.csv --picture $(FAILURES)/random.png
	$(TRIALS) flat-slalom ramp-10-up --robot alternating16 --over world.friction.along=0.1,0.2,0.4 \
	  --over world.friction.across=0.2,0.4,0.8 \
	  -o $(FAILURES)/friction.csv --picture $(FAILURES)/friction.png

clean:
	rm -rf $(VENV) build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
