"""Results are whole or absent: an error or a full disk in mid-write leaves an old file alone."""

import ast
import errno
import json
import os
import resource
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import pytest
from pytest_mock import MockerFixture

from snakewalk.config.errors import InputError
from snakewalk.controller.cli.main import main
from snakewalk.controller.console.result_files import (
    RUN_FILES,
    atomic_write,
    cleared_folder,
    locked_folder,
    refuse_mixture,
    refuse_to_overwrite,
    run_folder,
)
from snakewalk.controller.repertoire.repertoire import Repertoire
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.results import write_artifacts
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.runtime.drive import Progress
from snakewalk.controller.studies.tune import Tuned
from tests.helpers.library import library
from tests.helpers.tiers import slow_after

WRITERS = {
    "write_text",
    "write_bytes",
    "savefig",
    "save",
    "save_postures",
    "write_mesh",
    "write_skin",
}
EXPORTS = {"write_csv", "write_parquet", "write_ros_bag", "write_foxglove_scene"}
"""Writers themselves, as `save` is: their callers are examined."""
STREAMS = {
    "bus_serve.py": "a recording of the line grows",
    "table.py": "a table grows by rows",
    "truth.py": "the truth of a served robot grows by rows",
    "result_lines.py": "the results of rehearsals and tasks grow by rows, and are continued",
    "live_page.py": "what viser prints goes to the null device",
}
"""Files that grow, each row whole, in place of being written at once."""

WRITERS_OF_A_KIND = frozenset(
    {
        "animals/fish/postures.py",
        "animals/fish/synthesis.py",
        "animals/mesh/skin_file.py",
        "capture/capture.py",
        "console/separate_reader.py",
        "images/mesh_files.py",
        "mapping/las_file.py",
        "mapping/mosaic/place_mesh.py",
        "motion/policy.py",
        "runlog/writer.py",
        "terrain/growing_map.py",
        "track/readers/arrays.py",
        "track/readers/writers.py",
    }
)
"""Writers of one kind of file, as `save` is: their callers are examined."""


