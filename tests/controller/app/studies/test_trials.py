"""Trials: what a seed changes, how often a row counts, and what a row says of failures."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.app.cli.commands.trials import trials as command
from snakewalk.controller.app.studies import trials as study
from snakewalk.controller.app.studies.trials import Case, Trial, plan_trials, prepare_case, wilson

FLAT, HILLS = Case("flat-square", "serpenoid"), Case("jacksboro-traverse", "walk")


def starts_m(case: Case, seeds: int, spread_m: float) -> np.ndarray:
    return np.array([prepare_case(case, k, spread_m, {}).run.start_m for k in range(seeds)])


def test_starts_are_normal_about_the_run_s_own_and_repeat() -> None:
    starts = starts_m(FLAT, 200, 0.04)
    assert starts.mean(axis=0) == pytest.approx([0.0, 0.0], abs=4 * 0.04 / math.sqrt(200))
    assert starts.std(axis=0) == pytest.approx([0.04, 0.04], rel=0.2)
    assert (starts_m(FLAT, 3, 0.04) == starts[:3]).all()
    walk = Case("flat-square", "walk")
    assert (starts_m(walk, 3, 0.04) == starts[:3]).all()  # motions meet the same starts
    assert (starts_m(FLAT, 3, 0.0) == 0.0).all()


def test_a_moved_start_is_on_safe_ground() -> None:
    """The spread is so large that about half of the draws are off the safe ground."""
    relief = prepare_case(HILLS, 0, 0.0, {}).planner.relief
    assert relief is not None
    assert relief.safe(*starts_m(HILLS, 12, 1.5).T).all()


def test_no_safe_ground_about_the_start_is_refused() -> None:
    border = {"start_m": (-50.0, 0.0)}
    with pytest.raises(InputError, match="no safe ground"):
        prepare_case(HILLS, 0, 0.04, border)


def test_what_the_seed_does_not_change_counts_once() -> None:
    walk, seeds = Case("flat-square", "walk"), range(100, 104)
    assert len(plan_trials([FLAT, walk], seeds, 0.04, {})) == 8
    fixed = plan_trials([FLAT, walk], seeds, 0.0, {})
    assert fixed == [(FLAT, 100), *((walk, k) for k in seeds)]


def test_a_run_that_raises_is_a_row_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> None:
        raise ZeroDivisionError("by zero")

    monkeypatch.setattr(study, "execute", fails)
    trial = study.run_trial(FLAT, 7, 0.04, {})
    assert (trial.seed, trial.complete, trial.cause) == (7, False, "error")
    assert trial.why == "ZeroDivisionError: by zero"
    assert trial.waypoints == 4
    missing = study.run_trial(Case("nowhere", "walk"), 7, 0.04, {})
    assert missing.cause == "refused"


def test_a_row_counts_passes_misses_and_causes() -> None:
    done = {"waypoints": 4, "complete": True, "reached": 4}
    found = [
        Trial(FLAT, 0, **done, path_error_m=0.1, path_error_max_m=0.3),
        Trial(FLAT, 1, **done, missed=2, path_error_m=0.2, path_error_max_m=0.9),
        Trial(FLAT, 2, waypoints=4, missed=1, cause="slip", why="advanced 20% of the prediction"),
        Trial(FLAT, 3, waypoints=4, cause="slip", why="advanced 10% of the prediction"),
        Trial(FLAT, 4, waypoints=4, cause="error", why="ZeroDivisionError: by zero"),
    ]
    row = study.table(found, [FLAT])[0]
    assert (row.runs, row.complete, row.first_pass, row.passed_by) == (5, "2 of 5", 1, 3)
    assert (row.path_error_m, row.path_error_max_m) == (0.15, 0.9)
    assert row.why == "2 slip; 1 ZeroDivisionError: by zero"


def test_the_command_runs_each_case_and_a_fixed_one_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("mujoco")
    run = tmp_path / "near.toml"
    run.write_text('name = "near"\nwaypoints_m = [[0.4, 0.0]]\ntime_limit_s = 20.0\n')
    command(
        [str(run)], seeds=2, first_seed=40, start_spread=0.0, motion=["serpenoid"],
        workers=1, as_json=True,
    )  # fmt: skip
    found = json.loads(capsys.readouterr().out)
    assert (found["seeds"], found["start_spread_m"]) == ([40, 41], 0.0)
    (row,) = found["table"]
    assert (row["run"], row["complete"], row["first_pass"]) == (str(run), "1 of 1", 1)
    assert row["complete_95"] == [0.207, 1.0]
    (trial,) = found["trials"]
    assert (trial["seed"], trial["start_m"], trial["cause"]) == (40, [0.0, 0.0], "")


@pytest.mark.parametrize(
    ("successes", "runs", "interval"),
    [  # R. G. Newcombe (1998), Statistics in Medicine 17, Table I
        (81, 263, (0.2553, 0.3662)),
        (15, 148, (0.0624, 0.1605)),
        (0, 20, (0.0, 0.1611)),
        (1, 29, (0.0061, 0.1718)),
    ],
)
def test_wilson_s_interval(successes: int, runs: int, interval: tuple[float, float]) -> None:
    assert wilson(successes, runs) == pytest.approx(interval, abs=6e-4)
    low, high = wilson(runs - successes, runs)
    assert (1.0 - high, 1.0 - low) == pytest.approx(interval, abs=6e-4)
