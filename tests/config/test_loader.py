"""The loader reports every fault of a file at once, with where and what would be right."""

from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.errors import ConfigError
from snakewalk.config.ground import build_ground
from snakewalk.config.loader import checked, digest, load_robot, load_run, load_world, shipped
from snakewalk.config.run import RunConfig


@pytest.mark.parametrize(
    ("kind", "loader"), [("robots", load_robot), ("worlds", load_world), ("runs", load_run)]
)
def test_every_shipped_file_loads_under_its_own_name(kind, loader) -> None:
    names = shipped(kind)
    assert names
    assert [loader(name).name for name in names] == list(names)


def test_shipped_runs_name_shipped_robots_and_worlds() -> None:
    for name in shipped("runs"):
        run = load_run(name)
        assert load_robot(run.robot)
        assert load_world(run.world)


def test_all_faults_of_a_file_come_at_once(tmp_path: Path) -> None:
    file = tmp_path / "bad.toml"
    file.write_text(
        'name = "x"\nwaypoints_m = [[1, 2]]\ncycle_hz = -5\nspeeed = 3\n[walk]\ncarrot_m = "far"\n'
    )
    with pytest.raises(ConfigError) as caught:
        load_run(str(file))
    lines = caught.value.faults
    assert len(lines) == 3
    assert all(line.startswith(f"{file}:") for line in lines)
    text = "\n".join(lines)
    assert f"{file}:3: cycle_hz" in text
    assert f"{file}:4: speeed" in text
    assert f"{file}:6: walk.carrot_m" in text
    assert "cycle_hz" in text
    assert "speeed: unknown key" in text
    assert "walk.carrot_m" in text


def test_thousands_of_faults_are_counted(tmp_path: Path) -> None:
    """Each line of a fault is searched for in the text: 20,000 took 45 s."""
    file = tmp_path / "bad.toml"
    file.write_text("".join(f"key{k} = {k}\n" for k in range(2000)))
    with pytest.raises(ConfigError) as caught:
        load_run(str(file))
    assert len(caught.value.faults) == 101
    assert "further faults" in caught.value.faults[-1]


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ('seed = "3"', "seed: must be a whole number (got '3')"),
        ("seed = true", "seed: must be a whole number (got True)"),
        ("cycle_hz = true", "cycle_hz: must be a number (got True)"),
        ('physics_step_s = "0.002"', "physics_step_s: must be a number"),
        ('start_m = ["1", 0]', "start_m.0: must be a number (got '1')"),
        ("start_m = 3", "start_m: must be a list: [ ... ] (got 3)"),
        ("walk = 3", "walk: must be a table (got 3)"),
        ("time_limit_s = inf", "time_limit_s: must be a finite number"),
        ("time_limits = 9", "time_limits: unknown key; did you mean time_limit_s? (got 9)"),
        ("[walk]\ncandidate = 3", "walk.candidate: unknown key; did you mean candidates? (got 3)"),
        ("[zzz]", "zzz: unknown key"),
        ("[ground]", "ground: unknown key; it is a key of a world's file"),
        ("cycle_hz = 0", "cycle_hz: must be over 0 (got 0)"),
        ("seed = -1", "seed: must be at least 0 (got -1)"),
        ("start_m = [1, 2, 3]", "start_m: must have at most 2 values"),
        ("start_m = [1]", "start_m.1: is required"),
        ('pose = ""', "pose: must not be empty"),
        ("track = 3", "track: must be text (got 3)"),
        ("start_m = [1 2]", "not TOML: Unclosed array"),
    ],
)
def test_each_fault_has_its_line_and_what_would_be_right(
    line: str, said: str, tmp_path: Path
) -> None:
    file = tmp_path / "bad.toml"
    file.write_text(f'name = "x"\nwaypoints_m = [[1, 2]]\n{line}\n')
    with pytest.raises(ConfigError) as caught:
        load_run(str(file))
    (told,) = caught.value.faults
    number = 4 if "\n" in line else 3
    assert told.startswith(f"{file}:{number}: {said}")