@contextmanager
def full_disk(limit_bytes: int) -> Iterator[None]:
    """Let no file grow beyond ``limit_bytes``."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit_bytes, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_an_error_leaves_no_file(tmp_path: Path) -> None:
    with suppress(KeyboardInterrupt), atomic_write(tmp_path / "new.txt") as part:
        part.write_text("half")
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")
    with full_disk(100), pytest.raises(OSError, match="File too large"), atomic_write(path) as part:
        part.write_text("new" * 100)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_files_beside_it_are_moved_along(tmp_path: Path) -> None:
    with atomic_write(tmp_path / "sub" / "a.obj") as part:
        part.write_text("mesh")
        part.with_suffix(".mtl").write_text("material")
    assert sorted(file.name for file in (tmp_path / "sub").iterdir()) == ["a.mtl", "a.obj"]


def test_each_run_has_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("job", "job-2", "job-3"):
        with run_folder("job", None) as folder:
            (folder / "log.mcap").write_text(name)
        assert folder == Path("runs") / name
    with suppress(InputError), run_folder("job", None) as folder:
        raise InputError("refused before anything was written")
    assert not folder.exists()
    with run_folder("job", tmp_path / "mine") as folder:
        assert folder == tmp_path / "mine"
    with (
        pytest.raises(InputError, match="/proc/mine: cannot be made"),
        run_folder("job", Path("/proc/mine")),
    ):
        pass


def test_a_run_never_mixes_with_another(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    for name in RUN_FILES:
        (tmp_path / name).write_text("old")
    job = prepare_gait("lateral-undulation", seconds=0.2)
    with pytest.raises(InputError, match=r"holds a run \(log\.mcap, .*--force"):
        run_robot(RunRequest(job, tmp_path))
    assert {path.read_text() for path in tmp_path.iterdir()} == {"old"}
    (tmp_path / "notes.txt").write_text("mine")
    run_robot(RunRequest(job, tmp_path, overwrite=True))
    left = sorted(path.name for path in tmp_path.iterdir())
    assert left == ["log.mcap", "notes.txt", "summary.json"], "no film and page of the old run"


def test_force_does_not_touch_the_folder_of_a_run_under_way(tmp_path: Path) -> None:
    """Both runs reported success, and one result was gone."""
    pytest.importorskip("mujoco")
    folder = tmp_path / "run"
    job = prepare_gait("lateral-undulation", seconds=0.2)
    refused: list[str] = []

    def on_progress(progress: Progress) -> None:
        if not refused:
            with pytest.raises(InputError) as info:
                run_robot(RunRequest(job, folder, overwrite=True))
            refused.append(str(info.value))

    finished = run_robot(RunRequest(job, folder, on_progress=on_progress))
    assert refused == [
        f"{folder}: another run uses this folder; give another --out, or wait for its end"
    ]
    assert finished.log.exists()
    run_robot(RunRequest(job, folder, overwrite=True))


def test_runs_that_start_together_in_one_folder_are_told_apart(tmp_path: Path) -> None:
    """Each had found the folder free when it checked."""
    with cleared_folder(tmp_path, force=False):
        (tmp_path / "log.mcap.part").write_text("first")
        for force in (True, False):
            with (
                pytest.raises(InputError, match="another run uses this folder"),
                cleared_folder(tmp_path, force),
            ):
                pass
        (tmp_path / "log.mcap.part").rename(tmp_path / "log.mcap")
    with pytest.raises(InputError, match=r"holds a run"), cleared_folder(tmp_path, force=False):
        pass
    assert (tmp_path / "log.mcap").read_text() == "first"


def test_report_and_film_of_a_run_that_is_made_anew_are_left_alone(
    tmp_path: Path,
) -> None:
    pytest.importorskip("mujoco")
    finished = run_robot(RunRequest(prepare_gait("lateral-undulation", seconds=0.2), tmp_path))
    with locked_folder(tmp_path), pytest.raises(InputError, match="another run uses this folder"):
        write_artifacts(finished.record, tmp_path, film=None)
    assert not (tmp_path / "report.html").exists()


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.EBADF, errno.EOPNOTSUPP])
def test_a_disk_without_locks_holds_runs_all_the_same(
    number: int, tmp_path: Path, mocker: MockerFixture
) -> None:
    mocker.patch("fcntl.flock", side_effect=OSError(number, os.strerror(number)))
    with cleared_folder(tmp_path, force=False):
        pass


def test_a_page_never_stands_beside_the_log_of_another_run(tmp_path: Path) -> None:
    one, other, pages = (tmp_path / name for name in ("one", "other", "pages"))
    for folder in (one, other, pages):
        folder.mkdir()
    for folder in (one, other):
        (folder / "log.mcap").write_text(folder.name)
        (folder / "film.mp4").write_text(folder.name)
    refuse_mixture(one / "log.mcap", one, force=False)
    refuse_mixture(one / "log.mcap", pages, force=False)
    for force in (False, True):
        with pytest.raises(InputError, match="another run's log; give another --out"):
            refuse_mixture(one / "log.mcap", other, force=force)
    assert (other / "film.mp4").read_text() == "other"
    (pages / "film.mp4").write_text("another's")
    with pytest.raises(InputError, match="holds a run"):
        refuse_mixture(one / "log.mcap", pages, force=False)
    refuse_mixture(one / "log.mcap", pages, force=True)
    assert list(pages.iterdir()) == []


def test_a_folder_that_takes_no_file_is_told_before_any_work() -> None:
    with pytest.raises(InputError, match=r"^/proc: takes no file: "):
        refuse_to_overwrite([Path("/proc/tuned.toml")], force=True)


def arguments(command: str, out: Path) -> list[str]:
    return {
        "match": ["animal", "fish", "match", "midlines.npz", "-o", str(out)],
        "record": ["gait", "repertoire", "record", "-o", str(out)],
        "tune": ["gait", "tune", "rolling", "-o", str(out)],
        "mesh": ["animal", "body", "worm-like", "-o", str(out)],
        "skin": ["animal", "body", "snake", "--animate", "worm-like", "-o", str(out)],
        "gait": ["gait", "show", "rolling", "--picture", str(out)],
        "analysis": ["animal", "analyse", "midlines.npz", "--picture", str(out)],
    }[command]


@pytest.mark.slow_cases(4, "13 cases of 0.5 s of CPU")
@pytest.mark.fast_cases(1)
@pytest.mark.costs("starts commands on a full disk")
@pytest.mark.parametrize(
    ("command", "name"),
    [
        *(("match", "p.npz"), ("record", "r.npz"), ("tune", "t.toml"), ("mesh", "m.glb")),
        *(("gait", "g.png"), ("analysis", "a.png"), ("skin", "s.glb")),
    ],
)
@pytest.mark.parametrize("old", slow_after(1, [b"old", None]))
def test_commands_leave_nothing_on_a_full_disk(
    command: str,
    name: str,
    old: bytes | None,
    tmp_path: Path,
    mocker: MockerFixture,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    out = tmp_path / "results" / name
    out.parent.mkdir()
    words = arguments(command, out)
    if old is not None:
        out.write_bytes(old)
        words += ["--force"]
    points = np.cumsum(np.ones((20, 100, 2)), axis=1) / 100.0
    points[..., 1] += 0.1 * np.sin(np.arange(20.0)[:, None] + np.linspace(0, 6, 100))
    np.savez(tmp_path / "midlines.npz", points=points, rate_hz=25.0)
    mocker.patch(
        "snakewalk.controller.repertoire.repertoire_recording.record",
        return_value=Repertoire("yaw16", "y" * 16, "flat", 1.0, ()),
    )
    mocker.patch(
        "snakewalk.controller.studies.tune.tune",
        return_value=Tuned("rolling", "yaw16", "speed", {"frequency_hz": 0.1}, 8, (1.0,), (1.1,)),
    )
    monkeypatch.setattr("sys.argv", ["snakewalk", *words])
    with full_disk(20), pytest.raises(SystemExit):
        main()
    assert capsys.readouterr().err.splitlines()[-1] == f"snakewalk: {out}: File too large"
    assert [file.name for file in out.parent.iterdir()] == ([] if old is None else [name])
    if old is not None:
        assert out.read_bytes() == old


def unsafe(nodes: list[ast.AST]) -> list[int]:
    """Lines that write a file outside ``with atomic_write``, or a folder that is deleted again."""
    safe: set[ast.AST] = set()
    for block in nodes:
        if isinstance(block, ast.With):
            calls = [item.context_expr for item in block.items]
            names = {getattr(c.func, "id", "") for c in calls if isinstance(c, ast.Call)}
            if names & {"atomic_write", "TemporaryDirectory"}:
                safe |= set(ast.walk(block))
        elif isinstance(block, ast.FunctionDef) and block.name in EXPORTS | {"save"}:
            safe |= set(ast.walk(block))  # a writer itself: its callers are examined
    return [
        node.lineno
        for node in nodes
        if isinstance(node, ast.Call) and node not in safe and writes(node)
    ]


def writes(call: ast.Call) -> bool:
    """Whether a call writes a file."""
    name = getattr(call.func, "attr", None) or getattr(call.func, "id", "")
    if call.args and getattr(call.args[0], "id", "") == "buffer":
        return False  # in memory
    modes = [arg.value for arg in call.args if isinstance(arg, ast.Constant)]
    opened = name == "open" and any(str(mode)[:1] in "wax" for mode in modes)
    return opened or name in WRITERS | EXPORTS or name.startswith("savez")


@pytest.mark.costs("reads every source file")
def test_every_result_is_written_atomically() -> None:
    found = {
        f"{file.name}:{line}"
        for file in library("controller/")
        if file.name.rpartition("/")[2] not in STREAMS
        and file.name.removeprefix("controller/") not in WRITERS_OF_A_KIND
        for line in unsafe(file.nodes)
    }
    assert found == set()


def test_a_full_disk_ends_a_run_and_says_what_became_of_torque_and_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("mujoco")
    job = prepare_gait("lateral-undulation", seconds=2.0)  # what numba keeps is written by now
    run_robot(RunRequest(job, tmp_path / "before"))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["snakewalk", "gait", "run", "lateral-undulation"])
    with full_disk(60_000), pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 1
    folder = Path("runs") / "gait-lateral-undulation-yaw16"
    part = folder / "log.mcap.part"
    assert capsys.readouterr().err.splitlines()[-1] == (
        f"snakewalk: {part}: File too large; torque is off; the run up to there: "
        f"snakewalk log report {part}"
    )
    assert [path.name for path in folder.iterdir()] == ["log.mcap.part"]
    assert len(read_log(part).cycle.time_s) > 0


BEFORE_WORK = [
    "gait sweep rolling -o nosuch/a.csv",
    "gait sweep rolling --picture nosuch/a.png",
    "trials run -o nosuch/a.csv",
    "trials run --picture nosuch/a.png",
    "trials run --picture held.png",
    "gait tune rolling -o nosuch/a.toml",
    "gait repertoire record -o nosuch/a.npz",
    "gait repertoire show --picture nosuch/a.png",
    "animal track worm-like -o nosuch/a.npz",
    "animal graph --picture nosuch/a.png",
    "gait show rolling --picture nosuch/a.png",
]
PROGRAM = """
import json, sys
from snakewalk.config.errors import InputError
from snakewalk.controller.cli.command_line import app
said = []
for words in json.loads(sys.argv[1]):
    try:
        app(words.split())
    except InputError as error:
        said.append(str(error))
heavy = {"numba", "scipy", "mujoco", "matplotlib", "networkx"} & set(sys.modules)
print(json.dumps([said, sorted(heavy)]))
"""


@pytest.mark.slow
def test_where_nothing_can_be_written_is_told_before_anything_heavy_is_imported(
    tmp_path: Path,
) -> None:
    (tmp_path / "held.png").touch()
    words = [sys.executable, "-c", PROGRAM, json.dumps(BEFORE_WORK)]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=True)
    said, heavy = json.loads(done.stdout)
    expected = [
        "held.png: exists; --force overwrites it" if "held" in command else "nosuch: no such folder"
        for command in BEFORE_WORK
    ]
    assert said == expected
    assert heavy == []
