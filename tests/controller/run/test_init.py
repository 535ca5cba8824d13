"""What ``snakewalk init`` writes is a run as it is; a typo in it is told without heavy imports."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from snakewalk.config.loader import load_robot, load_run, load_world
from snakewalk.controller.cli.command_line import app
from snakewalk.controller.run.factory import prepare_walk


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize(
    ("words", "run_like", "robot_like", "world_like"),
    [
        ([], "flat-square", "printed12", "flat"),
        (["--robot", "xl330-16"], "flat-slalom-xl330", "xl330-16", "flat"),
        (["--robot", "alternating12"], "flat-square", "alternating12", "flat"),
        (["--from", "ramp-10-up"], "ramp-10-up", "alternating16", "ramp-10"),
    ],
)
def test_the_files_are_the_run_that_they_were_made_of(
    words: list[str], run_like: str, robot_like: str, world_like: str, tmp_path: Path
) -> None:
    folder = tmp_path / "new" / "mine"
    done = CliRunner().invoke(app, ["init", str(folder), *words, "--json"])
    assert done.exit_code == 0, done.output
    made = json.loads(done.output)
    assert all(Path(file).is_file() for file in made["files"])
    run = load_run(str(folder / "run.toml"))
    named = {"name": "my-run", "robot": "robot.toml", "world": "world.toml"}
    assert run == load_run(run_like).model_copy(update=named)
    robot, world = load_robot(str(folder / "robot.toml")), load_world(str(folder / "world.toml"))
    assert robot == load_robot(robot_like).model_copy(update={"name": "my-robot"})
    assert world == load_world(world_like).model_copy(update={"name": "my-world"})
    assert json.loads((folder / "schema" / "robot.json").read_text())["title"]


def test_a_run_from_another_folder_keeps_its_track_and_is_prepared(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    x = [f"{frame},{k},{0.1 * k},0" for frame in range(3) for k in range(11)]
    (tmp_path / "a" / "m.csv").write_text("\n".join(["frame,point,x_m,y_m", *x]) + "\n")
    own = tmp_path / "a" / "own.toml"
    own.write_text('name = "own"\nwaypoints_m = [[1.0, 0.0]]\ntrack = "m.csv"\n')
    folder = tmp_path / "b"
    assert CliRunner().invoke(app, ["init", str(folder), "--from", str(own)]).exit_code == 0
    assert load_run(str(folder / "run.toml")).track == str(tmp_path / "a" / "m.csv")
    assert CliRunner().invoke(app, ["init", str(tmp_path / "c")]).exit_code == 0
    prepared = prepare_walk(str(tmp_path / "c" / "run.toml"))
    assert (prepared.robot.name, prepared.world.name) == ("my-robot", "my-world")
    again = CliRunner().invoke(app, ["init", str(folder)])
    assert again.exit_code != 0


@pytest.mark.slow
def test_a_typo_is_told_before_anything_heavy_is_imported(tmp_path: Path) -> None:
    (tmp_path / "robot.toml").write_text('name = "r"\njoint_axis = "yyyy"\n')
    (tmp_path / "run.toml").write_text(
        'name = "a"\nrobot = "robot.toml"\nwaypoints_m = [[1.0, 0.0]]\n'
    )
    program = (
        "import sys\n"
        "from snakewalk.controller.cli.command_line import app\n"
        "try:\n"
        "    app(['run', 'run.toml'])\n"
        "except Exception as error:\n"
        "    print(error)\n"
        "print(sorted({'numba', 'scipy', 'mujoco', 'matplotlib', 'networkx'} & set(sys.modules)))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
        timeout=600,
    )
    told_first = done.stdout.splitlines()[0]
    assert told_first.startswith("robot.toml:2: joint_axis: unknown key; did you mean joint_axes?")
    assert done.stdout.splitlines()[-1] == "[]"


def test_what_is_shipped_is_listed_by_kind() -> None:
    listed = json.loads(CliRunner().invoke(app, ["list", "--json"]).stdout)
    assert set(listed) == {
        "runs",
        "robots",
        "worlds",
        "recordings",
        "policies",
        "gaits",
        "plug-ins",
    }
    assert "worm-like" in listed["recordings"]
    assert "sidewinding-fast" in listed["gaits"]
