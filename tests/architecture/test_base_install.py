"""The base install (no extras) runs a robot; what needs an extra says which one."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.helpers.command import command_words

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "tests" / "helpers" / "base_install.py"


class Result(NamedTuple):
    """Of one command."""

    code: int
    out: str
    err: str


def call(folder: Path, *commands: tuple[str, ...], without: tuple[str, ...] = ()) -> list[Result]:
    """Run commands one after the other in one interpreter without extras, in ``folder``."""
    ran = subprocess.run(
        [sys.executable, str(SCRIPT), *without],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT), "COLUMNS": "100", "TERM": "dumb"},
        input=json.dumps(commands),
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    return [Result(*row) for row in json.loads(ran.stdout)]


BASE = [
    ("bus", "scan", "--port", "./tty", "--baud", "1000000"),
    ("doctor", "--port", "./tty", "--robot", "yaw16"),
    ("bus", "set", "--port", "./tty", "--id", "3", "--return-delay", "0", "--yes"),
    ("list",),
    ("gait", "list"),
    ("gait", "show", "rolling"),
    ("plan", "flat-slalom", "--motion", "serpenoid"),
    ("animal", "track", "worm-like"),
    ("animal", "analyse", "worm-like"),
    ("animal", "graph", "--graph", "er:40:5", "--repeats", "2"),
    ("play", "worm-like", "--port", "./tty", "--robot", "yaw16", "--out", "p"),
    ("bus", "serve", "--servos", "1-2", "--for", "0.1"),
]
"""Commands that need no extra."""

NEEDY = [
    (("run", "flat-slalom"), "sim"),
    (("gait", "run", "lateral-undulation"), "sim"),
    (("play", "worm-like"), "sim"),
    (("log", "replay", "log.mcap"), "sim"),
    (("log", "shadow", "log.mcap"), "sim"),
    (("gait", "run", "lateral-undulation", "--shadow", "--port", "./tty"), "sim"),
    (("bus", "serve", "--robot", "yaw16"), "sim"),
    (("gait", "sweep", "rolling", "--points", "1"), "sim"),
    (("gait", "sweep", "rolling", "--points", "1", "--dask", "tcp://localhost:1"), "sweep"),
    (("gait", "sweep", "rolling", "--points", "1", "--backend", "warp"), "warp"),
    (("gait", "tune", "rolling"), "sim"),
    (("trials", "run", "flat-slalom", "--seeds", "1"), "sim"),
    (("gait", "repertoire", "record"), "sim"),
    (("gait", "show", "rolling", "--picture", "a.png"), "view"),
    (("gait", "fit", "curve.csv", "--picture", "a.png"), "view"),
    (("animal", "track", "worm-like", "--picture", "a.png"), "view"),
    (("animal", "analyse", "worm-like", "--picture", "a.png"), "view"),
    (("animal", "graph", "--picture", "a.png"), "view"),
    (("gait", "sweep", "rolling", "--picture", "a.png"), "view"),
    (("gait", "repertoire", "record", "--picture", "a.png"), "view"),
    (("animal", "body", "worm-like", "-o", "b.glb"), "vision"),
    (("animal", "capture", "film.mp4"), "vision"),
    (("animal", "fish", "match", "film.mp4"), "vision"),
    (("animal", "fish", "film", "tank"), "vision"),
    (("log", "export", "log.mcap", "--ros2", "b.mcap"), "export"),
    (("ros",), "ros"),
    (("log", "export", "log.mcap", "--parquet", "tables"), "export"),
    (("run", "flat-slalom", "--pose", "camera", "--port", "./tty"), "vision"),
]
"""Commands, and the extra that each needs."""

ON_SERVOS = ("--port", "./tty", "--json")
GAIT = ("gait", "run", "lateral-undulation", "--seconds", "2", "--out", "gait", *ON_SERVOS)
JOB = (
    *("run", "flat-slalom", "--motion", "serpenoid", "--pose", "joints", "--out", "j"),
    *("--set", "run.time_limit_s=5", *ON_SERVOS),
)
EXPORT = ("log", "export", "gait/log.mcap", "--csv", "tables", "--foxglove", "f.mcap", "--json")
HELP = [(*words, "--help") for words in command_words()]


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[tuple[str, ...], Result]:
    """Every command above, each once, in one interpreter: importing takes longer than running."""
    words = [GAIT, JOB, EXPORT, *BASE, *(words for words, _ in NEEDY), *HELP]
    return dict(zip(words, call(tmp_path_factory.mktemp("base"), *words), strict=True))


def test_a_motion_runs_on_servos(results: dict[tuple[str, ...], Result]) -> None:
    ran = results[GAIT]
    assert ran.code == 0, ran.err
    result = json.loads(ran.out)
    assert result["tripped"] is None
    assert result["duration_s"] > 2.0
    assert result["report"] is None
    assert result["film"] is None
    assert "snakewalk: no film: films need MuJoCo and PyAV: pip install" in ran.err
    assert "snakewalk: no report: the report needs matplotlib and Plotly: pip install" in ran.err


def test_a_log_becomes_tables_and_a_scene(results: dict[tuple[str, ...], Result]) -> None:
    ran = results[EXPORT]
    assert ran.code == 0, ran.err
    assert json.loads(ran.out)["written"]["tables/cycle.csv"] > 100


def test_a_job_runs_on_servos_by_its_joints_alone(results: dict[tuple[str, ...], Result]) -> None:
    ran = results[JOB]
    assert ran.code in {0, 1}, ran.err
    assert json.loads(ran.out)["tripped"] is None


@pytest.mark.parametrize("words", BASE, ids=" ".join)
def test_a_command_needs_no_extra(
    words: tuple[str, ...], results: dict[tuple[str, ...], Result]
) -> None:
    ran = results[words]
    assert ran.code == 0, ran.err


@pytest.mark.parametrize(("words", "extra"), NEEDY, ids=[" ".join(words) for words, _ in NEEDY])
def test_a_command_that_needs_an_extra_names_it(
    words: tuple[str, ...], extra: str, results: dict[tuple[str, ...], Result]
) -> None:
    ran = results[words]
    assert ran.code == 2, ran.err
    lines = [line for line in ran.err.splitlines() if line.startswith("snakewalk: ")]
    assert len(lines) == 1, ran.err
    assert f"pip install 'snakewalk[{extra}]'" in lines[0]


def test_help_of_every_command(results: dict[tuple[str, ...], Result]) -> None:
    assert len(HELP) > 25
    for words in HELP:
        assert results[words].code == 0, results[words].err
        assert "Usage: " in results[words].out


@pytest.mark.nightly("runs loops in Python: 6 s of CPU")
def test_servos_move_without_the_compiler_at_a_rate_that_it_sustains(tmp_path: Path) -> None:
    fast = (*GAIT[:3], "--out", "fast", "--set", "run.cycle_hz=100", *ON_SERVOS)
    scanned, examined, moved, rejected = call(
        tmp_path, BASE[0], BASE[1], GAIT, fast, without=("numba", "llvmlite")
    )
    assert scanned.code == 0, scanned.err
    assert examined.code == 0, examined.err
    assert moved.code == 0, moved.err
    assert json.loads(moved.out)["tripped"] is None
    assert rejected.code == 2
    assert "without numba the loops of a cycle sustain at most 50 Hz" in rejected.err
