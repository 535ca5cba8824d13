"""The tables that user commands fill: cells, choice of tables, and their places on pages."""

import re
from pathlib import Path

import numpy as np
import pytest

from benchmarks import provenance, run_tables
from benchmarks.provenance import page_of
from benchmarks.run_tables import (
    TABLES,
    Synthesised,
    Wanted,
    policy_table,
    states_cell,
    walk_cells,
    waypoint_row,
)

SHARED = {"waypoints": 5, "states_taken": 10, "bend_k_rad": 0.59}
REACHED = SHARED | {"waypoints_reached": 5, "passed_by": 0, "seconds": 36.0, "states_distinct": 10}
MISSED = SHARED | {"waypoints_reached": 3, "passed_by": 2, "seconds": 300.0, "states_distinct": 7}
ROW = {
    **{"motion": "wave-cma", "world": "flat", "speed_m_s": 1.1681, "speed_sd_m_s": None},
    **{"body_lengths_cycle": 0.534, "energy_j_m": 42.31, "course_rad": 0.011, "trips": 1},
}
TRACK = {
    **{"frames": 78, "frames_left_out": 2, "waves_on_body": 1.64, "wave_hz": 3.861},
    **{"time_towards_head": 0.231, "bend_k_rad": 0.39, "bend_k_most_rad": 0.47},
    **{"energy_kept": 0.9961, "joint_speed_rad_s": 20.53, "slowed_by": 10.27},
    "longer_if_slowed_where_needed": 5.04,
    "states_kept": 523,
    "states_refused": {"turn": 50, "joint limits": 0, "self-contact": 27, "traction": 0},
}
TRIALS = {
    "table": [{"complete": "2 of 2", "passed_by": 1, "path_error_m": 0.079, "eta": 0.85}],
    "trials": [{"duration_s": 56.389}, {"duration_s": 47.1}],
}


def made(facts: dict[str, object], *off_path_m: float) -> Synthesised:
    return Synthesised(facts, np.array(off_path_m), 2.5, 0.87, 0.09)


def test_a_row_of_motions_counts_the_incomplete_and_repeated_states() -> None:
    row = waypoint_row("flat-slalom", [made(REACHED, 0.1, 0.2), made(MISSED, 0.3, 0.8, 0.4)])
    cells = ["1 of 2", "2", "168.0 (300.0)", "0.33 (0.80)", "10", "3"]
    assert row == ["`flat-slalom`", *cells]


def test_a_table_of_policies_counts_the_seeds_faster_than_the_tuned_gait() -> None:
    speeds = {"wave-cma": (1.2, 0.9, 1.1), "undulation-fast": (1.0, 1.0, 1.0)}
    trials = [
        {"motion": name, "seed": seed, "speed_m_s": speed}
        for name, each in speeds.items()
        for seed, speed in enumerate(each, 1000)
    ]
    rows = [ROW, ROW | {"motion": "undulation-fast", "speed_sd_m_s": 0.016}]
    _, _, *lines = policy_table({"table": rows, "trials": trials}, "flat").splitlines()
    assert lines == [
        "| `wave-cma` | 1.168 | unknown | 0.534 | 42.3 | 0.011 | 2 of 3 | 1 of 3 |",
        "| `undulation-fast` | 1.168 | 0.016 | 0.534 | 42.3 | 0.011 |  | 1 of 3 |",
    ]


def test_a_table_of_recordings_is_written_between_its_marks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked: list[tuple[str, ...]] = []

    def command(*words: str) -> list[dict[str, object]]:
        asked.append(words)
        return [TRACK]

    page = tmp_path / "recordings.md"
    page.write_text("before\n<!-- slowing begins -->\nold\n<!-- slowing ends -->\nafter\n")
    monkeypatch.setattr(provenance, "DOCS", tmp_path)
    monkeypatch.setattr(run_tables, "snakewalk", command)
    monkeypatch.setattr(
        "sys.argv", ["run_tables", "recordings.slowing", "--data", "/films", "--write"]
    )
    run_tables.main()
    text = page.read_text()
    cells = "78 (2) | 1.64, 3.86 | 23 % | 0.39 (0.47) | 99.6 % | 20.5 | 10.27 | 5.04"
    assert f"| lampreydata | {cells} |" in text
    assert text.startswith("before\n")
    assert text.endswith("\nafter\n")
    assert "old" not in text
    assert "`python -m benchmarks.run_tables recordings.slowing --data DIR`, commit `" in text
    assert "/films" not in text
    assert ("animal", "track", "worm-like") in asked
    assert (
        "animal",
        "track",
        "/films/worm-joint-angles/kymogram_omega-turn.npy",
        "--rate",
        "32",
    ) in asked
    assert capsys.readouterr().out.strip() in text


def test_a_row_of_walks_has_its_refused_states_and_the_range_of_times() -> None:
    assert states_cell(TRACK) == "523 of 600; 50 turn, 27 self-contact"
    assert states_cell(TRACK | {"states_refused": {"turn": 0}}) == "523 of 523"
    assert walk_cells(TRIALS) == ["2 of 2", "1", "0.079", "0.85", "47 to 56"]


def test_each_cell_has_a_column(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_tables, "_synthesised", lambda *_: made(REACHED, 0.1))
    answers = {
        "trials policy": {"table": [ROW], "trials": []},
        "trials": TRIALS,
        "animal track": [TRACK],
    }
    monkeypatch.setattr(
        run_tables,
        "snakewalk",
        lambda *words: answers[next(k for k in answers if " ".join(words).startswith(k))],
    )
    for table in TABLES.values():
        lines = table(Wanted(1, Path())).split("\n\n")[0].splitlines()
        assert len(lines) > 2
        assert len({line.count("|") for line in lines}) == 1


@pytest.mark.parametrize("name", TABLES)
def test_each_table_has_its_place_on_a_page(name: str) -> None:
    page, mark = name.split(".")
    text = page_of(page).read_text(encoding="utf-8")
    assert text.index(f"<!-- {mark} begins -->") < text.index(f"<!-- {mark} ends -->")


PLACES = sorted(
    place
    for source in Path(run_tables.__file__).parent.glob("*.py")
    for place in re.findall(r'write_tables\("([^"]+)", "([^"]+)"', source.read_text("utf-8"))
)


@pytest.mark.parametrize(("page", "mark"), PLACES)
def test_each_writer_names_a_page_with_its_marks(page: str, mark: str) -> None:
    text = page_of(page).read_text(encoding="utf-8")
    assert text.index(f"<!-- {mark} begins -->") < text.index(f"<!-- {mark} ends -->")


@pytest.mark.slow
def test_a_command_that_prints_no_json_stops_the_table() -> None:
    with pytest.raises(SystemExit, match="snakewalk animal track nothing"):
        run_tables.snakewalk("animal", "track", "nothing.csv")


def test_an_unknown_table_is_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["run_tables", "recordings", "nothing"])
    with pytest.raises(SystemExit):
        run_tables.main()
    assert "no table nothing; there are synthesis.waypoints" in capsys.readouterr().err
