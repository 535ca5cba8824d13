"""``snakewalk gait repertoire`` and ``snakewalk plan --with repertoire`` from outside."""

import json
from pathlib import Path

import pytest

from snakewalk.controller.repertoire.repertoire import Repertoire
from tests.helpers.command import snakewalk


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_help_has_an_example() -> None:
    for command in ("record", "show", "play", "run"):
        done = snakewalk("gait", "repertoire", command, "--help")
        assert done.returncode == 0, done.stderr
        assert f"snakewalk gait repertoire {command}" in done.stdout


def test_plan_save_and_refuse_to_overwrite(repertoire: Repertoire, tmp_path: Path) -> None:
    repertoire.save(tmp_path / "repertoire-yaw16-flat.npz")
    words = ("plan", "flat-slalom", "--with", "repertoire", "-o", "plan.json", "--json")
    done = snakewalk(*words)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["waypoints_reached"] == 5
    plan = json.loads((tmp_path / "plan.json").read_text())
    assert plan["actions"] == found["actions"]
    again = snakewalk(*words)
    assert again.returncode == 2
    assert again.stderr == "snakewalk: plan.json: exists; --force overwrites it\n"
    shown = snakewalk("gait", "repertoire", "show", "repertoire-yaw16-flat.npz", "--json")
    rows = json.loads(shown.stdout)["actions"]
    assert [row["name"] for row in rows] == [segment.name for segment in repertoire.segments]


@pytest.mark.fast_cases(6)
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("plan", "--with", "physics"), "--with physics: unknown; valid: repertoire"),
        (("plan", "flat-slalom", "--with", "repertoire"), "snakewalk gait repertoire record"),
        (
            ("plan", "flat-slalom", "--with", "repertoire", "--motion", "walk"),
            "does not use --motion",
        ),
        (("plan", "flat-slalom", "--run"), "belong to --with repertoire"),
        (("gait", "repertoire", "record", "--world", "jacksboro-gentle"), "flat one"),
        (("gait", "repertoire", "record", "-o", "no/where.npz"), "no such folder"),
        (("gait", "repertoire", "record", "--robot", "nosuch"), "nosuch"),
        (("gait", "repertoire", "show", "none.npz"), "no such file"),
        (("gait", "repertoire", "run", "none.json"), "no such plan"),
        (("gait", "repertoire", "play", "none.npz"), "no such file"),
        (
            ("gait", "repertoire", "play", "--speed", "1", "--schedule", "a.csv"),
            "leave out --speed",
        ),
        (("gait", "repertoire", "play", "--schedule", "none.toml"), "none.toml"),
        (("gait", "repertoire", "play", "--seconds", "0"), "must be over 0"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(
    tmp_path: Path, words: tuple[str, ...], said: str
) -> None:
    done = snakewalk(*words)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert said in done.stderr
    assert not list(tmp_path.iterdir())
