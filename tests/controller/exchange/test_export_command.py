"""``snakewalk log export``: what it writes, and what it refuses."""

import csv
import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from snakewalk.config.errors import InputError
from snakewalk.controller.cli.command_line import app


def run(*words: str | Path) -> str:
    done = CliRunner().invoke(app, ["log", "export", *map(str, words)], catch_exceptions=False)
    return done.output


def refused(*words: str | Path) -> str:
    done = CliRunner().invoke(app, ["log", "export", *map(str, words)])
    assert isinstance(done.exception, InputError), done.output
    return str(done.exception)


def test_all_formats_at_once(log: Path, tmp_path: Path) -> None:
    folder, bag, scene = tmp_path / "tables", tmp_path / "bag.mcap", tmp_path / "scene.mcap"
    told = json.loads(run(log, "--csv", folder, "--ros2", bag, "--foxglove", scene, "--json"))
    assert set(told["written"]) == {str(p) for p in (*folder.iterdir(), bag, scene)}
    assert told["written"][str(folder / "cycle.csv")] == 20
    assert told["written"][str(bag)]["/tf"] == 20
    assert b"ros2" in bag.read_bytes()[:40]  # the profile


def test_nothing_is_replaced_unless_told(log: Path, tmp_path: Path) -> None:
    folder = tmp_path / "tables"
    folder.mkdir()
    old = folder / "cycle.csv"
    old.write_text("mine")
    assert "cycle.csv: exists; --force" in refused(log, "--csv", folder)
    assert [p.name for p in folder.iterdir()] == ["cycle.csv"]
    assert old.read_text() == "mine"
    assert "cycle.csv  20 rows" in run(log, "--csv", folder, "--force")
    assert old.read_text().startswith("time_s,")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ((), "choose what to write"),
        (("--ros2", "bag.db3"), "bag.db3: is an MCAP file; name it bag.mcap"),
        (("--ros2", "a.mcap", "--foxglove", "a.mcap"), "have the same name"),
        (("--csv", "no/such/folder"), "no/such: no such folder"),
    ],
)
def test_what_is_refused(log: Path, words: tuple[str, ...], says: str) -> None:
    assert says in refused(log, *words)


def test_the_log_itself_is_never_replaced(log: Path) -> None:
    before = log.read_bytes()
    assert "is the log itself" in refused(log, "--foxglove", log, "--force")
    assert log.read_bytes() == before


def test_a_log_that_is_none(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    path.write_bytes(b"nothing")
    assert "is not an MCAP log" in refused(path, "--csv", tmp_path / "t")
    assert not (tmp_path / "t").exists()


def test_columns_have_the_names_of_the_joints(log: Path, tmp_path: Path) -> None:
    run(log, "--csv", tmp_path / "now")
    names = (tmp_path / "now/slow.csv").read_text(encoding="utf-8").splitlines()[0].split(",")
    assert names[:3] == ["time_s", "temperature_yaw_01_c", "temperature_pitch_02_c"]
    with (tmp_path / "now/cycle.csv").open(encoding="utf-8", newline="") as file:
        assert [row["joints"] for row in csv.DictReader(file)][2:5] == ["", "yaw_03 yaw_05", ""]
