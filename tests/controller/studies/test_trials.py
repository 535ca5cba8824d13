"""Trials: what a seed changes, how often a row counts, and what a row says of failures."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.console.parquet import table_to_parquet
from snakewalk.controller.studies import trials as study
from snakewalk.controller.studies.commands.trials import trials as command
from snakewalk.controller.studies.trials import Case, Trial, plan_trials, prepare_case, wilson
from snakewalk.controller.studies.trials_table import KINDS, TrialsTable
from tests.helpers.in_process import work_in_this_process

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


@pytest.mark.slow
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
    def fails(*_: object, **__: object) -> None:
        raise ZeroDivisionError("by zero")

    monkeypatch.setattr(study, "run_robot", fails)
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
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mujoco")
    work_in_this_process(monkeypatch)
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


def test_where_every_run_is_refused_the_command_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(case: Case, seed: int, *_: object) -> Trial:
        return Trial(case, seed, cause="refused", why="refused: too steep")

    monkeypatch.setattr(study, "run_trial", refused)
    work_in_this_process(monkeypatch)
    with pytest.raises(InputError, match="no run was possible: 2 refused: too steep"):
        command(["flat-slalom"], seeds=2, motion=["walk"], workers=1)
    assert "0 of 2" in capsys.readouterr().out


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


def test_keys_replace_values_of_the_three_files() -> None:
    keys = (
        ("world.ground.slope_deg", 20),
        ("world.friction.along", 0.3),
        ("robot.joint_axes", "ypypypypypyp"),
        ("run.physics_step_s", 0.002),
    )
    found = prepare_case(Case("ramp-10-up", "walk", keys=keys), 3, 0.0, {})
    assert found.world.ground.slope_rad == pytest.approx(math.radians(20.0))
    assert found.world.friction.along == 0.3
    assert found.robot.joint_count == 12
    assert (found.run.physics_step_s, found.run.seed) == (0.002, 3)
    plain = prepare_case(Case("ramp-10-up", "walk"), 3, 0.0, {})
    assert found.world.friction.across == plain.world.friction.across


@pytest.mark.costs("walks in a process of their own")
def test_each_world_is_a_row(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mujoco")
    work_in_this_process(monkeypatch)
    run, out = tmp_path / "near.toml", tmp_path / "t.csv"
    run.write_text('name = "near"\nwaypoints_m = [[0.4, 0.0]]\ntime_limit_s = 0.2\n')
    worlds = ["flat-friction-3", "flat", "flat-friction-3"]  # what is given twice is run once
    command(
        [str(run), "rolling"], world=worlds, seeds=1, motion=["serpenoid"], seconds=5.0,
        workers=1, out=out, as_json=True,
    )  # fmt: skip
    found = json.loads(capsys.readouterr().out)
    assert [(row["run"], row["world"], row["runs"]) for row in found["table"]] == [
        (name, world, 1) for name in (str(run), "rolling") for world in worlds[:2]
    ]
    speeds = {
        trial["case"]["world"]: trial["speed_m_s"]
        for trial in found["trials"]
        if trial["case"]["motion"] == "gait"
    }
    assert speeds["flat"] != speeds["flat-friction-3"]
    head, *rows = (line.split(",")[6] for line in out.read_text().splitlines())
    assert (head, sorted(rows)) == ("world", sorted(worlds[:2] * 2))


def test_the_world_of_a_case_is_that_of_its_run() -> None:
    for run, motion in (("flat-slalom", "walk"), ("rolling", "gait")):
        cases = [Case(run, motion, world=world) for world in ("flat-friction-3", None)]
        found = [prepare_case(case, 3, 0.0, {}).world.name for case in cases]
        assert found[0] == "flat-friction-3" != found[1]


def test_keys_replace_values_of_a_gait_s_files() -> None:
    """The digest tells the rows of a kept table apart."""
    cases = [Case("rolling", "gait", keys=(("world.friction.across", v),)) for v in (0.3, 0.6)]
    found = [prepare_case(case, 3, 0.0, {}) for case in cases]
    assert [each.world.friction.across for each in found] == [0.3, 0.6]
    assert study.config_digest(cases[0], {}) != study.config_digest(cases[1], {})


@pytest.mark.parametrize(
    ("key", "value", "fault"),
    [
        ("world.ground.slop_deg", 5, "world ramp-10: ground.ramp.slop_rad: unknown key"),
        ("world.ground.slope_deg", -5, "over 0"),
        ("world.ground.slope_rad", "steep", "must be a number"),
        ("world.name.first", 1, "name.first: name is not a table"),
        ("ground.slope_deg", 5, "begins with run., robot. or world."),
        ("robot.servo.baud", 57600, "wire"),
    ],
)
def test_a_wrong_key_is_refused_before_any_run(key: str, value: object, fault: str) -> None:
    case = Case("ramp-10-up", "walk", keys=((key, value),))  # type: ignore[arg-type]
    with pytest.raises(InputError, match=fault):
        plan_trials([case], range(2), 0.04, {})


def test_values_to_go_over_are_numbers_words_and_switches() -> None:
    assert study.parse_over("a.b=5, 0.5,5") == ("a.b", (5, 0.5))
    assert study.parse_over("a=yp,true,[1]") == ("a", ("yp", True, "[1]"))
    assert study.parse_over("a=" + 99_999 * "[") == ("a", (99_999 * "[",))
    for bad in ("a", "a=", "=1", "a=1,,2"):
        with pytest.raises(InputError, match="KEY=VALUE"):
            study.parse_over(bad)


def test_trials_go_seed_by_seed() -> None:
    walks = [Case("flat-square", "walk"), Case("flat-slalom", "walk")]
    planned = plan_trials(walks, range(2), 0.04, {})
    assert planned == [(walks[0], 0), (walks[1], 0), (walks[0], 1), (walks[1], 1)]


STEEP = Case("ramp-10-up", "walk", keys=(("world.ground.slope_deg", 20),))


def test_the_table_gives_back_what_it_was_given(tmp_path: Path) -> None:
    path, configs = tmp_path / "t.csv", {STEEP: study.config_digest(STEEP, {})}
    told = Trial(STEEP, 4, (0.1, -2.5), 3, True, 3, 1, duration_s=41.5, eta=0.1 + 0.2)
    failed = Trial(STEEP, 5, cause="error", why='Fault: "a, b"\nand more')
    with TrialsTable(path, configs, 0.04) as table:
        table.add(told)
        table.add(failed)
    planned = [(STEEP, seed) for seed in range(4, 7)]
    found = TrialsTable(path, configs, 0.04).finished(planned)
    assert [repr(trial) for trial in found] == [repr(told), repr(failed)]  # nan is not nan
    assert TrialsTable(path, configs, 0.05).finished(planned) == []  # another spread
    flatter = replace(STEEP, keys=(("world.ground.slope_deg", 19),))
    other = {flatter: study.config_digest(flatter, {})}
    assert TrialsTable(path, other, 0.04).finished([(flatter, 4)]) == []
    assert "world.ground.slope_deg=20" in path.read_text()


@pytest.mark.costs("walks in a process of their own")
def test_an_estimated_pose_is_judged_by_where_the_body_truly_is(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    run = tmp_path / "near.toml"
    run.write_text(
        'name = "near"\nrobot = "alternating16-imu"\nwaypoints_m = [[0.31, 0.0], [3.0, 0.0]]\n'
        "time_limit_s = 0.3\n"
    )
    estimated, known = (
        Case(str(run), "serpenoid", keys=(("run.pose", pose),)) for pose in ("imu", "simulator")
    )
    trials = [study.run_trial(case, 3, 0.0, {}) for case in (estimated, known)]
    assert trials[0].truly_reached in {0.0, 1.0}
    assert 0.0 <= trials[0].head_error_m < 0.05
    assert np.isnan([trials[1].truly_reached, trials[1].head_error_m]).all()
    told = study.table(trials, [estimated, known])
    assert [row.truly_complete for row in told] == ["0 of 1", ""]
    assert not study.is_fixed(estimated, 0.0, {})  # the seed draws the IMU's bias
    assert study.is_fixed(known, 0.0, {})


def test_errors_are_drawn_for_each_seed() -> None:
    case = replace(FLAT, keys=(("run.deviation.drawn", True),))
    assert plan_trials([case], range(2), 0.0, {}) == [(case, 0), (case, 1)]
    run = prepare_case(case, 1, 0.0, {}).run
    assert run.deviation.drawn
    assert run.seed == 1


def test_a_kept_table_is_not_run_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mujoco")
    work_in_this_process(monkeypatch)
    run, out, picture = tmp_path / "near.toml", tmp_path / "t.csv", tmp_path / "t.png"
    run.write_text('name = "near"\nwaypoints_m = [[0.4, 0.0]]\ntime_limit_s = 0.5\n')
    over = ["world.friction.across=0.3,0.7", "world.friction.along=0.1"]
    options = {"motion": ["serpenoid"], "workers": 1, "as_json": True, "out": out, "errors": True}
    command([str(run)], seeds=1, over=over, picture=picture, **options)
    rows = json.loads(capsys.readouterr().out)["table"]
    assert [row["keys"]["world.friction.across"] for row in rows] == [0.3, 0.7]
    assert [row["keys"]["run.deviation.drawn"] for row in rows] == [True, True]
    assert [row["runs"] for row in rows] == [1, 1]
    assert picture.stat().st_size > 0

    def ran(planned: list[object], *_: object, **__: object) -> list[Trial]:
        assert not planned
        return []

    monkeypatch.setattr(study, "trials", ran)
    command([str(run)], seeds=1, over=over, **options)
    assert json.loads(capsys.readouterr().out)["table"] == rows


def test_trials_become_parquet(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    path, out = tmp_path / "trials.csv", tmp_path / "trials.parquet"
    with TrialsTable(path, {FLAT: "digest"}, 0.04) as table:
        table.add(Trial(FLAT, 4, (0.5, -1.0), 3, complete=True, reached=3, duration_s=12.5))
        table.add(Trial(FLAT, 5, cause="error", why="ValueError: a, b"))
    assert table_to_parquet(path, out, KINDS) == 2
    first, second = parquet.read_table(out).to_pylist()
    assert (first["seed"], first["complete"], first["duration_s"]) == (4, True, 12.5)
    assert first["start_m"] == "0.5 -1.0"
    assert (second["why"], second["complete"], second["relief"]) == ("ValueError: a, b", False, 1.0)
    assert math.isnan(second["duration_s"])
    with pytest.raises(InputError, match="give --out FILE, too"):
        command(["flat-square"], parquet=out)