def test_numbers_of_numpy_are_numbers_and_other_objects_a_fault() -> None:
    given = {"name": "x", "seed": np.int64(3), "waypoints_m": np.array([[1.0, 2.0]])}
    run = checked(RunConfig, given, "library")
    assert run.seed == 3
    assert run.waypoints_m == ((1.0, 2.0),)
    with pytest.raises(
        ConfigError, match=r"library: .*object cannot be a value of a configuration"
    ):
        checked(RunConfig, given | {"seed": object()}, "library")


def test_the_second_table_of_a_list_is_told_from_the_first(tmp_path: Path) -> None:
    file = tmp_path / "change.toml"
    file.write_text(
        'name = "x"\nmotion = "gait"\n[gait]\nname = "rolling"\n'
        '[[gait.then]]\nat_s = 5\nname = "rolling"\n[[gait.then]]\nat_s = "9"\nname = "rolling"\n'
    )
    with pytest.raises(ConfigError, match=r"change\.toml:9: gait\.then\.1\.at_s"):
        load_run(str(file))


def test_a_name_is_no_path_and_steers_no_terminal(tmp_path: Path) -> None:
    file = tmp_path / "x.toml"
    for name in ("../../../etc/x", "", ".hidden", r"a\u001b[31m", "x" * 101, r"a\\b"):
        file.write_text(f'name = "{name}"\nwaypoints_m = [[1, 2]]\n')
        with pytest.raises(ConfigError, match="name: "):
            load_run(str(file))
    file.write_text('name = "Schlangengrube 2, süd"\nwaypoints_m = [[1, 2]]\n')
    assert load_run(str(file)).name == "Schlangengrube 2, süd"


def test_a_byte_order_mark_is_no_fault(tmp_path: Path) -> None:
    file = tmp_path / "notepad.toml"
    file.write_bytes(b'\xef\xbb\xbfname = "x"\nwaypoints_m = [[1, 2]]\n')
    assert load_run(str(file)).name == "x"


def test_the_source_of_a_ground_stands_beside_the_world_that_names_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    np.savez(tmp_path / "hill.npz", elevation=np.zeros((30, 30)))
    (tmp_path / "w.toml").write_text(
        'name = "w"\n[ground]\nkind = "elevation"\nsource = "hill.npz"\n'
        "row = 0\ncolumn = 0\nrows = 30\ncolumns = 30\nspacing_m = 0.1\nvertical_scale = 1\n"
    )
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    world = load_world("../w.toml")
    monkeypatch.chdir("/")  # where a log is replayed, its world is that of the header
    assert build_ground(world) is not None
    monkeypatch.chdir(tmp_path / "elsewhere")
    (tmp_path / "hill.npz").write_text("x,y\n1,2\n")
    with pytest.raises(ConfigError, match=r"is not an \.npz with an array 'elevation'"):
        build_ground(load_world("../w.toml"))
    (tmp_path / "hill.npz").unlink()
    with pytest.raises(
        ConfigError, match=r"ground\.source: hill\.npz: no such file in the folder of"
    ):
        load_world("../w.toml")


@pytest.mark.parametrize("name", ["nosuch", "missing/file.toml"])
def test_missing_file_says_which(name: str) -> None:
    with pytest.raises(ConfigError, match=name):
        load_robot(name)


def test_broken_toml_says_where(tmp_path: Path) -> None:
    file = tmp_path / "torn.toml"
    file.write_text('name = "x\n')
    with pytest.raises(ConfigError, match=r"torn\.toml:1: not TOML: "):
        load_world(str(file))


def test_a_chain_too_long_for_the_bus_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "long.toml"
    file.write_text(f'name = "long"\njoint_axes = "{"y" * 16}"\n[servo]\nfirst_id = 240\n')
    with pytest.raises(ConfigError, match="255"):
        load_robot(str(file))


def test_digest_changes_with_any_value() -> None:
    run = load_run("flat-square")
    assert digest(run) == digest(load_run("flat-square"))
    assert digest(run) != digest(run.model_copy(update={"seed": run.seed + 1}))
