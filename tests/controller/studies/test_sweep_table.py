"""The table of a sweep survives a kill: no finished row is lost, none is run twice."""

from dataclasses import fields, replace
from math import nan
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib import rc_context

from snakewalk.config.errors import InputError
from snakewalk.controller.console.parquet import table_to_parquet
from snakewalk.controller.studies.plots.sweep import draw_sweep
from snakewalk.controller.studies.sweep_measure import Measurement
from snakewalk.controller.studies.sweep_points import Point
from snakewalk.controller.studies.sweep_table import (
    COLUMNS,
    KINDS,
    SweepTable,
    digest,
    read_table,
)

pytestmark = pytest.mark.usefixtures("legible_figures")

POINTS = [
    Point("lateral-undulation", "yaw16", "flat", n, 0, 10.0, {"waves": 1.0 + 0.1 * n})
    for n in range(6)
]


def row(forward_bl: float, backend: str = "compiled") -> Measurement:
    ones: dict[str, Any] = dict.fromkeys((field.name for field in fields(Measurement)), 1.0)
    given: dict[str, Any] = {"ended": "ran to its end", "cycles": 5, "forward_bl_cycle": forward_bl}
    given["backend"] = backend
    return Measurement(**ones | given)


def test_a_sweep_in_which_no_body_moved_has_a_picture(tmp_path: Path) -> None:
    """Costs of transport that are unknown have no place on a logarithmic scale: a traceback."""
    table, picture = tmp_path / "sweep.csv", tmp_path / "sweep.png"
    with SweepTable(table) as rows:
        rows.add(POINTS[0], replace(row(0.0), cost_of_transport=nan))
    draw_sweep(read_table(table), picture)
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_points_without_a_cost_are_counted(tmp_path: Path) -> None:
    path, picture = tmp_path / "sweep.csv", tmp_path / "sweep.svg"
    with SweepTable(path) as rows:
        for point, cost in zip(POINTS[:4], (0.5, 1.0, nan, -1.0), strict=True):
            rows.add(point, replace(row(0.2), cost_of_transport=cost))
    with rc_context({"svg.fonttype": "none"}):
        draw_sweep(read_table(path), picture)
    assert "2 of 4 without pace or cost" in picture.read_text(encoding="utf-8")


def test_columns_are_unique() -> None:
    assert len(set(COLUMNS)) == len(COLUMNS)


@settings(max_examples=40)
@given(finished=st.integers(0, 6), torn=st.integers(0, 400))
def test_cut_off_anywhere_it_goes_on_where_it_was(
    tmp_path_factory: pytest.TempPathFactory, finished: int, torn: int
) -> None:
    path = tmp_path_factory.mktemp("sweep") / "sweep.csv"
    with SweepTable(path) as table:
        for k in range(finished):
            table.add(POINTS[k], row(0.1 * k))
    assert path.exists() == (finished > 0), "no table without rows"
    whole = path.read_bytes() if finished else b""
    path.write_bytes(whole[: max(len(whole) - torn, 0)])
    kept = path.read_bytes().count(b"\n") - 1
    if kept < 0:  # not even the heads are whole
        path.unlink()
    again = SweepTable(path)
    missing = again.missing(POINTS)
    assert [p.number for p in missing] == list(range(max(kept, 0), 6))
    with again:
        for point in missing:
            again.add(point, row(0.1 * point.number))
    rows = read_table(path)
    assert [int(r["number"]) for r in rows] == list(range(6))
    assert path.read_bytes().startswith(whole[: whole.find(b"\n")])


def test_other_seeds_are_other_points(tmp_path: Path) -> None:
    with SweepTable(tmp_path / "t.csv") as table:
        table.add(POINTS[0], row(0.1))
    other = Point("lateral-undulation", "yaw16", "flat", 0, 1, 10.0)
    assert SweepTable(tmp_path / "t.csv").missing([POINTS[0], other]) == [other]


def test_other_replaced_values_are_other_points_and_a_row_of_their_own(tmp_path: Path) -> None:
    table = tmp_path / "t.csv"
    keys = (("world.friction.across", 0.4), ("run.seed", 3))
    other = replace(POINTS[0], keys=keys)
    with SweepTable(table) as rows:
        rows.add(POINTS[0], row(0.1))
        rows.add(other, row(0.2))
    assert SweepTable(table).missing([POINTS[0], other]) == []
    assert SweepTable(table).missing([replace(other, keys=keys[:1])]) != []
    told = [one.keys for one in digest(read_table(table))]
    assert told == ["", "world.friction.across=0.4 run.seed=3"]


def test_another_file_is_not_touched(tmp_path: Path) -> None:
    path = tmp_path / "mine.csv"
    path.write_text("a,b\n1,2\n")
    with pytest.raises(InputError, match="is not a table of"):
        SweepTable(path)
    assert path.read_text() == "a,b\n1,2\n"


def test_digest_takes_the_defaults_and_the_best(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    with SweepTable(path) as table:
        for point in POINTS:
            table.add(point, row(0.3 - 0.1 * abs(point.number - 3)))
        tripped = Point("lateral-undulation", "yaw16", "flat", 6, 0, 10.0)
        table.add(tripped, Measurement("refused: no"))
    (one,) = digest(read_table(path))
    assert one.points == 7
    assert one.tripped == 1
    assert one.most_bl_cycle == pytest.approx(1.044, abs=1e-3)  # hypot(0.3, left 1.0)


def test_a_table_becomes_parquet_with_types(tmp_path: Path, monkeypatch: Any) -> None:
    """In blocks: a table of 100,000 rows is never in memory as a whole."""
    parquet = pytest.importorskip("pyarrow.parquet")
    monkeypatch.setattr("snakewalk.controller.console.parquet.BLOCK_BYTES", 2000)
    path, out = tmp_path / "sweep.csv", tmp_path / "sweep.parquet"
    with SweepTable(path) as table:
        for k in range(30):
            point = replace(POINTS[k % 6], number=k)
            table.add(point, row(0.1 * k) if k != 3 else Measurement("refused: no, never"))
    assert table_to_parquet(path, out, KINDS) == 30
    found = parquet.read_table(out)
    assert parquet.ParquetFile(out).num_row_groups > 1
    assert tuple(found.column_names) == COLUMNS
    rows = found.to_pylist()
    assert [one["number"] for one in rows] == list(range(30))
    assert [one["waves"] for one in rows[:6]] == pytest.approx([1.0 + 0.1 * k for k in range(6)])
    assert (rows[0]["mirror"], rows[0]["cycles"]) == (False, 5)
    assert (rows[3]["ended"], rows[3]["cycles"]) == ("refused: no, never", None)


def test_a_table_of_finished_points_keeps_no_rows(tmp_path: Path) -> None:
    path = tmp_path / "sweep.csv"
    with SweepTable(path) as table:
        table.add(POINTS[0], row(0.1))
    again = SweepTable(path)
    assert again.missing(POINTS) == POINTS[1:]
    assert again.held(POINTS[0].key) == {}
